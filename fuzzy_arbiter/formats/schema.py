"""Build a system from the values of a JSON or TOML file, with errors that name the key."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from functools import partial
from typing import Any, NoReturn

from fuzzy_arbiter.checks import finite, shown
from fuzzy_arbiter.definition import Output, System, Variable
from fuzzy_arbiter.errors import FormatError
from fuzzy_arbiter.formats.notation import located
from fuzzy_arbiter.hierarchy import Criterion, prioritized
from fuzzy_arbiter.propositions import is_identifier
from fuzzy_arbiter.rule import Operators, Rule, parse_rule
from fuzzy_arbiter.shapes import Membership, Shape, falling, rising, trapezoid, triangle
from fuzzy_arbiter.terms.curves import curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

Reader = Callable[[Any, str], Any]  # from a value and its path in the file; it refuses an invalid one

# number of numbers of each kind of term, and what makes it
_SHAPES: dict[str, tuple[int, Callable[..., Membership]]] = {
    "triangle": (3, triangle),
    "trapezoid": (4, trapezoid),
    "rising": (2, rising),
    "falling": (2, falling),
    **{kind: (len(entry.parameters), partial(curve, kind)) for kind, entry in KINDS.items()},
}
_KINDS = (*_SHAPES, "constant", "linear", "formula")


def system_of(data: object) -> System:
    """Build the system that the values of a file define."""
    # Either `inputs`, `outputs` and `rules` are given, with the keys of `System`; or, in short, `criteria` in order of
    # priority, with the keys of `prioritized`. Terms are given by their points; as one of `triangle`, `trapezoid`,
    # `rising` and `falling` with its positions; as a curve with its parameters, such as `gaussian`, and perhaps a
    # `height`; or, of an output, as a `constant`, as `linear` with a coefficient for each input and a constant, or as a
    # `formula`. A rule is a text, or a table with the text and the operators of its block.
    if isinstance(data, dict) and "criteria" in data:
        return prioritized(**_read(data, "", _SHORT, ("criteria",)))
    return System(**_read(data, "", _LONG, ("inputs", "outputs", "rules")))


def _read(data: object, where: str, keys: dict[str, Reader], needed: Iterable[str]) -> dict[str, Any]:
    """Read the keys of a table, some of which are needed."""
    table = _table(data, where, tuple(keys))
    for key in needed:
        if key not in table:
            raise FormatError(f"{_path(where, key)}: key is missing")
    return {key: read(table[key], _path(where, key)) for key, read in keys.items() if key in table}


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


def _list_of(read: Reader) -> Reader:
    def values(data: object, where: str) -> tuple[Any, ...]:
        if not isinstance(data, list):
            _refuse(where, data, "a list")
        return tuple(read(item, f"{where}[{i}]") for i, item in enumerate(data))

    return values


def _made(make: Callable[..., Any], keys: dict[str, Reader], needed: Iterable[str]) -> Reader:
    """Return a reader of a table whose values make a part of the system."""

    def read(data: object, where: str) -> Any:
        values = _read(data, where, keys, needed)
        with located(where):
            return make(**values)

    return read


def _rule(data: object, where: str) -> Rule:
    with located(where):
        if isinstance(data, str):
            return parse_rule(data)
        if not isinstance(data, dict):
            _refuse(where, data, "text, or a table of a rule and its operators")
        values = _read(data, where, {"rule": _text, **_OPERATORS}, ("rule",))
        return replace(parse_rule(values.pop("rule")), operators=Operators(**values))


def _terms(data: object, where: str) -> tuple[Term, ...]:
    return tuple(Term(name, _shape(shape, _path(where, name))) for name, shape in _table(data, where).items())


def _shape(data: object, where: str) -> Membership | Value:
    with located(where):
        if isinstance(data, list):
            points = [_numbers(point, f"{where}[{i}]", 2) for i, point in enumerate(data)]
            return Shape(tuple((x, degree) for x, degree in points))
        kinds = [key for key in data if key != "height"] if isinstance(data, dict) else []
        if not isinstance(data, dict) or len(kinds) != 1:
            _refuse(where, data, f"a list of points, or a table with one of {', '.join(_KINDS)}")
        (kind,) = kinds
        _table(data, where, (*_KINDS, "height") if kind in KINDS or kind not in _KINDS else _KINDS)
        value, where = data[kind], f"{where}.{kind}"
        if kind == "formula":
            return Formula(_text(value, where))
        if kind == "constant":
            return Constant(_number(value, where))
        if kind == "linear":
            *coefficients, constant = _numbers(value, where, max(len(value), 1) if isinstance(value, list) else 1)
            return Linear(tuple(coefficients), constant)
        count, make = _SHAPES[kind]
        height = {"height": _number(data["height"], f"{where}.height")} if "height" in data else {}
        return make(*_numbers(value, where, count), **height)


def _path(where: str, key: str) -> str:
    name = key if is_identifier(key) else repr(key)
    return f"{where}.{name}" if where else name


def _text(value: object, where: str) -> str:
    return value if isinstance(value, str) else _refuse(where, value, "text")


def _numbers(value: object, where: str, count: int = 2) -> tuple[float, ...]:
    if not isinstance(value, list):
        _refuse(where, value, f"a list of {count} numbers")
    if len(value) != count:
        raise FormatError(f"{where}: got a list of {len(value)}, expected a list of {count} numbers")
    return tuple(_number(x, where) for x in value)


def _number(value: object, where: str) -> float:
    x = finite(value)
    return _refuse(where, value, "a finite number") if x is None else x


def _default(value: object, where: str) -> float | None:
    return None if value is None else _number(value, where)


def _as_is(value: object, where: str) -> object:
    """Return a value that the definition itself checks."""
    return value


def _refuse(where: str, value: object, expected: str) -> NoReturn:
    text = shown(value) if not isinstance(value, dict | list) else f"a {'table' if isinstance(value, dict) else 'list'}"
    raise FormatError(f"{where}: got {text}, expected {expected}")


_OPERATORS: dict[str, Reader] = dict.fromkeys(("conjunction", "disjunction", "implication"), _text)
_COMMON: dict[str, Reader] = {"normalization": _text, "outside": _text, "points": _as_is}
_VARIABLE: dict[str, Reader] = {"name": _text, "universe": _numbers, "terms": _terms}
_OUTPUT: dict[str, Reader] = {**_VARIABLE, "default": _default, **{f.name: _as_is for f in fields(Output)[4:]}}
_output = _made(Output, _OUTPUT, _VARIABLE)
_criterion = _made(Criterion, {"name": _text, "on": _text, "off": _text, "membership": _shape}, ("name",))
_LONG: dict[str, Reader] = {
    "name": _text,
    **_OPERATORS,
    **_COMMON,
    "weights_of": _list_of(_text),
    "inputs": _list_of(_made(Variable, _VARIABLE, _VARIABLE)),
    "outputs": _list_of(_output),
    "rules": _list_of(_rule),
}
_SHORT: dict[str, Reader] = {
    "name": _text, "criteria": _list_of(_criterion), "form": _text, "weight": _output, **_COMMON
}  # fmt: skip
