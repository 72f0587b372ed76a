"""Valid names of signals in other formats."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from cosim.simulation.signals import Column

_OF_REGIONS = ("value", "clearance", "shift.x", "shift.y", "shift.z")
_MAX_LENGTH = 63  # characters
_ELEMENT = re.compile(r"(.+)\[(\d+)\]")


def valid_names(names: Iterable[str]) -> list[str]:
    """Convert names to unique ones of ASCII letters, digits and underscores that begin with a letter."""
    unique: dict[str, None] = {}
    for name in names:
        plain = re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_")[:_MAX_LENGTH]
        stem = plain if plain[:1].isalpha() else f"n{plain}"[:_MAX_LENGTH]
        candidate, n = stem, 2
        while candidate in unique:
            suffix = f"_{n}"
            candidate, n = f"{stem[: _MAX_LENGTH - len(suffix)]}{suffix}", n + 1
        unique[candidate] = None
    return list(unique)


def group_columns(columns: Sequence[Column]) -> dict[str, dict[str, int]]:
    """Group signals that belong together."""
    # `position.x` is `x` of the group `position`, `thrust[1]` is `1` of `thrust`, and the clearance of the region A is
    # `A` of `clearance`; single signals are in the group `step`.
    groups: dict[str, dict[str, int]] = {}
    for i, column in enumerate(columns):
        group, name = _group(column.name)
        groups.setdefault(group, {})[name] = i
    return groups


def _group(name: str) -> tuple[str, str]:
    for ending in _OF_REGIONS:
        if name.endswith(f".{ending}"):
            group, _, axis = ending.partition(".")
            region = name.removesuffix(f".{ending}")
            return group, f"{region} {axis}" if axis else region
    if element := _ELEMENT.fullmatch(name):
        return element[1], element[2]
    group, _, rest = name.partition(".")
    return (group, rest) if rest else ("step", name)
