"""Texts of commands for a time line, with a limited number of entries."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import assert_never

from cosim.scenario.region_tables import Vector3
from cosim.simulation.commands import commands as cmd

_LISTED = 3  # commands of one moment that are listed
_MODES = {
    "manual": "Steered by hand",
    "hold": "Holds its place",
    "reach": "Heads for the target",
    "mission": "Follows the mission",
    "surface": "Surfaces",
    "stabilize": "Steered by hand, attitude kept",
    "depth_hold": "Steered by hand, attitude and depth kept",
}


def command_events(log: Sequence[tuple[int, cmd.Command]], step: float, max_moments: int) -> list[tuple[float, str]]:
    """List times [s] and texts of the commands, grouped by moments; step [s]."""
    steps = sorted({k for k, _ in log})
    gaps = [later - earlier for earlier, later in zip(steps, steps[1:], strict=False)]
    # commands at most this many steps apart share a moment
    apart = sorted(gaps)[len(steps) - max_moments - 1] if len(steps) > max_moments else 0
    begins = [k for k, gap in zip(steps, [apart + 1, *gaps], strict=False) if gap > apart]
    words: dict[int, list[str]] = {k: [] for k in begins}
    for k, command in log:
        words[begins[bisect_right(begins, k) - 1]].append(command_words(command))
    return [(k * step, _join_words(of_moment)) for k, of_moment in words.items()]


def _join_words(words: Sequence[str]) -> str:
    kinds = list(dict.fromkeys(words))  # the texts of sticks repeat
    more = f"; {len(kinds) - _LISTED} more commands" if len(kinds) > _LISTED else ""
    return "Commanded: " + "; ".join(kinds[:_LISTED]) + more


def command_words(command: cmd.Command) -> str:
    """Format a command as text."""
    match command:
        case cmd.Arm():
            return "Armed" if command.armed else "Disarmed"
        case cmd.SetMode():
            return _MODES[command.mode]
        case cmd.SetTarget():
            size = "" if command.radius is None else f", radius {command.radius:.3g} m"
            return f"Target at {_format_position(command.position)}{size}"
        case cmd.SetHeading():
            return f"Heading {math.degrees(command.heading) % 360.0:.0f}°"
        case cmd.SetDepth():
            return f"Depth {command.depth:.3g} m"
        case cmd.ManualControl():
            return "Sticks moved"
        case cmd.SetAttitude():
            return "Attitude given" if command.quaternion is not None else "Attitude free"
        case cmd.AddObstacle():
            return f"Obstacle {command.number} at {_format_position(command.position)}, radius {command.radius:.3g} m"
        case cmd.RemoveObstacle():
            return f"Obstacle {command.number} gone"
        case cmd.ShiftRegion():
            return f"{command.region} moved by {_format_position(command.by)}"
        case cmd.ChangeSetting():
            return f"{command.key} is {command.value:.6g}"
        case cmd.SetMission():
            return f"Mission of {len(command.items)} items"
        case cmd.SetCurrentItem():
            return f"Mission goes on with item {command.item}"
        case cmd.Reset():
            return "Reset"
        case _:
            assert_never(command)


def _format_position(position: Vector3) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in position) + ") m"
