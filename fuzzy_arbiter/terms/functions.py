"""Functions and operators of expressions by IEEE 754: on numbers, where Python raises, and on arrays."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np


class Function(NamedTuple):
    """A function that an expression may call."""

    arguments: int
    number: Callable[..., float]
    array: Callable[..., Any]


def _guarded(function: Callable[..., float]) -> Callable[..., float]:
    """Return a function with the results of IEEE 754 and NumPy, where Python's own raises."""

    def value(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except (ValueError, ZeroDivisionError):
            return math.nan

    return value


def _divided(a: float, b: float) -> float:
    if b:
        return a / b
    return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _compared(holds: Callable[[Any, Any], Any]) -> Function:
    return Function(2, lambda a, b: float(holds(a, b)), lambda a, b: np.asarray(holds(a, b), dtype=np.float64))


def _with_pole(name: str, pole: float) -> Function:
    function = getattr(math, name)
    return Function(1, _guarded(lambda a: -math.inf if a == pole else function(a)), getattr(np, name))


def _power(a: float, b: float) -> float:
    return math.inf if a == 0.0 and b < 0.0 else math.pow(a, b)


FUNCTIONS: dict[str, Function] = {
    **{
        name: Function(1, _guarded(getattr(math, name)), getattr(np, name))
        for name in ("ceil", "cos", "cosh", "exp", "floor", "sin", "sinh", "sqrt", "tan", "tanh")
    },
    **{
        name: Function(1, _guarded(getattr(math, name)), getattr(np, f"arc{name[1:]}"))
        for name in ("acos", "asin", "atan")
    },
    **{name: _with_pole(name, pole) for name, pole in (("log", 0.0), ("log10", 0.0), ("log1p", -1.0))},
    **{name: _compared(getattr(operator, name)) for name in ("eq", "ge", "gt", "le", "lt")},
    "neq": _compared(operator.ne),
    "abs": Function(1, abs, np.abs),
    "atan2": Function(2, math.atan2, np.arctan2),
    "fmod": Function(2, _guarded(math.fmod), np.fmod),
    "max": Function(2, max, np.maximum),
    "min": Function(2, min, np.minimum),
    "pow": Function(2, _guarded(_power), np.power),
    "round": Function(1, _guarded(round), np.round),
}
# words of other tools for the same functions
SAME = {"fabs": "abs", "ln": "log"}
OPERATORS: dict[str, Function] = {
    "+": Function(2, lambda a, b: a + b, np.add),
    "-": Function(2, lambda a, b: a - b, np.subtract),
    "*": Function(2, lambda a, b: a * b, np.multiply),
    "/": Function(2, _divided, np.divide),
    "%": FUNCTIONS["fmod"],
    "^": FUNCTIONS["pow"],
    "~": Function(1, lambda a: -a, np.negative),  # unary minus
}
ALL = {**FUNCTIONS, **OPERATORS}
WORDS = frozenset((*FUNCTIONS, *SAME, "pi"))
"""Names that an expression keeps for itself."""
