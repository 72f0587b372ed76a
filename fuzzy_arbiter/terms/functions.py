"""Functions and operators of expressions by IEEE 754: on numbers, where Python raises, on arrays, and as text."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Function(NamedTuple):
    """A function that an expression may call."""

    arguments: int
    number: Callable[..., float]
    array: Callable[..., Any]
    formula: str  # Python expression of ``a`` and ``b``, which exported code has, too


def arguments_of(formula: str) -> str:
    """Return the arguments of a formula: ``a, b``, or ``a`` alone."""
    return "a, b" if re.search(r"\bb\b", formula) else "a"


def compute(formula: str) -> Callable[..., float]:
    """Return the function that a formula of this package's tables defines."""
    function: Callable[..., float] = eval(f"lambda {arguments_of(formula)}: {formula}", {"math": math})  # noqa: S307
    return function


def _function(formula: str, array: Callable[..., Any]) -> Function:
    unguarded = compute(formula)

    def number(*values: float) -> float:
        try:
            return unguarded(*values)
        except OverflowError:
            return math.inf

    return Function(len(arguments_of(formula).split()), number, array, formula)


_COMPARED = {
    "eq": ("==", np.equal), "ge": (">=", np.greater_equal), "gt": (">", np.greater), "le": ("<=", np.less_equal),
    "lt": ("<", np.less), "neq": ("!=", np.not_equal),
}  # fmt: skip
FUNCTIONS: dict[str, Function] = {
    **{
        name: _function(f"1.0 if a {sign} b else 0.0", lambda a, b, compare=compare: compare(a, b) * 1.0)
        for name, (sign, compare) in _COMPARED.items()
    },
    **{
        name: _function(f"math.{name}(a) if abs(a) < math.inf else math.nan", getattr(np, name))
        for name in ("cos", "sin", "tan")
    },
    **{
        name: _function(f"float({function}(a)) if abs(a) < 2.0**52 else a", getattr(np, name))
        for name, function in (("ceil", "math.ceil"), ("floor", "math.floor"), ("round", "round"))
    },
    **{
        name: _function(f"math.{name}(a) if a > {pole} else -math.inf if a == {pole} else math.nan", getattr(np, name))
        for name, pole in (("log", 0.0), ("log10", 0.0), ("log1p", -1.0))
    },
    "abs": _function("abs(a)", np.abs),
    "acos": _function("math.acos(a) if abs(a) <= 1.0 else math.nan", np.arccos),
    "asin": _function("math.asin(a) if abs(a) <= 1.0 else math.nan", np.arcsin),
    "atan": _function("math.atan(a)", np.arctan),
    "atan2": _function("math.atan2(a, b)", np.arctan2),
    "cosh": _function("math.cosh(a) if abs(a) < 710.475860073944 else abs(a) * math.inf", np.cosh),
    "exp": _function("math.inf if a > 709.782712893384 else math.exp(a)", np.exp),
    "fmod": _function("math.copysign(abs(a) % abs(b), a) if b != 0.0 and abs(a) < math.inf else math.nan", np.fmod),
    "max": _function("a if a > b else b if a <= b else a + b", np.maximum),
    "min": _function("a if a < b else b if a >= b else a + b", np.minimum),
    "pow": _function(
        "math.copysign(math.inf, a if b % 2.0 == 1.0 else 1.0) if a == 0.0 and b < 0.0 else"
        " math.nan if -math.inf < a < 0.0 and b % 1.0 > 0.0 else"
        " math.pow(a, b) if a == 0.0 or not b * math.log(abs(a)) > 709.78 else"
        " math.copysign(math.inf, a if b % 2.0 == 1.0 else 1.0) if b * math.log(abs(a)) > 710.0 else"
        " math.copysign(math.pow(abs(a), b / 2.0), a if b % 2.0 == 1.0 else 1.0) * math.pow(abs(a), b / 2.0)",
        np.power,
    ),
    "sinh": _function("math.sinh(a) if abs(a) < 710.475860073944 else a * math.inf", np.sinh),
    "sqrt": _function("math.sqrt(a) if a >= 0.0 else math.nan", np.sqrt),
    "tanh": _function("math.tanh(a)", np.tanh),
}
# words of other tools for the same functions
SAME = {"fabs": "abs", "ln": "log"}
OPERATORS: dict[str, Function] = {
    "+": Function(2, lambda a, b: a + b, np.add, "a + b"),
    "-": Function(2, lambda a, b: a - b, np.subtract, "a - b"),
    "*": Function(2, lambda a, b: a * b, np.multiply, "a * b"),
    "/": _function(
        "a / b if b != 0.0 else math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)",
        np.divide,
    ),
    "%": FUNCTIONS["fmod"],
    "^": FUNCTIONS["pow"],
    "~": Function(1, lambda a: -a, np.negative, "-a"),  # unary minus
}
ALL = {**FUNCTIONS, **OPERATORS}
WORDS = frozenset((*FUNCTIONS, *SAME, "pi"))
"""Names that an expression keeps for itself."""
