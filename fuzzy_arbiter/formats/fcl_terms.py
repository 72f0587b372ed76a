"""Membership functions and values in the Fuzzy Control Language: the standard's, jFuzzyLogic's and fuzzylite's."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.fcl_tokens import RESERVED
from fuzzy_arbiter.formats.fll_terms import TYPES
from fuzzy_arbiter.formats.fll_terms import read_shape as read_typed
from fuzzy_arbiter.formats.notation import format_number, format_numbers, read_number, refuse
from fuzzy_arbiter.shapes import Membership, Shape, trapezoid, triangle
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

_CURVES = {kind.fcl[0]: (name, kind.fcl[1]) for name, kind in KINDS.items() if kind.fcl}
# number of parameters of each of jFuzzyLogic's functions
_COUNTS = {"TRIAN": 3, "TRAPE": 4, "COSINE": 2, **{word: len(order) for word, (_, order) in _CURVES.items()}}
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
    if word.upper() in _COUNTS:
        numbers = [_number(part, line, "a parameter") for part in arguments.split()]
        count = _COUNTS[word.upper()]
        if len(numbers) != count:
            refuse(line, f"{word} has the numbers {arguments!r}, expected {count}")
        return _curve(word.upper(), numbers)
    if word and not arguments and (word[0] in "+-.0123456789" or word.isidentifier()):
        value = _number(word, line, "a value")
        return Constant(value) if inputs is not None else Curve("singleton", (value,)), [value]
    if not text or _POINT.sub("", text):
        expected = f"points such as (0, 0) (5, 1), a number, or one of {', '.join(('FUNCTION', *_COUNTS, *TYPES))}"
        refuse(line, f"{text!r} is no membership function, expected {expected}")
    points = [(_number(x, line, "a position"), _number(y, line, "a degree")) for x, y in _POINT.findall(text)]
    return Shape(tuple(points)), [x for x, _ in points]


def _number(text: str, line: int, what: str) -> float:
    if text.isidentifier() and text.lower() not in {*RESERVED, "inf", "infinity", "nan"}:
        refuse(line, f"{what} is the variable {text!r}, which jFuzzyLogic allows; expected a number")
    return read_number(text, line, what)


def _curve(word: str, numbers: Sequence[float]) -> tuple[Membership, list[float]]:
    """Return the shape of one of jFuzzyLogic's functions and its numbers, and its default universe."""
    if word in ("TRIAN", "TRAPE"):
        positions = [numbers[0], numbers[-1]]
        if len(set(numbers)) == 1:
            return Curve("singleton", (numbers[0],)), positions
        return (triangle if word == "TRIAN" else trapezoid)(*numbers), positions
    if word == "COSINE":
        half, center = numbers
        return Curve("cosine", (center, 2.0 * half)), [center - half, center + half]
    if word == "DSIGM" and not _rises_first(*numbers):
        rising, left, falling, right = map(format_number, numbers)  # where jFuzzyLogic takes 0 for what is below 0
        first, second = f"1/(1+exp(-({rising})*(x-({left}))))", f"1/(1+exp(-({falling})*(x-({right}))))"
        return Formula(f"max({first} - {second}, 0)"), _extent(
            "sigmoid_difference", (numbers[1], *numbers[::2], numbers[3])
        )
    name, order = _CURVES[word]
    parameters = tuple(number for _, number in sorted(zip(order, numbers, strict=True)))
    return Curve(name, parameters), _extent(name, parameters)


def _rises_first(rising: float, left: float, falling: float, right: float) -> bool:
    """Return True if the first sigmoid is never below the second."""
    return rising == falling and (left <= right if rising > 0.0 else left >= right)


def _extent(name: str, p: Sequence[float]) -> list[float]:
    """Return the universe that jFuzzyLogic takes for a curve."""
    if name == "gaussian":
        return [p[0] - 4.0 * p[1], p[0] + 4.0 * p[1]]
    if name == "gaussian2":
        return [p[0] - 4.0 * p[1], p[2] + 4.0 * p[3]]
    if name == "bell":
        reach = 999.0 ** (1.0 / (2.0 * p[2])) * p[1] if p[2] else 0.0
        return [p[0] - reach, p[0] + reach]
    if name == "sigmoid":
        reach = 9.0 / abs(p[1]) if p[1] else 0.0
        return [p[0] - reach, p[0] + reach]
    reaches = [9.0 / abs(slope) if slope else 0.0 for slope in (p[1], p[2])]
    return [min(p[0] - reaches[0], p[3] - reaches[1]), max(p[0] + reaches[0], p[3] + reaches[1])]


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
        raise UnsupportedError(f"fcl cannot say the height {shape.height!r} of term {term!r}: expected 1")
    if shape.kind == "cosine":
        return f"COSINE {format_numbers((shape.parameters[1] / 2.0, shape.parameters[0]))}"
    if shape.kind == "singleton":
        return f"TRIAN {format_numbers(shape.parameters * 3)}"
    word, order = KINDS[shape.kind].fcl or ("", ())
    if not word:
        known = ", ".join(name for name, _ in _CURVES.values())
        raise UnsupportedError(
            f"fcl cannot say the kind {shape.kind!r} of term {term!r}: expected points, or one of {known}, cosine"
        )
    numbers = [shape.parameters[i] for i in order]
    if word == "DSIGM" and not _rises_first(*numbers):
        raise UnsupportedError(
            f"fcl cannot say term {term!r}, a sigmoid_difference of which the second sigmoid may be above the first"
        )
    return f"{word} {format_numbers(numbers)}"


def universe_of(positions: Sequence[float]) -> tuple[float, float] | None:
    """Return the universe from a term's points, for a variable without RANGE."""
    low, high = min(positions, default=0.0), max(positions, default=0.0)
    return (low, high) if low < high else None
