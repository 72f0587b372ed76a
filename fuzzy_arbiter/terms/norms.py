"""Operators on degrees: norms that join two of them, and hedges that bend one; each from one formula."""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ARITHMETIC: dict[type[ast.AST], Any] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide,
    ast.Lt: np.less, ast.LtE: np.less_equal, ast.Gt: np.greater, ast.GtE: np.greater_equal, ast.Eq: np.equal,
}  # fmt: skip
_FUNCTIONS: dict[str, Any] = {"sqrt": np.sqrt, "pow": np.power}


@cache
def formula(number: Callable[..., float]) -> ast.expr:
    """Return the expression that a function of numbers returns."""
    (function,) = ast.parse(inspect.getsource(number)).body
    assert isinstance(function, ast.FunctionDef)
    returned = function.body[-1]
    assert isinstance(returned, ast.Return) and returned.value is not None
    return returned.value


@cache
def _on_arrays(number: Callable[..., float]) -> Callable[[dict[str, Any]], Any]:
    try:
        return _vectorized(formula(number))
    except OSError:  # without sources, as in a frozen program: slower
        each = np.vectorize(number, otypes=[np.float64])
        return lambda values: each(*values.values())


def _vectorized(node: ast.expr) -> Callable[[dict[str, Any]], Any]:
    """Return a function that evaluates an expression on arrays by name, both branches of a condition."""
    match node:
        case ast.Constant(value):
            return lambda values: value
        case ast.Name(name):
            return lambda values: values[name]
        case ast.Call(ast.Name(name), arguments):
            called = globals()[name]
            names, inner = list(inspect.signature(called).parameters), [_vectorized(part) for part in arguments]
            body = _on_arrays(called)
            return lambda values: body({key: part(values) for key, part in zip(names, inner, strict=True)})
        case ast.Call(ast.Attribute(_, name), arguments):
            function, parts = _FUNCTIONS[name], [_vectorized(part) for part in arguments]
        case ast.IfExp(ast.Compare(left, [ast.Lt() | ast.Gt() as sign], [right]), yes, no) if ast.dump(
            left
        ) == ast.dump(yes) and ast.dump(right) == ast.dump(no):
            function = np.minimum if isinstance(sign, ast.Lt) else np.maximum
            parts = [_vectorized(yes), _vectorized(no)]
        case ast.IfExp(test, yes, no):
            function, parts = np.where, [_vectorized(part) for part in (test, yes, no)]
        case ast.BoolOp(ast.And(), [left, right]):
            function, parts = np.logical_and, [_vectorized(left), _vectorized(right)]
        case ast.BinOp(left, sign, right) | ast.Compare(left, [sign], [right]):
            function, parts = _ARITHMETIC[type(sign)], [_vectorized(left), _vectorized(right)]
        case _:
            raise NotImplementedError(ast.dump(node))
    return lambda values: function(*[part(values) for part in parts])


@dataclass(frozen=True, slots=True)
class Operator:
    """An operator on degrees ``a`` and, for a norm, ``b``."""

    number: Callable[..., float]  # on numbers, in one expression, from which all else follows

    @property
    def name(self) -> str:
        """Name of the function in exported code."""
        return self.number.__name__

    def array(self, *degrees: Any) -> Array:
        """Return the result for arrays, or an array and a number, of each as `number` gives it."""
        with np.errstate(all="ignore"):
            return np.asarray(_on_arrays(self.number)(dict(zip("ab", degrees, strict=False))))


@dataclass(frozen=True, slots=True)
class Norm(Operator):
    """An operator that joins two degrees, with its words in all formats; empty where a format has none."""

    fll: str
    fcl: str
    fis: str  # Octave's word, and MATLAB's where it has one


def least(a: float, b: float) -> float:
    """Return the lesser degree."""
    return a if a < b else b


def product(a: float, b: float) -> float:
    """Return a b."""
    return a * b


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


def greatest(a: float, b: float) -> float:
    """Return the greater degree."""
    return a if a > b else b


def probabilistic_sum(a: float, b: float) -> float:
    """Return a + b - a b."""
    return a + b - a * b


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
    """Return (a + b - 2 a b) / (1 - a b); near two ones that is 1 less the product of what lacks."""
    return (a * (1.0 - b) + b * (1.0 - a)) / (1.0 - a * b) if a + b <= 1.0 else 1.0 - hamacher_product(1.0 - a, 1.0 - b)


def nilpotent_maximum(a: float, b: float) -> float:
    """Return the greater degree where both sum to less than 1, else 1."""
    return 1.0 if a + b >= 1.0 else a if a > b else b


def normalized_sum(a: float, b: float) -> float:
    """Return (a + b) / max(1, a + b)."""
    return (a + b) / greatest(1.0, a + b)


def unbounded_sum(a: float, b: float) -> float:
    """Return a + b."""
    return a + b


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


T_NORMS: dict[str, Norm] = {
    "min": Norm(least, "Minimum", "MIN", "min"),
    "prod": Norm(product, "AlgebraicProduct", "PROD", "prod"),
    "bounded_difference": Norm(bounded_difference, "BoundedDifference", "BDIF", "bounded_difference"),
    "drastic_product": Norm(drastic_product, "DrasticProduct", "DMIN", "drastic_product"),
    "einstein_product": Norm(einstein_product, "EinsteinProduct", "EPROD", "einstein_product"),
    "hamacher_product": Norm(hamacher_product, "HamacherProduct", "HAMACHER", "hamacher_product"),
    "nilpotent_minimum": Norm(nilpotent_minimum, "NilpotentMinimum", "NIPMIN", "nilpotent_minimum"),
}
"""Those for *and* and for implication, by name."""

S_NORMS: dict[str, Norm] = {
    "max": Norm(greatest, "Maximum", "MAX", "max"),
    "probor": Norm(probabilistic_sum, "AlgebraicSum", "ASUM", "probor"),
    "bounded_sum": Norm(bounded_sum, "BoundedSum", "BSUM", "bounded_sum"),
    "drastic_sum": Norm(drastic_sum, "DrasticSum", "DMAX", "drastic_sum"),
    "einstein_sum": Norm(einstein_sum, "EinsteinSum", "EINSTEIN", "einstein_sum"),
    "hamacher_sum": Norm(hamacher_sum, "HamacherSum", "HSUM", "hamacher_sum"),
    "nilpotent_maximum": Norm(nilpotent_maximum, "NilpotentMaximum", "NIPMAX", "nilpotent_maximum"),
    "normalized_sum": Norm(normalized_sum, "NormalizedSum", "NSUM", "normalized_sum"),
}
"""Those for *or* and for aggregation, by name."""

AGGREGATIONS: dict[str, Norm] = {**S_NORMS, "sum": Norm(unbounded_sum, "UnboundedSum", "SUM", "sum")}
"""Those that join the terms of an output: of these a plain sum may exceed 1."""


@dataclass(frozen=True, slots=True)
class Hedge(Operator):
    """A word that bends a degree: *very* cold."""

    fll: bool = True  # True if fuzzylite has the hedge


HEDGES: dict[str, Hedge] = {
    "very": Hedge(very),
    "somewhat": Hedge(somewhat),
    "extremely": Hedge(extremely),
    "seldom": Hedge(seldom),
    "cubed": Hedge(cubed, fll=False),  # Octave's *extremely*
    "cube_root": Hedge(cube_root, fll=False),
}
"""Hedges by their word; *not* and *any* are propositions of their own."""
