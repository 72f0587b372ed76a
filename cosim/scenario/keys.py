"""Meanings and units of a scenario's keys: for the reference, and for comments in a scenario's file."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from controller import LAWS
from controller.regions.shapes import ENTRIES
from cosim.scenario.region_tables import GoalMotion
from cosim.scenario.tables import File
from plant_fmu.toml_tables import Table, fields_of, table_in, types_in
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle


class Key(NamedTuple):
    """Unit and meaning of a key, in Markdown."""

    unit: str
    meaning: str  # meaning in a few words
    more: str  # addition for the reference
    default: str  # default in words


def _keys_of(kind: type[Table], path: str = "") -> Iterator[tuple[str, Key]]:
    """Yield the path and the description of each key of a table, and of the tables in it."""
    defaults = {field.name: field for field in msgspec.structs.fields(kind)}
    for name, annotation in fields_of(kind).items():
        table, listed = table_in(annotation)
        meta = next((meta for _, metas in types_in(annotation) for meta in metas if meta.extra), None)
        if meta is not None and meta.extra is not None:
            words = meta.extra["default"] or _default(defaults[name])
            yield f"{path}{name}", Key(meta.extra["unit"], str(meta.description), meta.extra["more"], words)
        if table is not None:
            yield from _keys_of(table, f"{path}{name}{'[]' if listed else ''}.")
        if kind is File and name == "goal":
            yield from _keys_of(GoalMotion, "goal.")


def _default(field: msgspec.structs.FieldInfo) -> str:
    """Format the default of a key, in Markdown."""
    value = field.default if field.default_factory is msgspec.NODEFAULT else field.default_factory()
    if value is msgspec.NODEFAULT:
        return "required"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"`{value}`" if value else '`""`'
    if isinstance(value, tuple | dict):
        return " ".join(f"{x:g}" for x in value) or "none"
    return "`inf`" if value == float("inf") else f"{value:g}"


KEYS = dict(_keys_of(File))  # keys by their path; regions[] means each region

_GAIN = re.compile(r"^ +(\w+): float = [^#\n]*# (.*)$", re.M)
_UNIT = re.compile(
    r"(?:1|N|kg|m|rad|s)\d?(?:[ /(]+(?:N|kg|m|rad|sqrt\(s\)|s)\d?\)?)*(?=[,: ]|$)"
)  # at the head of a comment
_LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")


def unit_of_shape(kind: str, key: str) -> str:
    """Return the unit of a key of a shape."""
    return ENTRIES[kind].units.get(key, "") if kind in ENTRIES else ""


def comments(law: str, vehicle: Vehicle) -> dict[str, str]:
    """Return the comment for each key of a file: its unit and its meaning, as plain text."""
    texts = {path: _comment(key.unit, _LINK.sub(r"\1", key.meaning).replace("`", "")) for path, key in KEYS.items()}
    texts |= {f"law.gains.{gain}": text for gain, text in _gain_comments(law).items()}
    return texts | {f"plant.parameters.{v.name}": _comment(v.quantity.unit, v.description) for v in variables(vehicle)}


@functools.cache
def unit_of_gain(law: str, gain: str) -> str:
    """Return the unit of a gain of a law."""
    unit = _UNIT.match(_gain_comments(law).get(gain, ""))
    return unit[0] if unit else ""


def _comment(unit: str, meaning: str) -> str:
    return ", ".join(filter(None, (unit, meaning)))


def _gain_comments(law: str) -> dict[str, str]:
    try:
        return dict(_GAIN.findall(inspect.getsource(LAWS[law].gains_type)))
    except (KeyError, OSError):  # a custom law, or no source
        return {}
