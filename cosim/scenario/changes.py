"""Changes of a scenario since its title was written, and the title that lists them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from controller import LAWS
from cosim.errors import ScenarioError
from cosim.scenario.key_names import PARAMETERS, key_name
from cosim.scenario.toml_file import locate_key
from cosim.scenario.validation import known_parameters
from plant_fmu.errors import one_line
from plant_fmu.toml_tables import hint
from plant_fmu.vehicle import Vehicle

# keys that no title lists: texts, recording, reporting and commands; seeds, and the text of a named file
_UNLISTED_TABLES = ("title", "changed", "compare", "intersection", "record", "commands")
_UNLISTED_KEYS = ("sensing.seed", "plant.parameters.seed", "arbiter.text")
# keys of the computation, which a title lists behind those of the task
_COMPUTATION = ("time.", "plant.fmi", "plant.substep", "arbiter.engine", "arbiter.points", "master.")
_MAX_LISTED = 3  # changes that a title spells out


def with_values(table: dict[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a deep copy of a scenario's table, with lists for tuples, and with other values at some keys."""
    changed: dict[str, Any] = _copy(table)
    for key, value in values.items():
        if key.startswith(PARAMETERS):
            changed["plant"]["parameters"][key.removeprefix(PARAMETERS)] = value
        else:
            container, last = locate_key(changed, key)
            container[last] = value
    return changed


def _copy(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copy(item) for key, item in value.items()}
    return [_copy(item) for item in value] if isinstance(value, list | tuple) else value


def changed_keys(before: dict[str, Any], after: dict[str, Any], vehicle: Vehicle) -> tuple[str, ...]:
    """List the keys in which a scenario differs from another, without those that no title lists."""
    known = known_parameters(vehicle)
    one, other = (
        table | {"plant": table["plant"] | {"parameters": known | table["plant"]["parameters"]}}
        for table in (before, after)
    )
    law = other["law"]["name"]
    if law in LAWS and law != one["law"]["name"]:  # gains are compared with the new law's defaults
        one["law"] = one["law"] | {"gains": LAWS[law].gains_type()._asdict()}
    return join_keys((), differing_keys(one, other))


def differing_keys(before: Any, after: Any, path: str = "") -> Iterator[str]:
    """Yield the keys in which a table differs from another."""
    if isinstance(before, dict) and isinstance(after, dict):
        if before.get("type") == after.get("type") and (not path or before.keys() <= after.keys()):
            for key, value in after.items():
                yield from differing_keys(before.get(key), value, f"{path}.{key}" if path else key)
            return
    elif isinstance(before, list | tuple) and isinstance(after, list | tuple) and len(before) == len(after):
        pairs = list(zip(before, after, strict=True))
        apart = [i for i, pair in enumerate(pairs) if any(differing_keys(*pair, path))]
        names = [[item.get("name") if isinstance(item, dict) else None for item in items] for items in (before, after)]
        if names[0] == names[1] and (None not in names[0] or len(apart) == 1):
            for i in apart:
                yield from differing_keys(*pairs[i], f"{path}.{i if names[1][i] is None else names[1][i]}")
        elif apart:
            yield path
        return
    if before != after:
        yield path


def join_keys(before: Sequence[str], more: Iterable[str]) -> tuple[str, ...]:
    """Join two lists of keys, each key once, without those that no title lists."""
    varied = (
        key for key in more
        if key.partition(".")[0] not in _UNLISTED_TABLES and key not in _UNLISTED_KEYS and not key.endswith(".digest")
    )  # fmt: skip
    return tuple(dict.fromkeys([*before, *varied]))


def value_at(table: dict[str, Any], key: str, vehicle: Vehicle) -> Any:
    """Return the value of a scenario's key."""
    if key.startswith(PARAMETERS):
        name, given = key.removeprefix(PARAMETERS), table["plant"]["parameters"]
        known = given if table["plant"]["file"] else known_parameters(vehicle) | given
        if name not in known:
            whose = "given for plant.file" if table["plant"]["file"] else "of the vehicle's FMU"
            raise ScenarioError(f"key {key!r} is no parameter {whose}; {hint(name, known)}")
        return known[name]
    container, last = locate_key(table, key)
    return container[last]


def shown_title(table: dict[str, Any], vehicle: Vehicle, law: str) -> str:
    """Return the title of a scenario with the changes since it was written, and the law if it is not a built-in one."""
    notes = [] if law in LAWS else [f"flown by {law}"]
    keys = [key for key in table["changed"] if law in LAWS or not f"{key}.".startswith("law.")]
    if keys:
        keys.sort(key=lambda key: key.startswith(_COMPUTATION))
        more = f" and {len(keys) - _MAX_LISTED} more" if len(keys) > _MAX_LISTED else ""
        notes.append(f"changed: {', '.join(_setting(table, key, vehicle) for key in keys[:_MAX_LISTED])}{more}")
    return f"{table['title']} ({'; '.join(notes)})" if notes else str(table["title"])


def _setting(table: dict[str, Any], key: str, vehicle: Vehicle) -> str:
    """Format a key with its value and unit; the key alone if the value is a table, a list of tables, or missing."""
    try:
        value = vehicle.name if key == "vehicle" else value_at(table, key, vehicle)
    except ScenarioError:
        return key
    unit = key_name(key, table, vehicle).unit
    if isinstance(value, list | tuple) and all(isinstance(x, int | float) for x in value):
        text = f"({', '.join(map(_number, value))})" if value else "none"
    elif isinstance(value, int | float):
        text = _number(value)
    elif isinstance(value, str):
        text = one_line(value)
    else:
        return key
    return f"{key} = {text} {unit}".rstrip()


def _number(value: float) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:.6g}"
