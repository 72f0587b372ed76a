"""The package's own schema, in JSON and in TOML."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import asdict, fields
from typing import Any, NoReturn

from fuzzy_arbiter.definition import CHOICES, Output, System, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.fll_terms import parts_of
from fuzzy_arbiter.formats.schema import system_of
from fuzzy_arbiter.rule import Rule
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.values import Value


def read_json(text: str) -> System:
    """Parse a JSON text as a system."""
    try:
        data = json.loads(text, object_pairs_hook=_unique, parse_constant=_no_constant)
    except json.JSONDecodeError as error:
        raise FormatError(f"line {error.lineno}: {error.msg} at column {error.colno}, expected JSON") from None
    except (ValueError, RecursionError) as error:
        raise FormatError(f"expected JSON: {error}") from None
    return system_of(data)


def read_toml(text: str) -> System:
    """Parse a TOML text as a system."""
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"expected TOML: {error}") from None
    return system_of(data)


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, value in pairs:
        if key in result:
            raise FormatError(f"{key!r} appears twice in one object, expected each key once")
        result[key] = value
    return result


def _no_constant(word: str) -> NoReturn:
    raise FormatError(f"{word} is no JSON, expected a finite number")


def write_json(system: System) -> str:
    """Format a system as JSON."""
    lines = [f"  {_text(key)}: {_text(value)}," for key, value in _settings(system)]
    for key, variables in (("inputs", system.inputs), ("outputs", system.outputs)):
        lines += [f'  "{key}": [', ",\n".join(map(_json_variable, variables)), "  ],"]
    lines += ['  "rules": [', ",\n".join(f"    {_rule(rule, ': ', _quoted)}" for rule in system.rules), "  ]"]
    return "\n".join(["{", *lines, "}", ""])


def _settings(system: System) -> list[tuple[str, Any]]:
    names = [("weights_of", list(system.weights_of))] if system.weights_of else []
    return [("name", system.name), *((key, getattr(system, key)) for key in (*CHOICES, "points")), *names]


def _json_variable(v: Variable) -> str:
    lines = [f'      "name": {_text(v.name)},', f'      "universe": {_text(list(v.universe))},']
    lines += [f"      {_text(key)}: {_text(value)}," for key, value in _options(v)]
    terms = ",\n".join(f"        {_text(t.name)}: {_shape(t.shape, ': ', _quoted)}" for t in v.terms)
    return "\n".join(["    {", *lines, '      "terms": {', terms, "      }", "    }"])


def write_toml(system: System) -> str:
    """Format a system as TOML."""
    # formatted here, since tomli_w writes each number of a list on its own line: 14 lines for a triangle
    lines = [f"{key} = {_text(value)}" for key, value in _settings(system)]
    lines += ["rules = [", *(f"  {_rule(rule, ' = ', str)}," for rule in system.rules), "]"]
    for key, variables in (("inputs", system.inputs), ("outputs", system.outputs)):
        for v in variables:
            lines += ["", f"[[{key}]]", f"name = {_text(v.name)}", f"universe = {_text(list(v.universe))}"]
            lines += [f"{key} = {_text(value)}" for key, value in _options(v)]
            lines.append(f"[{key}.terms]")
            lines += [f"{_key(t.name)} = {_shape(t.shape, ' = ', str)}" for t in v.terms]
    return "\n".join([*lines, ""])


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _options(v: Variable) -> Iterator[tuple[str, Any]]:
    """Yield the options of an output that differ from their defaults."""
    usual = {"aggregation": v.usual_aggregation} if isinstance(v, Output) else {}
    for key in fields(Output)[3:] if isinstance(v, Output) else ():
        if getattr(v, key.name) != usual.get(key.name, key.default):
            yield key.name, getattr(v, key.name)


def _rule(rule: Rule, sign: str, key: Callable[[str], str]) -> str:
    """Format a rule: its text, or a table where it has operators of its own."""
    if rule.operators is None:
        return _text(str(rule))
    pairs = {"rule": str(rule), **asdict(rule.operators)}
    return "{" + ", ".join(f"{key(name)}{sign}{_text(value)}" for name, value in pairs.items()) + "}"


def _shape(shape: Membership | Value, sign: str, key: Callable[[str], str]) -> str:
    """Format a term: its points, or a table of its kind and numbers."""
    if isinstance(shape, Shape):
        return _text([list(point) for point in shape.points])
    kind, numbers, text = parts_of(shape)
    pairs: list[tuple[str, Any]] = [(kind, text or (numbers[0] if kind == "constant" else list(numbers)))]
    if isinstance(shape, Curve) and shape.height != 1.0:
        pairs.append(("height", shape.height))
    return "{" + ", ".join(f"{key(name)}{sign}{_text(value)}" for name, value in pairs) + "}"


def _quoted(word: str) -> str:
    return f'"{word}"'


def _text(value: Any) -> str:
    """Format a value in a form that JSON and TOML share; names are printable, so that both escape the same signs."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
