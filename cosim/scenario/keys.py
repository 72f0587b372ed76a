"""Meanings and units of a scenario's keys: for the reference, and for comments in a scenario's file."""

from __future__ import annotations

import contextlib
import difflib
import functools
import inspect
import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import msgspec

from controller import LAWS
from controller.regions.shapes import ENTRIES
from cosim.scenario.goal_mission import GoalMotion
from cosim.scenario.tables import File
from plant_fmu.errors import PlantFmuError
from plant_fmu.toml_tables import MAX_COMPARED, Table, fields_of, table_in, types_in
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle, load_vehicle


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
            words = meta.extra["default"] or _format_default(defaults[name])
            yield f"{path}{name}", Key(meta.extra["unit"], str(meta.description), meta.extra["more"], words)
        if table is not None:
            yield from _keys_of(table, f"{path}{name}{'[]' if listed else ''}.")
        if kind is File and name == "goal":
            yield from _keys_of(GoalMotion, "goal.")


def _format_default(field: msgspec.structs.FieldInfo) -> str:
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


def without_defaults(table: Mapping[str, Any], kind: type[Table] = File) -> dict[str, Any]:
    """Return a filled table without the keys that have their default."""
    short = {}
    for field in msgspec.structs.fields(kind):
        value = table[field.name]
        default = field.default if field.default_factory is msgspec.NODEFAULT else field.default_factory()
        if field.required or value != msgspec.to_builtins(default):
            inner, listed = table_in(fields_of(kind)[field.name])
            if inner is not None and listed:
                value = [without_defaults(item, inner) for item in value]
            elif inner is not None and "type" not in value:  # as shapes have, of which there are several tables
                value = without_defaults(value, inner)
            short[field.name] = value
    return short


_CLOSE = 0.75  # least similarity to a key of the file's first level that alone is proposed
_SIMILAR = 0.6  # least similarity to the last part of a key elsewhere
_MAX_PROPOSED = 5


def hint_of_key(name: str, vehicle: object) -> str:
    """Format a hint for an unknown key of a file: the nearest one, or those in its tables that resemble it."""
    name = name[:MAX_COMPARED]
    if near := difflib.get_close_matches(name, File.__struct_fields__, n=1, cutoff=_CLOSE):
        return f"did you mean {near[0]!r}?"
    keys = {key.replace("[]", "") for key in KEYS}
    if isinstance(vehicle, str):
        with contextlib.suppress(PlantFmuError):
            names = (v.name for v in variables(load_vehicle(vehicle)) if v.role == "parameter")
            keys |= {f"plant.parameters.{name.partition('[')[0]}" for name in names}
    similarity = {key: difflib.SequenceMatcher(None, name, key.rpartition(".")[2]).ratio() for key in sorted(keys)}
    near = [key for key in sorted(similarity, key=similarity.__getitem__, reverse=True) if similarity[key] >= _SIMILAR]
    if near:
        return f"did you mean {' or '.join(near[:_MAX_PROPOSED])}?"
    return f"expected one of {', '.join(File.__struct_fields__)}"


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
    texts = {
        path: _join_comment(key.unit, _LINK.sub(r"\1", key.meaning).replace("`", "")) for path, key in KEYS.items()
    }
    texts |= {f"law.gains.{gain}": text for gain, text in _gain_comments(law).items()}
    return texts | {
        f"plant.parameters.{v.name}": _join_comment(v.quantity.unit, v.description) for v in variables(vehicle)
    }


@functools.cache
def unit_of_gain(law: str, gain: str) -> str:
    """Return the unit of a gain of a law."""
    unit = _UNIT.match(_gain_comments(law).get(gain, ""))
    return unit[0] if unit else ""


def _join_comment(unit: str, meaning: str) -> str:
    return ", ".join(filter(None, (unit, meaning)))


def _gain_comments(law: str) -> dict[str, str]:
    try:
        return dict(_GAIN.findall(inspect.getsource(LAWS[law].gains_type)))
    except (KeyError, OSError):  # a custom law, or no source
        return {}
