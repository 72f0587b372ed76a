"""Orders in plain words, few enough to be read."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import assert_never

from cosim.scenario.tables import Vector3
from cosim.simulation.commands.commands import (
    Aim,
    Arm,
    Begin,
    Change,
    Face,
    Forget,
    Mission,
    Move,
    Obstacle,
    Order,
    Reset,
    Steer,
    Sticks,
)

_TOLD = 3  # orders of one moment that are told each
_MODES = {
    "manual": "Steered by hand",
    "hold": "Holds its place",
    "reach": "Heads for the target",
    "mission": "Follows the mission",
    "surface": "Surfaces",
}


def ordered_events(log: Sequence[tuple[int, Order]], step: float, most: int) -> list[tuple[float, str]]:
    """Return when orders were given, and which.

    Parameters
    ----------
    log : sequence of (int, Order)
        Steps, and orders that were taken at them.
    step : float
        [s].
    most : int
        Moments; orders that follow each other closely are told together where there are more.

    Returns
    -------
    list of (float, str)
        Times [s] of the first order of each moment, and words for all of its.
    """
    steps = sorted({k for k, _ in log})
    gaps = [later - earlier for earlier, later in zip(steps, steps[1:], strict=False)]
    # orders that are no farther apart than this are of one moment
    apart = sorted(gaps)[len(steps) - most - 1] if len(steps) > most else 0
    begins = [k for k, gap in zip(steps, [apart + 1, *gaps], strict=False) if gap > apart]
    words: dict[int, list[str]] = {k: [] for k in begins}
    for k, order in log:
        words[begins[bisect_right(begins, k) - 1]].append(order_words(order))
    return [(k * step, _joined(of_moment)) for k, of_moment in words.items()]


def _joined(words: Sequence[str]) -> str:
    kinds = list(dict.fromkeys(words))  # sticks say the same many times
    more = f"; {len(kinds) - _TOLD} more orders" if len(kinds) > _TOLD else ""
    return "Ordered: " + "; ".join(kinds[:_TOLD]) + more


def order_words(order: Order) -> str:
    """Return what an order asks for.

    Parameters
    ----------
    order : Order
        Any.

    Returns
    -------
    str
        Such as ``Target at (7, 0, 4) m``.
    """
    match order:
        case Arm():
            return "Armed" if order.armed else "Disarmed"
        case Steer():
            return _MODES[order.mode]
        case Aim():
            size = "" if order.radius is None else f", radius {order.radius:.3g} m"
            return f"Target at {_place(order.position)}{size}"
        case Face():
            return f"Heading {math.degrees(order.heading) % 360.0:.0f}°"
        case Sticks():
            return "Sticks moved"
        case Obstacle():
            return f"Obstacle {order.number} at {_place(order.position)}, radius {order.radius:.3g} m"
        case Forget():
            return f"Obstacle {order.number} gone"
        case Move():
            return f"{order.region} moved by {_place(order.by)}"
        case Change():
            return f"{order.key} is {order.value:.6g}"
        case Mission():
            return f"Mission of {len(order.items)} items"
        case Begin():
            return f"Mission goes on with item {order.item}"
        case Reset():
            return "Reset"
        case _:
            assert_never(order)


def _place(position: Vector3) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in position) + ") m"
