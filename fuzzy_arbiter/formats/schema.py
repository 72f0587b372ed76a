"""Build a system from the values of a JSON or TOML file, with errors that name the key."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NoReturn

from fuzzy_arbiter.checks import finite, shown
from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.notation import located
from fuzzy_arbiter.hierarchy import DEGREE, WEIGHT, Criterion, prioritized
from fuzzy_arbiter.propositions import is_identifier
from fuzzy_arbiter.rule import Operators, Rule
from fuzzy_arbiter.rule_text import parse_rule
from fuzzy_arbiter.shapes import Membership, Shape, falling, rising, trapezoid, triangle
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

_SETTINGS = ("conjunction", "disjunction", "implication", "normalization", "outside", "points")
_LONG = ("name", *_SETTINGS, "weights_of", "inputs", "outputs", "rules")
_SHORT = ("name", "criteria", "form", "weight", "normalization", "outside", "points")
_VARIABLE = ("name", "universe", "terms")
_OUTPUT = (*_VARIABLE, "default", "defuzzifier", "aggregation", "lock_range", "lock_previous")
_OPERATORS = ("conjunction", "disjunction", "implication")
_CRITERION = ("name", "on", "off", "membership")
_SHAPES: dict[str, tuple[int, Callable[..., Shape]]] = {
    "triangle": (3, triangle),
    "trapezoid": (4, trapezoid),
    "rising": (2, rising),
    "falling": (2, falling),
}
_VALUES = ("constant", "linear", "formula")
_KINDS = (*_SHAPES, *KINDS, *_VALUES)


def system_of(data: object) -> System:
    """Build the system that the values of a file define."""
    # Either `inputs`, `outputs` and `rules` are given, with the keys of `System`; or, in short, `criteria` in order of
    # priority, with the keys of `prioritized`. Terms are given by their points; as one of `triangle`, `trapezoid`,
    # `rising` and `falling` with its places; as a curve with its parameters, such as `gaussian`, and perhaps a
    # `height`; or, of an output, as a `constant`, as `linear` with a coefficient for each input and a constant, or as a
    # `formula`. A rule is a text, or a table with the text and the operators of its block.
    table = _table(data, "", _SHORT if isinstance(data, dict) and "criteria" in data else _LONG)
    settings = {key: table[key] for key in ("name", *_SETTINGS) if key in table}
    for key, value in settings.items():
        if key != "points" and not isinstance(value, str):
            _refuse(key, value, "text")
    if "criteria" in table:
        form = table.get("form", "hierarchical")
        if not isinstance(form, str):
            _refuse("form", form, "text")
        criteria = tuple(_criterion(c, f"criteria[{i}]") for i, c in enumerate(_list(table, "criteria", "")))
        weight = _variable(table["weight"], "weight", Output) if "weight" in table else WEIGHT
        return prioritized(criteria, form, weight, **settings)  # type: ignore[arg-type]  # which it checks itself
    inputs = tuple(_variable(v, f"inputs[{i}]", Variable) for i, v in enumerate(_list(table, "inputs", "")))
    outputs = tuple(_variable(v, f"outputs[{i}]", Output) for i, v in enumerate(_list(table, "outputs", "")))
    rules = []
    for i, text in enumerate(_list(table, "rules", "")):
        with located(f"rules[{i}]"):
            rules.append(_rule(text, f"rules[{i}]"))
    if "weights_of" in table:
        names = _list(table, "weights_of", "")
        settings["weights_of"] = tuple(_string(name, f"weights_of[{i}]") for i, name in enumerate(names))
    return System(inputs, outputs, tuple(rules), **settings)


def _rule(data: object, where: str) -> Rule:
    if isinstance(data, str):
        return parse_rule(data)
    if not isinstance(data, dict):
        _refuse(where, data, "text, or a table of a rule and its operators")
    table = _table(data, where, ("rule", *_OPERATORS))
    operators = Operators(**{key: _string(table[key], f"{where}.{key}") for key in _OPERATORS if key in table})
    return replace(parse_rule(_string(_needed(table, "rule", where), f"{where}.rule")), operators=operators)


def _variable(data: object, where: str, kind: type[Variable]) -> Any:
    table = _table(data, where, _OUTPUT if kind is Output else _VARIABLE)
    name = _string(_needed(table, "name", where), f"{where}.name")
    bounds = _numbers(_needed(table, "universe", where), 2, f"{where}.universe")
    terms = []
    for term, shape in _table(_needed(table, "terms", where), f"{where}.terms").items():
        terms.append(Term(term, _shape(shape, _path(f"{where}.terms", term))))
    options: dict[str, Any] = {key: table[key] for key in _OUTPUT[4:] if key in table}
    if table.get("default") is not None:
        options["default"] = _number(table["default"], f"{where}.default")
    with located(where):
        return kind(name, (bounds[0], bounds[1]), tuple(terms), **options)


def _criterion(data: object, where: str) -> Criterion:
    table = _table(data, where, _CRITERION)
    _needed(table, "name", where)
    words = {key: _string(table[key], f"{where}.{key}") for key in ("name", "on", "off") if key in table}
    membership = _shape(table["membership"], f"{where}.membership") if "membership" in table else DEGREE
    with located(where):
        return Criterion(**words, membership=membership)  # type: ignore[arg-type]  # which it checks itself


def _shape(data: object, where: str) -> Membership | Value:
    with located(where):
        if isinstance(data, list):
            points = (_numbers(point, 2, f"{where}[{i}]") for i, point in enumerate(data))
            return Shape(tuple((x, degree) for x, degree in points))
        found = [key for key in data if key != "height"] if isinstance(data, dict) else []
        if not isinstance(data, dict) or len(found) != 1:
            _refuse(where, data, f"a list of points, or a table with one of {', '.join(_KINDS)}")
        (kind,) = found
        _table(data, where, (*_KINDS, "height") if kind in KINDS or kind not in _KINDS else _KINDS)
        at, value = f"{where}.{kind}", data[kind]
        if kind in KINDS:
            height = _number(data["height"], f"{where}.height") if "height" in data else 1.0
            return Curve(kind, tuple(_numbers(value, len(KINDS[kind].parameters), at)), height)
        if kind == "formula":
            return Formula(_string(value, at))
        if kind == "constant":
            return Constant(_number(value, at))
        if kind == "linear":
            *coefficients, constant = _numbers(value, max(len(value), 1) if isinstance(value, list) else 1, at)
            return Linear(tuple(coefficients), constant)
        count, make = _SHAPES[kind]
        return make(*_numbers(value, count, at))


def _table(data: object, where: str, known: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return a table of known keys; of any keys if none is known."""
    if not isinstance(data, dict):
        _refuse(where or "the file", data, "a table of keys and values")
    for key in data:
        if known and key not in known:
            near = difflib.get_close_matches(key[:100], known, 1)
            hint = f"; did you mean {near[0]!r}" if near else ""
            raise FormatError(f"{_path(where, key)}: unknown key, expected one of {', '.join(known)}{hint}")
    return data


def _path(where: str, key: str) -> str:
    name = key if is_identifier(key) else repr(key)
    return f"{where}.{name}" if where else name


def _needed(table: dict[str, Any], key: str, where: str) -> Any:
    if key not in table:
        raise FormatError(f"{_path(where, key)}: key is missing")
    return table[key]


def _list(table: dict[str, Any], key: str, where: str) -> list[Any]:
    value = _needed(table, key, where)
    return value if isinstance(value, list) else _refuse(key, value, "a list")


def _string(value: object, where: str) -> str:
    return value if isinstance(value, str) else _refuse(where, value, "text")


def _numbers(value: object, count: int, where: str) -> list[float]:
    if not isinstance(value, list) or len(value) != count:
        _refuse(where, value, f"a list of {count} numbers")
    return [_number(x, where) for x in value]


def _number(value: object, where: str) -> float:
    x = finite(value)
    return _refuse(where, value, "a finite number") if x is None else x


def _refuse(where: str, value: object, expected: str) -> NoReturn:
    text = shown(value) if not isinstance(value, dict | list) else f"a {'table' if isinstance(value, dict) else 'list'}"
    raise FormatError(f"{where}: got {text}, expected {expected}")
