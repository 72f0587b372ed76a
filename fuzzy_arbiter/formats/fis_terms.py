"""Membership functions and values in MATLAB's text."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.formats.fll_terms import shape_of
from fuzzy_arbiter.formats.notation import read_number, refuse
from fuzzy_arbiter.shapes import Membership, Shape, falling, rising
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.expressions import Expression
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.term import Term
from fuzzy_arbiter.terms.values import Formula, Value

_SHOULDERS = {"linsmf": rising, "linzmf": falling}
# functions, each with its type in fuzzylite, and the indices of that type's numbers in MATLAB's order
_TYPES: dict[str, tuple[str, Sequence[int]]] = {
    "trimf": ("Triangle", range(3)),
    "trapmf": ("Trapezoid", range(4)),
    "rampmf": ("Ramp", range(2)),
    "rectmf": ("Rectangle", range(2)),
    "binarymf": ("Binary", range(2)),
    "discretemf": ("Discrete", ()),
    **{word: ("", range(2)) for word in _SHOULDERS},
    **{kind.fis[0]: (kind.fll, kind.fis[1]) for kind in KINDS.values() if kind.fll},
    "constant": ("Constant", ()),
    "linear": ("Linear", ()),
    "function": ("Function", ()),
}
_WITHOUT_HEIGHT = ("trimf", "trapmf", "binarymf", *_SHOULDERS)


def read_function(function: str, text: str, line: int, term: str, inputs: int | None) -> Membership | Value:
    """Return the membership function or value of a function's name and numbers."""
    if function not in _TYPES:
        refuse(line, f"term {term!r} is {function!r}, which is not known here; expected {', '.join(_TYPES)}")
    if function == "function":
        return Formula(text)
    kind, order = _TYPES[function]
    count = len(order)
    numbers = numbers_of(text, line, f"a parameter of term {term!r}", infinite=True)
    if len(numbers) == 4 > count and order and not any(numbers[count:]):
        del numbers[count:]  # the zeros with which MATLAB's old files fill all up to four
    if function in _WITHOUT_HEIGHT and len(numbers) != count:
        refuse(line, f"term {term!r} has the parameters [{text}], expected {count} for {function}")
    if function in _SHOULDERS:
        return _SHOULDERS[function](*numbers)
    if function == "trapmf" and numbers[1] > numbers[2]:
        return _crossed(*numbers)
    if function in ("zmf", "smf") and len(numbers) == 2 and numbers[0] > numbers[1]:
        numbers = [sum(numbers) / 2] * 2  # where MATLAB lets it jump
    if order and len(numbers) not in (count, count + 1):
        refuse(line, f"{function} has the numbers {text!r}, expected {count}, and perhaps a height")
    sorted_numbers = [number for _, number in sorted(zip(order, numbers, strict=False))]
    return shape_of(kind, [*sorted_numbers, *numbers[count:]], line, inputs, function)


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


def numbers_of(text: str, line: int, what: str, infinite: bool = False) -> list[float]:
    """Parse the numbers in brackets; each may be an expression such as ``-pi/4``."""
    return [_number(part, line, what, infinite) for part in re.split(r"[\s,;]+", text.strip()) if part]


def _number(text: str, line: int, what: str, infinite: bool) -> float:
    whole = Expression(text) if "pi" in text else None
    return whole({}) if whole and not whole.names else read_number(text, line, what, infinite)


def _crossed(a: float, b: float, c: float, d: float) -> Shape:
    """Return the lesser of a rise from a to b and a fall from c to d that cross below 1."""
    apex = (a * (d - c) + d * (b - a)) / ((b - a) + (d - c))
    return Shape(((a, 0.0), (apex, (apex - a) / (b - a)), (d, 0.0)))
