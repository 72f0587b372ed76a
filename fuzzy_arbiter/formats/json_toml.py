"""Our own schema, in JSON and in TOML."""

from __future__ import annotations

import json
import re
import tomllib
from typing import Any, NoReturn

from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.schema import system_of
from fuzzy_arbiter.shapes import Shape

_SETTINGS = ("name", "conjunction", "disjunction", "implication", "normalization", "outside", "points")


def read_json(text: str) -> System:
    """Return the system that a JSON text defines.

    Parameters
    ----------
    text : str
        One object.

    Returns
    -------
    System
        As of `fuzzy_arbiter.formats.schema.system_of`.

    Raises
    ------
    FormatError
        If the text is no JSON, repeats a key, or is not of the schema.
    DefinitionError
        If what it defines cannot be.
    """
    try:
        data = json.loads(text, object_pairs_hook=_unique, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise FormatError(f"line {error.lineno}: {error.msg} at column {error.colno}, expected JSON") from None
    except (ValueError, RecursionError) as error:
        raise FormatError(f"expected JSON: {error}") from None
    return system_of(data)


def read_toml(text: str) -> System:
    """Return the system that a TOML text defines.

    Parameters
    ----------
    text : str
        All of a file.

    Returns
    -------
    System
        As of `fuzzy_arbiter.formats.schema.system_of`.

    Raises
    ------
    FormatError
        If the text is no TOML, or is not of the schema.
    DefinitionError
        If what it defines cannot be.
    """
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"expected TOML: {error}") from None
    return system_of(data)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise FormatError(f"{key!r} came twice in one object, expected each key once")
        result[key] = value
    return result


def _no_constant(word: str) -> NoReturn:
    raise FormatError(f"{word} is no JSON, expected a finite number")


def write_json(system: System) -> str:
    """Return a system as JSON.

    Parameters
    ----------
    system : System
        What is written.

    Returns
    -------
    str
        Indented, with the points of a term on one line.
    """
    lines = [f"  {_text(key)}: {_text(value)}," for key, value in _settings(system)]
    for key, variables in (("inputs", system.inputs), ("outputs", system.outputs)):
        lines += [f'  "{key}": [', ",\n".join(map(_json_variable, variables)), "  ],"]
    lines += ['  "rules": [', ",\n".join(f"    {_text(str(rule))}" for rule in system.rules), "  ]"]
    return "\n".join(["{", *lines, "}", ""])


def _settings(system: System) -> list[tuple[str, Any]]:
    names = [("weights_of", list(system.weights_of))] if system.weights_of else []
    return [*((key, getattr(system, key)) for key in _SETTINGS), *names]


def _json_variable(v: Variable) -> str:
    lines = [f'      "name": {_text(v.name)},', f'      "universe": {_text(list(v.universe))},']
    if isinstance(v, Output) and v.default is not None:
        lines.append(f'      "default": {_text(v.default)},')
    terms = ",\n".join(f"        {_text(t.name)}: {_points(t.shape)}" for t in v.terms)
    return "\n".join(["    {", *lines, '      "terms": {', terms, "      }", "    }"])


def write_toml(system: System) -> str:
    """Return a system as TOML.

    Parameters
    ----------
    system : System
        What is written.

    Returns
    -------
    str
        With a table for each variable, and the points of a term on one line.
    """
    # by hand, for tomli_w gives every number in a list a line of its own, and with that a triangle 14
    lines = [f"{key} = {_text(value)}" for key, value in _settings(system)]
    lines += ["rules = [", *(f"  {_text(str(rule))}," for rule in system.rules), "]"]
    for key, variables in (("inputs", system.inputs), ("outputs", system.outputs)):
        for v in variables:
            lines += ["", f"[[{key}]]", f"name = {_text(v.name)}", f"universe = {_text(list(v.universe))}"]
            if isinstance(v, Output) and v.default is not None:
                lines.append(f"default = {_text(v.default)}")
            lines.append(f"[{key}.terms]")
            lines += [f"{_key(t.name)} = {_points(t.shape)}" for t in v.terms]
    return "\n".join([*lines, ""])


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _points(shape: Shape) -> str:
    return _text([list(point) for point in shape.points])


def _text(value: Any) -> str:
    """Return a value in a form that JSON and TOML share; names are printable, so that both escape the same signs."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
