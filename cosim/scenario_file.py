"""Scenario files as tables: where they are, how one is laid over another, how a key is set from the command line."""

from __future__ import annotations

import copy
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from cosim.errors import ScenarioError
from plant_fmu.tables import hint, read_toml


def shipped_scenarios() -> list[str]:
    """Return the names of the scenarios that come with the package."""
    return sorted(f.name.removesuffix(".toml") for f in _folder().iterdir() if f.name.endswith(".toml"))


def _folder() -> resources.abc.Traversable:
    return resources.files("cosim") / "scenarios"


def read_table(name_or_file: str, seen: tuple[str, ...] = (), beside: Path | None = None) -> tuple[dict[str, Any], str]:
    """Read a scenario, laid over that of its ``base``.

    Parameters
    ----------
    name_or_file : str
        A shipped name, or a file ending in .toml.
    seen : tuple of str
        The scenarios that lead here as bases.
    beside : Path, optional
        Folder that a file is looked for in.

    Returns
    -------
    dict, str
        The table and the scenario's name.

    Raises
    ------
    ScenarioError
        If a base is unknown, or its own.
    TableError
        If a file cannot be read.
    """
    path = Path(name_or_file)
    if path.suffix == ".toml":
        path = beside / path if beside else path
        table, name, folder = read_toml(path), path.stem, path.parent
        name_or_file = str(path.resolve())
        vehicle = table.get("vehicle")
        if isinstance(vehicle, str) and vehicle.endswith(".toml"):  # beside the file that names it
            table["vehicle"] = str(folder / vehicle)
    elif name_or_file in shipped_scenarios():
        with resources.as_file(_folder() / f"{name_or_file}.toml") as shipped:
            table, name, folder = read_toml(shipped), name_or_file, Path()
    else:
        raise ScenarioError(f"base {name_or_file!r} is unknown; {hint(name_or_file, shipped_scenarios())}")
    if name_or_file in seen:
        raise ScenarioError(f"{name}: is its own base")
    if "base" in table:
        base = table.pop("base")
        if not isinstance(base, str):
            raise ScenarioError(f"{name}: base is {base!r}, expected the name of a scenario")
        below = read_table(base, (*seen, name_or_file), folder)[0]
        law = table.get("law")
        if isinstance(law, dict) and "name" in law:
            _name_law(below, law["name"])
        table = _merge(below, table)
    return table, name


def _name_law(table: dict[str, Any], name: object) -> None:
    """Name the law of a scenario; gains belong to a law, so that those of another one go with its name."""
    law = table.setdefault("law", {})
    if isinstance(law, dict) and law.get("name", "printed") != name:
        law.pop("gains", None)
        law["name"] = name


def _merge(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    result = copy.deepcopy(base)
    for key, value in over.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = _merge(result[key], value) if both else value
    return result


def override(table: dict[str, Any], text: str) -> None:
    """Set one key of a table in place.

    Parameters
    ----------
    table : dict
        A scenario's.
    text : str
        ``key=value``, with dots between the keys and a TOML value, or a bare word; items of lists go by index or name.
        Another ``law.name`` drops the gains of the law before.

    Raises
    ------
    ScenarioError
        If there is no such place.
    """
    key, equals, value_text = text.partition("=")
    if not equals or not key:
        raise ScenarioError(f"--set {text!r}: expected key=value")
    try:
        parsed = tomllib.loads(f"value = {value_text}")
    except tomllib.TOMLDecodeError:
        parsed = {"value": value_text.strip()}  # a bare word is a string
    if len(parsed) > 1:
        raise ScenarioError(f"--set {text!r}: expected one key=value")
    value = parsed["value"]
    if key.strip() == "law.name":
        _name_law(table, value)
    *path, last = key.strip().split(".")
    at: Any = table
    for part in path:
        if isinstance(at, list):
            at = at[_index(at, part, key)]
        elif isinstance(at, dict):
            at = at.setdefault(part, {})
    if isinstance(at, list):
        at[_index(at, last, key)] = value
    elif isinstance(at, dict):
        at[last] = value
    else:
        raise ScenarioError(f"--set {key}: there is no table at {'.'.join(path)!r}")


def _index(items: list[Any], part: str, key: str) -> int:
    """Return the place in a list that a number or an item's name means."""
    names = [item.get("name") for item in items if isinstance(item, dict)]
    if part in names:
        return names.index(part)
    if part.isdecimal() and int(part) < len(items):
        return int(part)
    raise ScenarioError(
        f"--set {key}: {part!r} is not one of {', '.join(map(str, names))}, nor a number below {len(items)}"
    )


def flat(table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Join nested keys with dots, as TOML nests ``r_G.z = 0.1`` where the FMU's parameter has that name.

    Parameters
    ----------
    table : dict
        Of tables and values.
    prefix : str
        Before every key.

    Returns
    -------
    dict
        Of values.
    """
    joined: dict[str, Any] = {}
    for key, value in table.items():
        joined |= flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return joined
