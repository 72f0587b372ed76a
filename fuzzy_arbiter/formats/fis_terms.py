"""Membership functions and values in MATLAB's text."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.formats.fis_words import CURVES, FUNCTIONS, SHOULDERS, STRAIGHT, VALUES
from fuzzy_arbiter.formats.fll_terms import curve_of, read_shape, read_value
from fuzzy_arbiter.formats.notation import format_numbers, read_number, refuse
from fuzzy_arbiter.shapes import Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.expressions import Expression
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Formula, Value


def read_function(function: str, text: str, line: int, term: str, inputs: int | None) -> Membership | Value:
    """Return the membership function or value of a function's name and numbers."""
    if function not in FUNCTIONS:
        refuse(line, f"term {term!r} is {function!r}, which is not known here; expected {', '.join(FUNCTIONS)}")
    if function == "function":
        return Formula(text)
    numbers = numbers_of(text, line, f"place of {term!r}")
    if function in VALUES:
        return read_value(function, numbers, line, inputs)
    if function in CURVES:
        name, order = CURVES[function]
        numbers = _unpadded(numbers, len(order))
        if function in ("zmf", "smf") and len(numbers) == 2 and numbers[0] > numbers[1]:
            numbers = [sum(numbers) / 2] * 2  # where MATLAB lets it jump
        return curve_of(name, order, numbers, line, function)
    kind, count = STRAIGHT.get(function, ("", 2))
    numbers = _unpadded(numbers, count) if count else numbers
    if len(numbers) not in (count or len(numbers), count + 1 if function in ("rampmf", "rectmf") else count):
        refuse(line, f"term {term!r} has the places [{text}], expected {count} for {function}")
    if function in SHOULDERS:
        return SHOULDERS[function](*numbers)
    if function == "trapmf" and numbers[1] > numbers[2]:
        return _crossed(*numbers)
    return read_shape(kind, format_numbers(numbers), line)


def complement(shape: Membership) -> Membership:
    """Return the function that is 1 less another."""
    if isinstance(shape, Shape):
        return Shape(tuple((x, 1.0 - degree) for x, degree in shape.points))
    if isinstance(shape, Curve) and len(shape.trees) == 1:
        return Formula(f"1 - ({Expression('', shape.trees[0]).text})")
    raise DefinitionError("the complement of this function is not known, expected straight pieces or a curve in one")


def with_unique_names(terms: Sequence[Term]) -> tuple[Term, ...]:
    """Append a number to each repeated name, so that all terms have different names."""
    renamed: list[Term] = []
    for term in terms:
        name, names = term.name, {other.name for other in renamed}
        for k in range(2, len(terms) + 2):
            if name not in names:
                break
            name = f"{term.name}_{k}"
        renamed.append(Term(name, term.shape))
    return tuple(renamed)


def numbers_of(text: str, line: int, what: str) -> list[float]:
    """Parse the numbers in brackets; each may be an expression such as ``-pi/4``."""
    return [_number(part, line, what) for part in re.split(r"[\s,;]+", text.strip()) if part]


def _number(text: str, line: int, what: str) -> float:
    if "pi" not in text:
        return read_number(text, line, what)
    whole = Expression(text)
    return whole({}) if not whole.names else read_number(text, line, what)


def _unpadded(numbers: list[float], count: int) -> list[float]:
    """Return numbers without the zeros with which MATLAB's old files fill all up to four."""
    return numbers[:count] if len(numbers) == 4 > count and not any(numbers[count:]) else numbers


def _crossed(a: float, b: float, c: float, d: float) -> Shape:
    """Return the lesser of a rise from a to b and a fall from c to d that cross below 1."""
    place = (a * (d - c) + d * (b - a)) / ((b - a) + (d - c))
    return Shape(((a, 0.0), (place, (place - a) / (b - a)), (d, 0.0)))
