"""Orders: what can be asked of a running vehicle. Each is a value that stands as one line of JSON in a log."""

from __future__ import annotations

import math
from typing import Literal, get_args

import msgspec

from cosim.errors import OrderError
from cosim.scenario.tables import Vector3, Vector6

Mode = Literal["manual", "hold", "reach", "mission", "surface"]

MODES: tuple[Mode, ...] = get_args(Mode)  # a mode's index is its number in the record

NO_ORDER = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)  # what msgspec raises at a text that is none

_FAR = 1e5  # m; beyond it nothing is ordered
_FAST = 1e2  # m/s
_LONG = 1e9  # s


class _Order(msgspec.Struct, frozen=True, tag_field="order", tag=str.lower, forbid_unknown_fields=True):
    """What all orders share: the log tells them apart by their name."""


class Arm(_Order, frozen=True):
    """Let the thrusters work, or stop them."""

    armed: bool


class Steer(_Order, frozen=True):
    """Change the mode: by hand, hold the place, reach the target region, follow the mission, or surface."""

    mode: Mode


class Aim(_Order, frozen=True):
    """Move the target region, and reach it.

    With a radius the target is a sphere about `position` [m, NED]; otherwise the scenario's goal region, moved so that
    its middle is there. It goes on from there at `velocity` [m/s, NED].
    """

    position: Vector3  # m, NED
    radius: float | None = None  # m
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED


class Face(_Order, frozen=True):
    """Keep another attitude: level, with a heading [rad, from north to east]."""

    heading: float  # rad


class Sticks(_Order, frozen=True):
    """Push by hand: a part, from -1 to 1, of the greatest wrench along and about each body axis."""

    wrench: Vector6  # parts, [-]


class Obstacle(_Order, frozen=True):
    """Keep out of a sphere about `position` [m, NED] that travels at `velocity` [m/s, NED].

    What comes with a number that is known already moves that one.
    """

    number: int
    position: Vector3  # m, NED
    radius: float  # m
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED


class Forget(_Order, frozen=True):
    """Take away an obstacle that came from outside."""

    number: int


class Move(_Order, frozen=True):
    """Move a region by so much [m, NED], in the shape it has; one that travels goes on from there."""

    region: str
    by: Vector3


class Change(_Order, frozen=True):
    """Change a number of the scenario while it runs; `LiveSettings` says which."""

    key: str
    value: float


class Item(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One item of a mission: a region to be reached, and for how long to stay within it.

    Without a place there is no region, and what the item orders is done at once; the region before is kept to.
    """

    position: Vector3 | None  # m, NED
    radius: float | None = None  # m, of a sphere; None: the scenario's goal region, moved there
    stay: float | None = 0.0  # s, within the region before the next item; None: for good
    orders: tuple[Face | Change, ...] = ()  # followed as the item begins
    jump: int | None = None  # item that is next instead, from 0
    times: int | None = None  # as often, each time the mission is begun; None: always


class Mission(_Order, frozen=True):
    """Follow these items, one after the other, whenever the mode is that of the mission."""

    items: tuple[Item, ...]


class Begin(_Order, frozen=True):
    """Go on with an item of the mission, from 0."""

    item: int


class Reset(_Order, frozen=True):
    """End this run, and begin it again from time 0."""


Order = Arm | Steer | Aim | Face | Sticks | Obstacle | Forget | Move | Change | Mission | Begin | Reset


def check_order(order: Order) -> None:
    """Raise unless the numbers of an order can be.

    Parameters
    ----------
    order : Order
        Any.

    Raises
    ------
    OrderError
        If a number is not finite, absurdly great, or without a meaning.
    """
    match order:
        case Aim() | Obstacle():
            _check_place(order.position, order.radius)
            _require(all(abs(v) <= _FAST for v in order.velocity), "velocity", order.velocity, f"up to {_FAST:g} m/s")
        case Move():
            _require(all(abs(x) <= _FAR for x in order.by), "by", order.by, f"finite numbers up to {_FAR:g} m")
        case Mission():
            for item in order.items:
                _check_item(item, len(order.items))
        case Sticks():
            _require(all(abs(x) <= 1.0 for x in order.wrench), "wrench", order.wrench, "six numbers from -1 to 1")
        case Face():
            _require(math.isfinite(order.heading), "heading", order.heading, "a finite angle")
        case Change():
            _require(math.isfinite(order.value), order.key, order.value, "a finite number")


def _check_item(item: Item, count: int) -> None:
    if item.position is not None:
        _check_place(item.position, item.radius)
    _require(item.stay is None or 0.0 <= item.stay <= _LONG, "stay", item.stay, f"0 to {_LONG:g} s")
    _require(item.jump is None or 0 <= item.jump < count, "jump", item.jump, f"0 to {count - 1}")
    _require(item.times is None or item.times >= 0, "times", item.times, "0 or more")
    for order in item.orders:
        check_order(order)


def _check_place(position: Vector3, radius: float | None) -> None:
    _require(all(abs(x) <= _FAR for x in position), "position", position, f"finite numbers up to {_FAR:g} m")
    _require(radius is None or 0.0 < radius <= _FAR, "radius", radius, f"above 0 and up to {_FAR:g} m")


def _require(good: bool, key: str, came: object, expected: str) -> None:
    if not good:
        raise OrderError(f"{key} is {came}, expected {expected}")
