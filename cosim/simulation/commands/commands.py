"""Commands to a running vehicle. Each is a frozen value, and one line of JSON in a log."""

from __future__ import annotations

import math
import re
from typing import Literal, get_args

import msgspec

from cosim.errors import CommandError
from cosim.scenario.region_tables import Vector3, Vector6

Mode = Literal["manual", "hold", "reach", "mission", "surface", "stabilize", "depth_hold"]

MODES: tuple[Mode, ...] = get_args(Mode)  # a mode's index is its number in the record
STICK_MODES: tuple[Mode, ...] = ("manual", "stabilize", "depth_hold")  # manual control by sticks, without the law

NOT_A_COMMAND = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)  # raised by msgspec for an invalid text

_FAR = 1e5  # m, maximum coordinate, displacement and radius of a command
_FAST = 1e2  # m/s, maximum velocity of a command
_LONG = 1e9  # s, longest stay of a mission item
_UNIT = 1e-2  # maximum deviation of a quaternion's length from 1


def _tag(name: str) -> str:
    """Return the name of a command in a log: ``set_mode`` for `SetMode`."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()


class _Command(msgspec.Struct, frozen=True, tag_field="command", tag=_tag, forbid_unknown_fields=True):
    """Base of all commands; in the log, the key ``command`` holds the command's name."""


class Arm(_Command, frozen=True):
    """Arm or disarm: enable the thrusters, or stop them."""

    armed: bool


class SetMode(_Command, frozen=True):
    """Change the mode."""

    # `manual`, `hold` the present position, `reach` the target region, follow the `mission`, `surface`, `stabilize`
    # (manual, attitude kept), or `depth_hold` (manual, attitude and depth kept).

    mode: Mode


class SetTarget(_Command, frozen=True):
    """Move the target region, and reach it."""

    # With a radius the target is a sphere about `position` [m, NED]; otherwise the scenario's goal region, moved so
    # that its center is there. It travels from there at `velocity` [m/s, NED].

    position: Vector3  # m, NED
    radius: float | None = None  # m
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED


class SetHeading(_Command, frozen=True):
    """Keep another attitude: level, with a heading [rad, from north to east]."""

    heading: float  # rad


class ManualControl(_Command, frozen=True):
    """Control manually: a fraction, from -1 to 1, of the maximum wrench along and about each body axis."""

    wrench: Vector6  # fractions, [-]
    by_gain: bool = True  # True: the pilot's gain scales the fractions


class SetAttitude(_Command, frozen=True):
    """Keep an attitude in the modes in which sticks steer, or with a force in place of the law while it reaches."""

    # Another mode, another target, or an attitude of None ends it.

    quaternion: tuple[float, float, float, float] | None  # unit quaternion from body to world, scalar first
    force: Vector3 | None = None  # fractions [-] of the maximum force along each body axis; None: the sticks'
    rate_down: float | None = None  # m/s, of the depth, in place of a vertical force


class AddObstacle(_Command, frozen=True):
    """Keep out of a sphere about `position` [m, NED] that travels at `velocity` [m/s, NED]."""

    # The number of an obstacle that exists moves that obstacle.

    number: int
    position: Vector3  # m, NED
    radius: float  # m
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED


class RemoveObstacle(_Command, frozen=True):
    """Remove an obstacle that a command has added."""

    number: int


class ShiftRegion(_Command, frozen=True):
    """Move a region by the displacement `by` [m, NED]; its shape and velocity do not change."""

    region: str
    by: Vector3


class ChangeSetting(_Command, frozen=True):
    """Change a number of the scenario during the run; `LiveSettings` lists the keys."""

    key: str
    value: float


class MissionItem(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One item of a mission: a region to be reached, and how long to stay within it."""

    # An item without a position has no region: its commands are applied at once, and the target stays as it is.

    position: Vector3 | None  # m, NED
    radius: float | None = None  # m, of a sphere; None: the scenario's goal region, moved there
    stay: float | None = 0.0  # s, within the region before the next item; None: forever
    commands: tuple[SetHeading | ChangeSetting, ...] = ()  # applied when the item begins
    jump: int | None = None  # index of the item that comes next instead, from 0
    times: int | None = None  # number of jumps, each time the mission is begun; None: no limit


class SetMission(_Command, frozen=True):
    """Set the items of the mission, which the mode ``mission`` follows in order."""

    items: tuple[MissionItem, ...]


class SetCurrentItem(_Command, frozen=True):
    """Continue the mission with an item, from 0."""

    item: int


class Reset(_Command, frozen=True):
    """End this run, and begin it again from time 0."""


Command = (
    Arm
    | SetMode
    | SetTarget
    | SetHeading
    | ManualControl
    | SetAttitude
    | AddObstacle
    | RemoveObstacle
    | ShiftRegion
    | ChangeSetting
    | SetMission
    | SetCurrentItem
    | Reset
)


def validate_command(command: Command) -> None:
    """Raise a CommandError if a number of a command is out of range."""
    match command:
        case SetTarget() | AddObstacle():
            _check_place(command.position, command.radius)
            _require(
                all(abs(v) <= _FAST for v in command.velocity), "velocity", command.velocity, f"up to {_FAST:g} m/s"
            )
        case ShiftRegion():
            _require(all(abs(x) <= _FAR for x in command.by), "by", command.by, f"finite numbers up to {_FAR:g} m")
        case SetMission():
            for item in command.items:
                _check_item(item, len(command.items))
        case ManualControl():
            _require(all(abs(x) <= 1.0 for x in command.wrench), "wrench", command.wrench, "six numbers from -1 to 1")
        case SetAttitude(quaternion=q) if q is not None:
            unit = abs(math.hypot(*q) - 1.0) <= _UNIT
            _require(unit, "quaternion", q, "four numbers of length 1")
            parts = command.force or ()
            _require(all(abs(x) <= 1.0 for x in parts), "force", parts, "three numbers from -1 to 1")
            rate = command.rate_down or 0.0
            _require(abs(rate) <= _FAST, "rate_down", rate, f"up to {_FAST:g} m/s")
        case SetHeading():
            _require(math.isfinite(command.heading), "heading", command.heading, "a finite angle")
        case ChangeSetting():
            _require(math.isfinite(command.value), command.key, command.value, "a finite number")


def _check_item(item: MissionItem, count: int) -> None:
    if item.position is not None:
        _check_place(item.position, item.radius)
    _require(item.stay is None or 0.0 <= item.stay <= _LONG, "stay", item.stay, f"0 to {_LONG:g} s")
    _require(item.jump is None or 0 <= item.jump < count, "jump", item.jump, f"0 to {count - 1}")
    _require(item.times is None or item.times >= 0, "times", item.times, "0 or more")
    for command in item.commands:
        validate_command(command)


def _check_place(position: Vector3, radius: float | None) -> None:
    _require(all(abs(x) <= _FAR for x in position), "position", position, f"finite numbers up to {_FAR:g} m")
    _require(radius is None or 0.0 < radius <= _FAR, "radius", radius, f"above 0 and up to {_FAR:g} m")


def _require(good: bool, key: str, received: object, expected: str) -> None:
    if not good:
        raise CommandError(f"{key} is {received}, expected {expected}")
