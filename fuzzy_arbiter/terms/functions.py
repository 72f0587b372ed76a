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


def _log(a: float) -> float:
    return -math.inf if a == 0.0 else math.log(a)


def _power(a: float, b: float) -> float:
    return math.inf if a == 0.0 and b < 0.0 else math.pow(a, b)


FUNCTIONS: dict[str, Function] = {
    "abs": Function(1, abs, np.abs),
    "acos": Function(1, _guarded(math.acos), np.arccos),
    "asin": Function(1, _guarded(math.asin), np.arcsin),
    "atan": Function(1, math.atan, np.arctan),
    "atan2": Function(2, math.atan2, np.arctan2),
    "ceil": Function(1, _guarded(math.ceil), np.ceil),
    "cos": Function(1, _guarded(math.cos), np.cos),
    "cosh": Function(1, _guarded(math.cosh), np.cosh),
    "eq": _compared(operator.eq),
    "exp": Function(1, _guarded(math.exp), np.exp),
    "floor": Function(1, _guarded(math.floor), np.floor),
    "fmod": Function(2, _guarded(math.fmod), np.fmod),
    "ge": _compared(operator.ge),
    "gt": _compared(operator.gt),
    "le": _compared(operator.le),
    "log": Function(1, _guarded(_log), np.log),
    "log10": Function(1, _guarded(lambda a: -math.inf if a == 0.0 else math.log10(a)), np.log10),
    "log1p": Function(1, _guarded(lambda a: -math.inf if a == -1.0 else math.log1p(a)), np.log1p),
    "lt": _compared(operator.lt),
    "max": Function(2, max, np.maximum),
    "min": Function(2, min, np.minimum),
    "neq": _compared(operator.ne),
    "pow": Function(2, _guarded(_power), np.power),
    "round": Function(1, _guarded(round), np.round),
    "sin": Function(1, _guarded(math.sin), np.sin),
    "sinh": Function(1, _guarded(math.sinh), np.sinh),
    "sqrt": Function(1, _guarded(math.sqrt), np.sqrt),
    "tan": Function(1, _guarded(math.tan), np.tan),
    "tanh": Function(1, math.tanh, np.tanh),
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
