"""Operators on degrees: norms that join two of them, and hedges that bend one; each from one formula."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# what a formula may call, on numbers and on arrays; norms join these when they are defined
_NUMBERS: dict[str, Any] = {"sqrt": math.sqrt, "power": math.pow}
_ARRAYS: dict[str, Any] = {
    "sqrt": np.sqrt,
    "power": np.power,
    "where": np.where,
    "minimum": np.minimum,
    "maximum": np.maximum,
}


def conditional(formula: str) -> str:
    """Format a formula as Python: ``c ? a : b`` is a conditional expression."""
    condition, sign, rest = formula.partition(" ? ")
    yes, _, no = rest.partition(" : ")
    return f"{yes} if {condition.replace('&&', 'and')} else {conditional(no)}" if sign else formula


def _vectorized(formula: str) -> str:
    """Format a formula as NumPy, which evaluates both branches."""
    condition, sign, rest = formula.partition(" ? ")
    yes, _, no = rest.partition(" : ")
    for comparison, function in ((" < ", "minimum"), (" > ", "maximum")):
        if condition.split(comparison) == [yes, no]:
            return f"{function}({yes}, {no})"
    masks = " & ".join(f"({part})" for part in condition.split(" && "))
    return f"where({masks}, {yes}, {_vectorized(no)})" if sign else formula


@dataclass(frozen=True, slots=True)
class Operator:
    """An operator on degrees ``a`` and, for a norm, ``b``."""

    name: str  # name of the function in exported code
    formula: str  # in the arithmetic that C and Python share, with C's conditional expressions
    arguments: str
    number: Callable[..., float] = field(init=False, compare=False)
    array: Callable[..., Array] = field(init=False, compare=False)  # on arrays, or an array and a float

    def __post_init__(self) -> None:
        number = eval(f"lambda {self.arguments}: {conditional(self.formula)}", _NUMBERS)  # noqa: S307
        array = eval(f"lambda {self.arguments}: {_vectorized(self.formula)}", _ARRAYS)  # noqa: S307
        if "/" in self.formula:
            array = np.errstate(all="ignore")(array)
        _NUMBERS[self.name], _ARRAYS[self.name] = number, array
        object.__setattr__(self, "number", number)
        object.__setattr__(self, "array", array)


@dataclass(frozen=True, slots=True)
class Norm(Operator):
    """An operator that joins two degrees, with its words in all formats; empty where a format has none."""

    fll: str
    fcl: str
    fis: str  # Octave's word, and MATLAB's where it has one


def _norm(name: str, formula: str, fll: str, fcl: str, fis: str = "") -> Norm:
    return Norm(name, formula, "a, b", fll, fcl, fis or name)


T_NORMS: dict[str, Norm] = {
    "min": _norm("least", "a < b ? a : b", "Minimum", "MIN", "min"),
    "prod": _norm("product", "a * b", "AlgebraicProduct", "PROD", "prod"),
    "bounded_difference": _norm("bounded_difference", "a + b > 1.0 ? a + b - 1.0 : 0.0", "BoundedDifference", "BDIF"),
    "drastic_product": _norm("drastic_product", "a == 1.0 ? b : b == 1.0 ? a : 0.0", "DrasticProduct", "DMIN"),
    "einstein_product": _norm("einstein_product", "a * b / (1.0 + (1.0 - a) * (1.0 - b))", "EinsteinProduct", "EPROD"),
    "hamacher_product": _norm(
        "hamacher_product",
        "a > 1e-308 && b > 1e-308 ? 1.0 / (1.0 / a + 1.0 / b - 1.0) : 0.0",
        *("HamacherProduct", "HAMACHER"),
    ),
    "nilpotent_minimum": _norm("nilpotent_minimum", "a + b <= 1.0 ? 0.0 : a < b ? a : b", "NilpotentMinimum", "NIPMIN"),
}
"""Those for *and* and for implication, by name."""

S_NORMS: dict[str, Norm] = {
    "max": _norm("greatest", "a > b ? a : b", "Maximum", "MAX", "max"),
    "probor": _norm("probabilistic_sum", "a + b - a * b", "AlgebraicSum", "ASUM", "probor"),
    "bounded_sum": _norm("bounded_sum", "a + b < 1.0 ? a + b : 1.0", "BoundedSum", "BSUM"),
    "drastic_sum": _norm("drastic_sum", "a == 0.0 ? b : b == 0.0 ? a : 1.0", "DrasticSum", "DMAX"),
    "einstein_sum": _norm("einstein_sum", "(a + b) / (1.0 + a * b)", "EinsteinSum", "EINSTEIN"),
    # near two ones it is 1 less the product of what lacks, which does not cancel
    "hamacher_sum": _norm(
        "hamacher_sum",
        "a + b <= 1.0 ? (a * (1.0 - b) + b * (1.0 - a)) / (1.0 - a * b) : 1.0 - hamacher_product(1.0 - a, 1.0 - b)",
        *("HamacherSum", "HSUM"),
    ),
    "nilpotent_maximum": _norm("nilpotent_maximum", "a + b >= 1.0 ? 1.0 : a > b ? a : b", "NilpotentMaximum", "NIPMAX"),
    "normalized_sum": _norm("normalized_sum", "(a + b) / greatest(1.0, a + b)", "NormalizedSum", "NSUM"),
}
"""Those for *or* and for aggregation, by name."""

SUM = _norm("unbounded_sum", "a + b", "UnboundedSum", "SUM", "sum")
AGGREGATIONS: dict[str, Norm] = {**S_NORMS, "sum": SUM}
"""Those that join the terms of an output: of these a plain sum may exceed 1."""


@dataclass(frozen=True, slots=True)
class Hedge(Operator):
    """A word that bends a degree: *very* cold."""

    fll: bool = True  # True if fuzzylite has the hedge


_FORMULAS = {
    "very": "a * a",
    "somewhat": "sqrt(a)",
    "extremely": "a <= 0.5 ? 2.0 * a * a : 1.0 - 2.0 * (1.0 - a) * (1.0 - a)",
    "seldom": "a <= 0.5 ? sqrt(0.5 * a) : 1.0 - sqrt(0.5 * (1.0 - a))",
    "cubed": "a * a * a",  # Octave's *extremely*
    "cube_root": "power(a, 1.0 / 3.0)",
}
HEDGES: dict[str, Hedge] = {
    name: Hedge(name, formula, "a", fll=not name.startswith("cube")) for name, formula in _FORMULAS.items()
}
"""Hedges by their word; *not* and *any* are propositions of their own."""
