"""Scenario files as tables: finding and reading them, merging one into its base, and setting keys."""

from __future__ import annotations

import copy
import fnmatch
import functools
import logging
import re
import tomllib
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from cosim.errors import ScenarioError
from plant_fmu.errors import TableError, printable

_LOG = logging.getLogger(__name__)
_RENAMED = {"centre": "center", "colour": "color"}  # former names of keys
ANGLE_KEYS = {"quaternion": "roll_pitch_yaw", "desired_quaternion": "desired_roll_pitch_yaw"}
_IN_ITS_PLACE = _RENAMED | ANGLE_KEYS  # of two keys for one thing, the one that the other replaces
_IN_ITS_PLACE |= {new: old for old, new in _IN_ITS_PLACE.items()}
_DEFAULT_LAW = "ismail_dunnigan"
_SHOWN = 80  # maximum number of characters quoted in a message

# a key: parts with dots between them, and TOML's quotes around those that have blanks; and a key with a value
_QUOTED = r'"(?:[^"\\]|\\.)*"|\'[^\']*\''
_PART = re.compile(rf"\s*({_QUOTED}|[^.\"']*)\s*(\.|$)")
_CHANGE = re.compile(rf"((?:{_QUOTED}|[^=\"'])*)=(.*)", re.S)


def list_scenarios() -> list[str]:
    """Return the names of the scenarios that come with the package.

    Examples
    --------
    >>> import cosim
    >>> cosim.list_scenarios()[:3]
    ['dense-field', 'depth-transit', 'docking']
    """
    return sorted(f.name.removesuffix(".toml") for f in _folder().iterdir() if f.name.endswith(".toml"))


def shipped_titles() -> dict[str, str]:
    """Return the titles of the shipped scenarios by name, without checking their files."""
    texts = {name: (_folder() / f"{name}.toml").read_text(encoding="utf-8") for name in list_scenarios()}
    return {name: tomllib.loads(text)["title"] for name, text in texts.items()}


def _folder() -> resources.abc.Traversable:
    return resources.files("cosim.scenario") / "shipped"


class ScenarioTable(NamedTuple):
    """Table of a scenario's file, merged into that of its base."""

    table: dict[str, Any]
    name: str  # name of the scenario
    titled: dict[str, Any]  # table of the scenario whose title this one has: its own, or that of a base


def read_table(name_or_file: str, seen: tuple[str, ...] = (), beside: Path | None = None) -> ScenarioTable:
    """Read the table of a scenario, and merge it into that of its ``base``."""
    from plant_fmu.toml_tables import hint, read_toml  # imports NumPy and FMPy, which `cosim show` does not need

    path = Path(name_or_file)
    if path.suffix == ".toml":
        path = beside / path if beside else path
        table, name, folder = read_toml(path), printable(path.stem), path.parent
        name_or_file = str(path.resolve())
        vehicle = table.get("vehicle")
        if isinstance(vehicle, str) and vehicle.endswith(".toml"):  # relative to the file that names it
            table["vehicle"] = str(folder / vehicle)
        holders = [table.get(name) for name in ("arbiter", "law", "plant", "goal")]
        shapes = [region.get("shape") for region in _tables(table, "regions")]
        for holder in (*holders, *_tables(table, "components"), *shapes):
            if isinstance(holder, dict) and not holder.get("text"):
                file = holder.get("file")
                if file and isinstance(file, str):  # likewise
                    holder["file"] = str(folder / file)
    elif name_or_file in list_scenarios():
        with resources.as_file(_folder() / f"{name_or_file}.toml") as shipped:
            table, name, folder = read_toml(shipped), name_or_file, Path()
    else:
        raise ScenarioError(f"base {name_or_file!r} is unknown; {hint(name_or_file, list_scenarios())}")
    if name_or_file in seen:
        raise ScenarioError(f"{name}: is its own base")
    if "base" in table:
        base = table.pop("base")
        if not isinstance(base, str):
            raise ScenarioError(f"{name}: base is {base!r}, expected the name of a scenario")
        below, _, titled = read_table(base, (*seen, name_or_file), folder)
        law = table.get("law")
        if isinstance(law, dict) and ("file" in law or "name" in law):
            _name_law(below, law.get("name"), law.get("file"))
        arbiter, plant = table.get("arbiter"), table.get("plant")
        if isinstance(arbiter, dict) and "file" in arbiter:
            _name_rules(below)
        if isinstance(plant, dict) and "file" in plant:  # nothing of another plant
            below.pop("plant", None)
        if "title" in table:  # a new title covers all changes of the base
            below.pop("changed", None)
        over, table = table, _merge(below, table)
        if "title" not in over and "title" in below:
            return ScenarioTable(table, name, titled)
    return ScenarioTable(table, name, copy.deepcopy(table))


def _name_law(table: dict[str, Any], name: object, file: object = "") -> None:
    """Set the law's name or FMU in a table, or remove its FMU; drop what belongs to another law."""
    law = table.setdefault("law", {})
    if not isinstance(law, dict):
        return
    if name is None and not file:
        name = _DEFAULT_LAW if law.get("file") else _present_name(law)
    if file:
        law.pop("name", None)
        law.pop("gains", None)
        law.pop("digest", None)
    elif _present_name(law) != name:
        for key in ("gains", "file", "inputs", "outputs", "parameters", "digest"):
            law.pop(key, None)
        law["name"] = name


def _present_name(law: dict[str, Any]) -> object:
    """Return the name of a law: that of its FMU's file, which needs no key, or that of the key."""
    return Path(str(law["file"])).name if law.get("file") else law.get("name", _DEFAULT_LAW)


def _name_rules(table: dict[str, Any]) -> None:
    """Drop text and inputs of the arbiter's file, which is to be replaced."""
    arbiter = table.get("arbiter")
    if isinstance(arbiter, dict):
        arbiter.pop("text", None)
        arbiter.pop("inputs", None)


def _merge(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    result = copy.deepcopy(base)
    for key, value in over.items():
        if (other := _IN_ITS_PLACE.get(key, "")) not in over:
            result.pop(other, None)
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = _merge(result[key], value) if both else value
    return result


def plain_key(text: str) -> str:
    """Remove the quotes from a key, such as ``regions."my rock".gain``: no name within a key needs them."""
    parts, offset, dot = [], 0, "."
    while dot:
        match = _PART.match(text, offset)
        if match is None:
            raise ScenarioError(f'key {_short(text)}: expected quotes around whole parts, as in regions."my rock".gain')
        part, dot = match[1].strip(), match[2]
        try:
            parts.append(tomllib.loads(f"part = {part}")["part"] if part[:1] in ('"', "'") else part)
        except tomllib.TOMLDecodeError as error:
            raise ScenarioError(f"key {_short(text)}: {part} is no text of TOML: {error}") from error
        offset = match.end()
    return ".".join(parts)


def split_change(text: str) -> tuple[str, str]:
    """Split ``key=value`` into the key, without its quotes, and the text of the value; "" for a missing key."""
    match = _CHANGE.fullmatch(text)
    return (plain_key(match[1]), match[2]) if match else ("", text)


def override(table: dict[str, Any], text: str) -> None:
    """Set one key of a table in place."""
    from plant_fmu.toml_tables import MAX_DEPTH, require_bounded

    key, value_text = split_change(text)
    if not key:
        raise ScenarioError(f"--set {_short(text)!r}: expected key=value")
    depth = key.count(".")
    if depth >= MAX_DEPTH:
        raise ScenarioError(f"--set {_short(key)}: {depth} tables within each other, expected less than {MAX_DEPTH}")
    try:
        parsed = tomllib.loads(f"value = {value_text}")
        require_bounded(parsed)
    except tomllib.TOMLDecodeError:
        parsed = {"value": value_text.strip()}  # a bare word is a string
    except RecursionError as error:
        raise ScenarioError(f"--set {_short(text)}: is nested too deeply") from error
    except TableError as error:
        raise ScenarioError(f"--set {_short(text)}: {error}") from error
    except ValueError as error:
        raise ScenarioError(f"--set {_short(text)}: a whole number has too many digits") from error
    if len(parsed) > 1:
        raise ScenarioError(f"--set {_short(text)!r}: expected one key=value")
    set_key(table, key, parsed["value"])


def set_key(table: dict[str, Any], key: str, value: Any) -> None:
    """Set one key of a table in place, or all keys that a pattern with ``*`` matches."""
    key = plain_key(key)
    if "*" in key and not key.startswith("plant.parameters."):  # that table may lack parameters that are meant
        keys = list(_matching_keys(table, key.split(".")))
        if not keys:
            raise ScenarioError(f"--set {_short(key)}: no key matches")
        for one in keys:
            set_key(table, one, value)
        return
    *path, last = key.split(".")
    if key == "law.name":
        _name_law(table, value)
    if key == "law.file":
        _name_law(table, None, value)
    if key == "arbiter.file":
        _name_rules(table)
    if key == "plant.file":
        table["plant"] = {}
    node: Any = table
    for part in path:
        if isinstance(node, list):
            node = node[_index(node, part, key)]
        elif isinstance(node, dict):
            node = node.setdefault(current_name(node, part), {})
    if isinstance(node, list):
        node[_index(node, last, key)] = value
    elif isinstance(node, dict):
        node.pop(_IN_ITS_PLACE.get(last, ""), None)
        node[last] = value
    else:
        raise ScenarioError(f"--set {_short(key)}: there is no table at {_short('.'.join(path))!r}")


def _matching_keys(node: Any, parts: list[str], path: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield the keys that a pattern matches, part by part; the last part may be missing unless it is a pattern."""
    part, *rest = parts
    names = [part]
    if "*" in part:
        items = node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        names = [str(name) for name in items if fnmatch.fnmatchcase(str(name), part)]
        names = [name for name in map(str, _names(node)) if fnmatch.fnmatchcase(name, part)] or names
    for name in names:
        if not rest:
            yield ".".join((*path, name))
        elif (index := _find_key(node, name)) is not None:
            yield from _matching_keys(node[index], rest, (*path, name))


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]} ..."


def _index(items: list[Any], part: str, key: str) -> int:
    """Return the index of an item of a list, given its name or index as text."""
    if (index := _find_key(items, part)) is not None:
        return int(index)
    known = f"one of {', '.join(map(str, names))}, nor " if (names := _names(items)) else ""
    raise ScenarioError(f"--set {_short(key)}: {_short(part)!r} is not {known}a number below {len(items)}")


def _names(items: Any) -> list[Any]:
    """Return the names of the items of a list, None of those without one."""
    return [item.get("name") for item in items if isinstance(item, dict)]


def _find_key(container: Any, part: str) -> Any:
    """Return the key of an item in a table, or its index in a list, given its name or index as text; else None."""
    if isinstance(container, dict):
        name = current_name(container, part)
        return name if name in container else None
    if not isinstance(container, list | tuple):
        return None
    if part in (names := _names(container)):
        return names.index(part)
    return int(part) if part.isdecimal() and len(part) < 10 and int(part) < len(container) else None


def flatten(table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Join nested keys with dots, since TOML nests ``r_G.z = 0.1``, the name of a parameter of the FMU."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        flat |= flatten(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return flat


def locate_key(table: dict[str, Any], key: str) -> tuple[Any, Any]:
    """Return the table or list that holds a key, and the name or index in it."""
    inner: Any = table
    for depth, part in enumerate(parts := key.split(".")):
        container, index = inner, _find_key(inner, part)
        if index is None:
            from plant_fmu.toml_tables import hint

            is_list = isinstance(container, list | tuple)
            known = _names(container) or range(len(container)) if is_list else container
            expected = f"{'.'.join(parts[:depth])} holds no others"
            if isinstance(container, dict | list | tuple) and container:
                expected = hint(part, map(str, known))
            what = "is unknown" if part == key else f"is unknown: {part!r}"
            raise ScenarioError(f"key {key!r} {what}; {expected}")
        inner = container[index]
    return container, index


@functools.cache  # one line, however many tables have the key
def _log_former_name(name: str) -> None:
    _LOG.warning("key %s is now %s", name, _RENAMED[name])


def current_name(table: Any, name: str) -> str:
    """Return the present name of a key that a table has by that name alone."""
    new = _RENAMED.get(name, name)
    if new == name or not isinstance(table, dict) or new not in table or name in table:
        return name
    _log_former_name(name)
    return new


def current_key(table: dict[str, Any], key: str) -> str:
    """Return a key with the present names of its parts."""
    container: Any = table
    parts: list[str] = []
    for part in key.split("."):
        parts.append(current_name(container, part))
        index = _find_key(container, part)
        container = None if index is None else container[index]
    return ".".join(parts)


def rename_former_keys(table: dict[str, Any]) -> dict[str, Any]:
    """Return a scenario's table with the present names of its keys: itself if it has no former one."""
    former = [*_former_keys(table)]
    changed = table.get("changed")
    keys = [key for key in changed if isinstance(key, str)] if isinstance(changed, list | tuple) else []
    if not former and not any(old in key for old in _RENAMED for key in keys):
        return table
    table = copy.deepcopy(table)
    for where, old, holder in _former_keys(table):
        new = _RENAMED[old]
        if new in holder:
            raise ScenarioError(f"{where}: pass either {new} or {old}, its former name")
        holder[new] = holder.pop(old)
        _log_former_name(old)
    if keys:
        table["changed"] = [current_key(table, key) if isinstance(key, str) else key for key in table["changed"]]
    return table


def _former_keys(table: dict[str, Any]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield each former key of a scenario's goal, shapes and criteria: where it is, its name, and what holds it."""
    for where, shape in shapes_in(table).items():
        if "centre" in shape and takes_key(shape, "center"):
            yield where, "centre", shape
    for i, criterion in enumerate(_tables(table, "criteria")):
        if "colour" in criterion:
            yield f"criteria[{i}]", "colour", criterion


def _tables(table: dict[str, Any], key: str) -> list[dict[str, Any]]:
    items = table.get(key)
    return [item if isinstance(item, dict) else {} for item in items] if isinstance(items, list | tuple) else []


def shapes_in(table: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the tables of goal and shapes of a scenario's table, by where they are."""
    shapes = {f"regions[{i}].shape": item.get("shape") for i, item in enumerate(_tables(table, "regions"))}
    return {where: shape for where, shape in ({"goal": table.get("goal")} | shapes).items() if isinstance(shape, dict)}


def takes_key(shape: dict[str, Any], key: str) -> bool:
    """Return True for a shape with a key, which a user's own shape may call otherwise."""
    from controller.regions.shapes import ENTRIES  # imports NumPy

    kind = shape.get("type")
    return isinstance(kind, str) and kind in ENTRIES and key in ENTRIES[kind].units
