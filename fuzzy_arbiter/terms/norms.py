"""Operators on degrees: norms that join two of them, and hedges that bend one; each from one formula."""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.functions import compute

_ARRAY_FUNCTIONS: dict[Any, Any] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide,
    ast.Lt: np.less, ast.LtE: np.less_equal, ast.Gt: np.greater, ast.GtE: np.greater_equal, ast.Eq: np.equal,
    "sqrt": np.sqrt, "pow": np.power,
}  # fmt: skip
# functions in exported code, where the words of the norms are functions of Python or of another meaning
_FUNCTION_NAMES = {"min": "least", "max": "greatest", "probor": "probabilistic_sum"}


@dataclass(frozen=True, slots=True)
class Operator:
    """An operator on degrees ``a`` and, for a norm, ``b``, with its words in files; empty where a format has none."""

    name: str  # which is also Octave's word for it, and MATLAB's where it has one
    formula: str  # Python expression, from which all else follows
    fll: str = ""
    fcl: str = ""
    number: Callable[..., float] = field(init=False, repr=False, compare=False)  # on numbers
    _arrays: Callable[[dict[str, Any]], Any] = field(init=False, repr=False, compare=False)
    _sides: tuple[tuple[Callable[[dict[str, Any]], Any], ...], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        tree = ast.parse(self.formula, mode="eval").body
        compared = [(n.left, n.comparators[0]) for n in ast.walk(tree) if isinstance(n, ast.Compare) and _bends(n)]
        object.__setattr__(self, "number", compute(self.formula))
        object.__setattr__(self, "_arrays", _vectorized(tree))
        object.__setattr__(self, "_sides", tuple(tuple(map(_vectorized, sides)) for sides in compared))

    @property
    def function(self) -> str:
        """Name of the function in exported code."""
        return _FUNCTION_NAMES.get(self.name, self.name)

    def array(self, *degrees: Any) -> Array:
        """Return the result for arrays, or an array and a number, of each as `number` gives it."""
        with np.errstate(all="ignore"):
            return np.asarray(self._arrays(dict(zip("ab", degrees, strict=False))))

    def sides(self, *degrees: Any) -> list[tuple[Any, Any]]:
        """Return both sides of each comparison in the formula, for arrays: where they are equal the result bends."""
        values = dict(zip("ab", degrees, strict=False))
        return [(left(values), right(values)) for left, right in self._sides]


def _bends(test: ast.Compare) -> bool:
    """Return True for a comparison of two degrees, which is no guard against a division by 0."""
    bound = test.comparators[0]
    return not isinstance(test.ops[0], ast.Eq) and not (isinstance(bound, ast.Constant) and bound.value == 1e-308)


def _vectorized(node: ast.expr) -> Callable[[dict[str, Any]], Any]:
    """Return a function that evaluates an expression on arrays by name, both branches of a condition."""
    function: Any
    match node:
        case ast.Constant(value):
            return lambda values: value
        case ast.Name(name):
            return lambda values: values[name]
        case ast.IfExp(ast.Compare(left, [ast.Lt() | ast.Gt() as sign], [right]), yes, no) if ast.dump(
            left
        ) == ast.dump(yes) and ast.dump(right) == ast.dump(no):
            function, parts = np.minimum if isinstance(sign, ast.Lt) else np.maximum, [yes, no]
        case ast.IfExp(test, yes, no):
            function, parts = np.where, [test, yes, no]
        case ast.BoolOp(ast.And(), parts):
            function = np.logical_and
        case ast.Call(ast.Attribute(_, name), parts):
            function = _ARRAY_FUNCTIONS[name]
        case ast.BinOp(left, sign, right) | ast.Compare(left, [sign], [right]):
            function, parts = _ARRAY_FUNCTIONS[type(sign)], [left, right]
        case _:
            raise NotImplementedError(ast.dump(node))
    inner = [_vectorized(part) for part in parts]
    return lambda values: function(*[part(values) for part in inner])


def _by_name(*operators: Operator) -> dict[str, Operator]:
    return {operator.name: operator for operator in operators}


T_NORMS = _by_name(
    Operator("min", "a if a < b else b", "Minimum", "MIN"),
    Operator("prod", "a * b", "AlgebraicProduct", "PROD"),
    Operator("bounded_difference", "a + b - 1.0 if a + b > 1.0 else 0.0", "BoundedDifference", "BDIF"),
    Operator("drastic_product", "b if a == 1.0 else a if b == 1.0 else 0.0", "DrasticProduct", "DMIN"),
    Operator("einstein_product", "a * b / (1.0 + (1.0 - a) * (1.0 - b))", "EinsteinProduct", "EPROD"),
    Operator(
        "hamacher_product",
        "1.0 / (1.0 / a + 1.0 / b - 1.0) if a > 1e-308 and b > 1e-308 else 0.0",
        "HamacherProduct",
        "HAMACHER",
    ),
    Operator("nilpotent_minimum", "0.0 if a + b <= 1.0 else a if a < b else b", "NilpotentMinimum", "NIPMIN"),
)
"""Those for *and* and for implication, by name."""

S_NORMS = _by_name(
    Operator("max", "a if a > b else b", "Maximum", "MAX"),
    Operator("probor", "a + b - a * b", "AlgebraicSum", "ASUM"),
    Operator("bounded_sum", "a + b if a + b < 1.0 else 1.0", "BoundedSum", "BSUM"),
    Operator("drastic_sum", "b if a == 0.0 else a if b == 0.0 else 1.0", "DrasticSum", "DMAX"),
    Operator("einstein_sum", "(a + b) / (1.0 + a * b)", "EinsteinSum", "EINSTEIN"),
    Operator(  # (a + b - 2 a b) / (1 - a b), near two ones as 1 less the product of what lacks
        "hamacher_sum",
        "(a * (1.0 - b) + b * (1.0 - a)) / (1.0 - a * b) if a + b <= 1.0 else"
        " 1.0 - 1.0 / (1.0 / (1.0 - a) + 1.0 / (1.0 - b) - 1.0) if 1.0 - a > 1e-308 and 1.0 - b > 1e-308 else 1.0",
        "HamacherSum",
        "HSUM",
    ),
    Operator("nilpotent_maximum", "1.0 if a + b >= 1.0 else a if a > b else b", "NilpotentMaximum", "NIPMAX"),
    Operator("normalized_sum", "(a + b) / (a + b if a + b > 1.0 else 1.0)", "NormalizedSum", "NSUM"),
)
"""Those for *or* and for aggregation, by name."""

AGGREGATIONS = {**S_NORMS, **_by_name(Operator("sum", "a + b", "UnboundedSum", "SUM"))}
"""Those that join the terms of an output: of these a plain sum may exceed 1."""

HEDGES = _by_name(
    Operator("very", "a * a", "very"),
    Operator("somewhat", "math.sqrt(a)", "somewhat"),
    Operator("extremely", "2.0 * a * a if a <= 0.5 else 1.0 - 2.0 * (1.0 - a) * (1.0 - a)", "extremely"),
    Operator("seldom", "math.sqrt(0.5 * a) if a <= 0.5 else 1.0 - math.sqrt(0.5 * (1.0 - a))", "seldom"),
    Operator("cubed", "a * a * a"),  # Octave's *extremely*
    Operator("cube_root", "math.pow(a, 1.0 / 3.0)"),
)
"""Hedges by their word; *not* and *any* are propositions of their own."""
