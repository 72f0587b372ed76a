"""Operators on degrees: norms that join two of them, and hedges that bend one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Norm:
    """An operator that joins two degrees, with its words in all formats."""

    number: Callable[[float, float], float]  # joins two floats
    array: Callable[[Array, Array], Array]  # joins two arrays, or an array and a float, each pair as `number` does
    code: str  # expression in C and in Python of the degrees ``{0}`` and ``{1}``
    fll: str  # word in the format; empty where there is none. That of FIS is Octave's, and MATLAB's where it has one
    # word in the format; empty where there is none. That of FIS is Octave's, and MATLAB's where it has one
    fcl: str = ""
    # word in the format; empty where there is none. That of FIS is Octave's, and MATLAB's where it has one
    fis: str = ""


def bounded_difference(a: float, b: float) -> float:
    """Return max(0, a + b - 1)."""
    return a + b - 1.0 if a + b > 1.0 else 0.0


def drastic_product(a: float, b: float) -> float:
    """Return the other degree where one is 1, else 0."""
    return b if a == 1.0 else a if b == 1.0 else 0.0


def einstein_product(a: float, b: float) -> float:
    """Return a b / (1 + (1 - a) (1 - b))."""
    return a * b / (1.0 + (1.0 - a) * (1.0 - b))


def hamacher_product(a: float, b: float) -> float:
    """Return 1 / (1/a + 1/b - 1), and 0 where one is 0."""
    return 1.0 / (1.0 / a + 1.0 / b - 1.0) if a > 1e-308 and b > 1e-308 else 0.0


def nilpotent_minimum(a: float, b: float) -> float:
    """Return the lesser degree where both sum to more than 1, else 0."""
    return 0.0 if a + b <= 1.0 else a if a < b else b


def bounded_sum(a: float, b: float) -> float:
    """Return min(1, a + b)."""
    return a + b if a + b < 1.0 else 1.0


def drastic_sum(a: float, b: float) -> float:
    """Return the other degree where one is 0, else 1."""
    return b if a == 0.0 else a if b == 0.0 else 1.0


def einstein_sum(a: float, b: float) -> float:
    """Return (a + b) / (1 + a b)."""
    return (a + b) / (1.0 + a * b)


def hamacher_sum(a: float, b: float) -> float:
    """Return (a (1 - b) + b (1 - a)) / (1 - a b); near two ones that is 1 less the product of what lacks."""
    if a + b <= 1.0:
        return (a * (1.0 - b) + b * (1.0 - a)) / (1.0 - a * b)
    return 1.0 - hamacher_product(1.0 - a, 1.0 - b)


def nilpotent_maximum(a: float, b: float) -> float:
    """Return the greater degree where both sum to less than 1, else 1."""
    return 1.0 if a + b >= 1.0 else a if a > b else b


def normalized_sum(a: float, b: float) -> float:
    """Return (a + b) / max(1, a + b)."""
    return (a + b) / max(1.0, a + b)


def _hamacher_product(a: Array, b: Array) -> Array:
    good = (a > 1e-308) & (b > 1e-308)
    above = np.ones(np.shape(good))
    first, second = (np.divide(above, x, out=np.ones_like(above), where=good) for x in (a, b))
    return np.asarray(np.where(good, 1.0 / (first + second - 1.0), 0.0))


T_NORMS: dict[str, Norm] = {
    "min": Norm(min, np.minimum, "least({0}, {1})", "Minimum", "MIN", "min"),
    "prod": Norm(lambda a, b: a * b, np.multiply, "({0} * {1})", "AlgebraicProduct", "PROD", "prod"),
    "bounded_difference": Norm(
        bounded_difference,
        lambda a, b: np.maximum(a + b - 1.0, 0.0),
        "bounded_difference({0}, {1})",
        *("BoundedDifference", "BDIF", "bounded_difference"),
    ),
    "drastic_product": Norm(
        drastic_product,
        lambda a, b: np.where(a == 1.0, b, np.where(b == 1.0, a, 0.0)),
        "drastic_product({0}, {1})",
        *("DrasticProduct", "DMIN", "drastic_product"),
    ),
    "einstein_product": Norm(
        einstein_product,
        lambda a, b: a * b / (1.0 + (1.0 - a) * (1.0 - b)),
        "einstein_product({0}, {1})",
        *("EinsteinProduct", "EPROD", "einstein_product"),
    ),
    "hamacher_product": Norm(
        hamacher_product,
        _hamacher_product,
        "hamacher_product({0}, {1})",
        *("HamacherProduct", "HAMACHER", "hamacher_product"),
    ),
    "nilpotent_minimum": Norm(
        nilpotent_minimum,
        lambda a, b: np.where(a + b <= 1.0, 0.0, np.minimum(a, b)),
        "nilpotent_minimum({0}, {1})",
        *("NilpotentMinimum", "NIPMIN", "nilpotent_minimum"),
    ),
}
"""Those for *and* and for implication, by name."""

S_NORMS: dict[str, Norm] = {
    "max": Norm(max, np.maximum, "greatest({0}, {1})", "Maximum", "MAX", "max"),
    "probor": Norm(
        lambda a, b: a + b - a * b, lambda a, b: a + b - a * b, "either({0}, {1})", "AlgebraicSum", "ASUM", "probor"
    ),
    "bounded_sum": Norm(
        bounded_sum,
        lambda a, b: np.minimum(a + b, 1.0),
        "bounded_sum({0}, {1})",
        *("BoundedSum", "BSUM", "bounded_sum"),
    ),
    "drastic_sum": Norm(
        drastic_sum,
        lambda a, b: np.where(a == 0.0, b, np.where(b == 0.0, a, 1.0)),
        "drastic_sum({0}, {1})",
        *("DrasticSum", "DMAX", "drastic_sum"),
    ),
    "einstein_sum": Norm(
        einstein_sum,
        lambda a, b: (a + b) / (1.0 + a * b),
        "einstein_sum({0}, {1})",
        *("EinsteinSum", "EINSTEIN", "einstein_sum"),
    ),
    "hamacher_sum": Norm(
        hamacher_sum,
        lambda a, b: np.where(
            a + b <= 1.0,
            (a * (1.0 - b) + b * (1.0 - a)) / np.maximum(1.0 - a * b, 0.5),
            1.0 - _hamacher_product(1.0 - a, 1.0 - b),
        ),
        "hamacher_sum({0}, {1})",
        *("HamacherSum", "HSUM", "hamacher_sum"),
    ),
    "nilpotent_maximum": Norm(
        nilpotent_maximum,
        lambda a, b: np.where(a + b >= 1.0, 1.0, np.maximum(a, b)),
        "nilpotent_maximum({0}, {1})",
        *("NilpotentMaximum", "NIPMAX", "nilpotent_maximum"),
    ),
    "normalized_sum": Norm(
        normalized_sum,
        lambda a, b: (a + b) / np.maximum(a + b, 1.0),
        "normalized_sum({0}, {1})",
        *("NormalizedSum", "NSUM", "normalized_sum"),
    ),
}
"""Those for *or* and for aggregation, by name."""

SUM = Norm(lambda a, b: a + b, lambda a, b: a + b, "({0} + {1})", "UnboundedSum", "SUM", "sum")
AGGREGATIONS: dict[str, Norm] = {**S_NORMS, "sum": SUM}
"""Those that join the terms of an output: of these a plain sum may exceed 1."""


@dataclass(frozen=True, slots=True)
class HedgeKind:
    """A word that bends a degree: *very* cold."""

    number: Callable[[float], float]  # bends a float, or each of an array
    array: Callable[[Array], Array]  # bends a float, or each of an array
    fll: bool = True  # true if fuzzylite has the hedge


def very(a: float) -> float:
    """Return a^2."""
    return a * a


def somewhat(a: float) -> float:
    """Return the square root."""
    return math.sqrt(a)


def extremely(a: float) -> float:
    """Return 2 a^2 up to 1/2, and from there 1 - 2 (1 - a)^2."""
    return 2.0 * a * a if a <= 0.5 else 1.0 - 2.0 * (1.0 - a) * (1.0 - a)


def seldom(a: float) -> float:
    """Return sqrt(a / 2) up to 1/2, and from there 1 - sqrt((1 - a) / 2)."""
    return math.sqrt(0.5 * a) if a <= 0.5 else 1.0 - math.sqrt(0.5 * (1.0 - a))


def cubed(a: float) -> float:
    """Return a^3."""
    return a * a * a


def cube_root(a: float) -> float:
    """Return the cube root."""
    return math.pow(a, 1.0 / 3.0)


HEDGES: dict[str, HedgeKind] = {
    "very": HedgeKind(very, lambda a: a * a),
    "somewhat": HedgeKind(somewhat, np.sqrt),
    "extremely": HedgeKind(extremely, lambda a: np.where(a <= 0.5, 2.0 * a * a, 1.0 - 2.0 * (1.0 - a) * (1.0 - a))),
    "seldom": HedgeKind(seldom, lambda a: np.where(a <= 0.5, np.sqrt(0.5 * a), 1.0 - np.sqrt(0.5 * (1.0 - a)))),
    "cubed": HedgeKind(cubed, lambda a: a * a * a, fll=False),  # Octave's *extremely*
    "cube_root": HedgeKind(cube_root, lambda a: a ** (1.0 / 3.0), fll=False),
}
"""Hedges by their word; *not* and *any* are propositions of their own."""
