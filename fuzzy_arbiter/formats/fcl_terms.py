"""Membership functions and values in the Fuzzy Control Language: the standard's, jFuzzyLogic's and fuzzylite's."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fcl_tokens import RESERVED
from fuzzy_arbiter.formats.fll_terms import TYPES, shape_of
from fuzzy_arbiter.formats.fll_terms import read_shape as read_typed
from fuzzy_arbiter.formats.notation import format_number, format_numbers, read_number, refuse
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS, Word
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

# jFuzzyLogic's functions, each with its type in fuzzylite, and the indices of that type's numbers in its order
_TYPES: dict[str, Word] = {
    "TRIAN": ("Triangle", (0, 1, 2)),
    "TRAPE": ("Trapezoid", (0, 1, 2, 3)),
    "COSINE": ("Cosine", (1, 0)),
    **{kind.fcl[0]: (kind.fll, kind.fcl[1]) for kind in KINDS.values() if kind.fcl},
}
_POINT = re.compile(r"\( (\S+) , (\S+) \)(?: ,)?(?: |$)")  # examples of the standard have commas between points


def read_shape(text: str, line: int, inputs: Sequence[str] | None) -> tuple[Membership | Value, list[float]]:
    """Parse a term's shape, and return its lowest and highest point; the inputs are those before an output."""
    word, _, arguments = text.partition(" ")
    if word == "FUNCTION":  # jFuzzyLogic's, whose LOG is that to the base of 10
        formula = Formula(" ".join("log10" if part.upper() == "LOG" else part for part in arguments.split(" ")))
        linear = Linear.of(formula.expression(sorted(formula.names)).tree, inputs or ())
        return linear or formula, []
    if word in TYPES:
        shape = read_typed(word, arguments, line, None if inputs is None else len(inputs))
        return shape, [shape.value] if isinstance(shape, Constant) else []
    if word.upper() in _TYPES:
        numbers = [_number(part, line, "a parameter") for part in arguments.split()]
        kind, order = _TYPES[word.upper()]
        if len(numbers) != len(order):
            refuse(line, f"{word} has the numbers {arguments!r}, expected {len(order)}")
        return _curve(kind, [number for _, number in sorted(zip(order, numbers, strict=True))], line)
    if word and not arguments and (word[0] in "+-.0123456789" or word.isidentifier()):
        value = _number(word, line, "a value")
        return Constant(value) if inputs is not None else Curve("singleton", (value,)), [value]
    if not text or _POINT.sub("", text):
        expected = f"points such as (0, 0) (5, 1), a number, or one of {', '.join(('FUNCTION', *_TYPES, *TYPES))}"
        refuse(line, f"{text!r} is no membership function, expected {expected}")
    points = [(_number(x, line, "a position"), _number(y, line, "a degree")) for x, y in _POINT.findall(text)]
    return Shape(tuple(points)), [x for x, _ in points]


def _number(text: str, line: int, what: str) -> float:
    if text.isidentifier() and text.lower() not in {*RESERVED, "inf", "infinity", "nan"}:
        refuse(line, f"{what} is the variable {text!r}, which jFuzzyLogic allows; expected a number")
    return read_number(text, line, what)


def _curve(kind: str, p: list[float], line: int) -> tuple[Membership | Value, list[float]]:
    """Return the shape of one of jFuzzyLogic's functions, and its default universe."""
    if kind in ("Triangle", "Trapezoid"):
        extent = [p[0], p[-1]]
    elif kind == "Cosine":
        extent = [p[0] - p[1], p[0] + p[1]]
        p[1] *= 2.0  # half of the width
    elif kind == "Gaussian":
        extent = [p[0] - 4.0 * p[1], p[0] + 4.0 * p[1]]
    elif kind == "GaussianProduct":
        extent = [p[0] - 4.0 * p[1], p[2] + 4.0 * p[3]]
    elif kind == "Bell":
        reach = 999.0 ** (1.0 / (2.0 * p[2])) * p[1] if p[2] else 0.0
        extent = [p[0] - reach, p[0] + reach]
    elif kind == "Sigmoid":
        extent = [p[0] - _reach(p[1]), p[0] + _reach(p[1])]
    else:
        ends = [(p[0], _reach(p[1])), (p[3], _reach(p[2]))]
        extent = [min(x - reach for x, reach in ends), max(x + reach for x, reach in ends)]
        if not _rises_first(*p):
            left, rising, falling, right = map(format_number, p)  # where jFuzzyLogic takes 0 for what is below 0
            first, second = f"1/(1+exp(-({rising})*(x-({left}))))", f"1/(1+exp(-({falling})*(x-({right}))))"
            return Formula(f"max({first} - {second}, 0)"), extent
    return shape_of(kind, p, line, None), extent


def _reach(slope: float) -> float:
    return 9.0 / abs(slope) if slope else 0.0


def _rises_first(left: float, rising: float, falling: float, right: float) -> bool:
    """Return True if the first sigmoid is never below the second."""
    return rising == falling and (left <= right if rising > 0.0 else left >= right)


def format_shape(shape: Membership | Value, term: str, inputs: Sequence[str]) -> str:
    """Format a term's shape in the words of the standard and jFuzzyLogic."""
    if isinstance(shape, Shape):
        return " ".join(f"({format_number(x)}, {format_number(degree)})" for x, degree in shape.points)
    if isinstance(shape, Constant):
        return format_number(shape.value)
    if isinstance(shape, Formula | Linear):
        text = shape.text if isinstance(shape, Formula) else shape.expression(inputs).text
        return f"FUNCTION {text}"
    assert isinstance(shape, Curve)
    if shape.height != 1.0:
        raise UnsupportedError(f"fcl cannot express the height {shape.height!r} of term {term!r}: expected 1")
    parameters = shape.parameters
    if shape.kind == "cosine":
        return f"COSINE {format_numbers((parameters[1] / 2.0, parameters[0]))}"
    if shape.kind == "singleton":
        return f"TRIAN {format_numbers(parameters * 3)}"
    word, order = KINDS[shape.kind].fcl or ("", ())
    if not word:
        known = ", ".join(name for name, kind in KINDS.items() if kind.fcl)
        raise UnsupportedError(
            f"fcl cannot express the kind {shape.kind!r} of term {term!r}: expected points, or one of {known}, cosine"
        )
    if word == "DSIGM" and not _rises_first(*parameters):
        raise UnsupportedError(
            f"fcl cannot express term {term!r}, a sigmoid_difference of which the second sigmoid may be above the first"
        )
    return f"{word} {format_numbers(parameters[i] for i in order)}"


def universe_of(positions: Sequence[float]) -> tuple[float, float] | None:
    """Return the universe from a term's points, for a variable without RANGE."""
    low, high = min(positions, default=0.0), max(positions, default=0.0)
    return (low, high) if low < high else None
