"""Angles of a scenario that may have been written in degrees; they are in radians."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from cosim.precheck.finding import Finding
from cosim.scenario.key_names import key_name
from cosim.scenario.scenario import Scenario

_GREATEST = {
    "rad": math.pi / 2.0,
    "rad/s": math.pi,
}  # greatest usual value, by unit: 90 degrees, 180 degrees per second
_AROUND = (".heading", ".bearing")  # keys of angles up to a full turn
_TABLES = ("initial.velocity", "goal", "regions", "law.gains", "criteria", "plant.parameters")


def angle_findings(scenario: Scenario) -> Iterator[Finding]:
    """Yield a note for each angle above 90 degrees, and each rate above 180 degrees per second."""
    for key, value in _numbers(scenario.table, ""):
        if not key.startswith(_TABLES) or not math.isfinite(value):
            continue
        unit = key_name(key, scenario.table, scenario.vehicle).unit
        greatest = _GREATEST.get(unit, math.inf) * (4.0 if key.endswith(_AROUND) else 1.0)
        if abs(value) > greatest:
            degrees = unit.replace("rad", "degrees")
            text = (
                f"{key} is {value:g} {unit}, which is {math.degrees(value):.4g} {degrees}. If {value:g} {degrees} are "
                f"meant, write {math.radians(value):.4g}."
            )
            yield Finding("regions" if key.startswith(("goal", "regions")) else "law", "radians", "note", text)


def _numbers(value: Any, path: str) -> Iterator[tuple[str, float]]:
    """Yield key and value of each number in a table; items of lists by name if they have one."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _numbers(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list | tuple):
        for i, inner in enumerate(value):
            name = inner.get("name", i) if isinstance(inner, dict) else i
            yield from _numbers(inner, f"{path}.{name}")
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path, float(value)
