"""Functions that exported code calls: norms, hedges and functions of expressions, in Python and in C."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable

from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.terms import norms

# each by IEEE 754, where Python raises
_PYTHON = {
    "least": '"""Return the lesser of two numbers."""|return a if a < b else b',
    "greatest": '"""Return the greater of two numbers."""|return a if a > b else b',
    "either": '"""Return the probabilistic sum of two degrees."""|return a + b - a * b',
    "quotient": '"""Return a / b."""|if b != 0.0:|    return a / b|if a == 0.0 or a != a:|    return math.nan|'
    "return math.copysign(math.inf, a) * math.copysign(1.0, b)",
    "power": '"""Return a to the power of b."""|if a == 0.0 and b < 0.0:|    return math.inf|'
    "if a < 0.0 and b != math.floor(b):|    return math.nan|return math.pow(a, b)",
    "fmod": '"""Return the rest of a / b."""|if b == 0.0 or not abs(a) < math.inf:|    return math.nan|'
    "return math.copysign(abs(a) % abs(b), a)",
}
_PYTHON_OF_ONE = {
    "exp": "return math.exp(a) if a < 709.78 else math.inf",
    "log": "return math.log(a) if a > 0.0 else -math.inf if a == 0.0 else math.nan",
    "log10": "return math.log10(a) if a > 0.0 else -math.inf if a == 0.0 else math.nan",
    "sqrt": "return math.sqrt(a) if a >= 0.0 else math.nan",
    "sin": "return math.sin(a) if abs(a) < math.inf else math.nan",
    "cos": "return math.cos(a) if abs(a) < math.inf else math.nan",
    "tan": "return math.tan(a) if abs(a) < math.inf else math.nan",
    "atan": "return math.atan(a)",
    "tanh": "return math.tanh(a)",
    "fabs": "return abs(a)",
}
_COMPARED = {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "neq": "!="}
_C_NORMS = {
    "least": "a < b ? a : b",
    "greatest": "a > b ? a : b",
    "either": "a + b - a * b",
    "quotient": "a / b",
    "power": "pow(a, b)",
    "bounded_difference": "a + b > 1.0 ? a + b - 1.0 : 0.0",
    "drastic_product": "a == 1.0 ? b : b == 1.0 ? a : 0.0",
    "einstein_product": "a * b / (1.0 + (1.0 - a) * (1.0 - b))",
    "hamacher_product": "a > 1e-308 && b > 1e-308 ? 1.0 / (1.0 / a + 1.0 / b - 1.0) : 0.0",
    "nilpotent_minimum": "a + b <= 1.0 ? 0.0 : a < b ? a : b",
    "bounded_sum": "a + b < 1.0 ? a + b : 1.0",
    "drastic_sum": "a == 0.0 ? b : b == 0.0 ? a : 1.0",
    "einstein_sum": "(a + b) / (1.0 + a * b)",
    "hamacher_sum": "a + b <= 1.0 ? (a * (1.0 - b) + b * (1.0 - a)) / (1.0 - a * b)"
    " : 1.0 - hamacher_product(1.0 - a, 1.0 - b)",
    "nilpotent_maximum": "a + b >= 1.0 ? 1.0 : a > b ? a : b",
    "normalized_sum": "(a + b) / (a + b > 1.0 ? a + b : 1.0)",
}
_C_HEDGES = {
    "very": "a * a",
    "somewhat": "sqrt(a)",
    "extremely": "a <= 0.5 ? 2.0 * a * a : 1.0 - 2.0 * (1.0 - a) * (1.0 - a)",
    "seldom": "a <= 0.5 ? sqrt(0.5 * a) : 1.0 - sqrt(0.5 * (1.0 - a))",
    "cubed": "a * a * a",
    "cube_root": "pow(a, 1.0 / 3.0)",
}
# functions of C's math.h
_C_MATH = frozenset((*_PYTHON_OF_ONE, "fmod"))
_CALL = re.compile(r"\b([a-z_][a-z_0-9]*)\(")


def called(texts: Iterable[str]) -> list[str]:
    """Return the functions that some expressions call."""
    found = {name for text in texts for name in _CALL.findall(text) if name not in ("or", "and", "not")}
    found |= {name for norm in found & _C_NORMS.keys() for name in _CALL.findall(_C_NORMS[norm]) if name in _C_NORMS}
    names = sorted(found)  # a norm calls those before it
    for name in names:
        if name not in (*_C_NORMS, *_C_HEDGES, *_COMPARED, *_C_MATH):
            raise UnsupportedError(f"export: the function {name!r} of a formula is not exported")
    return names


def in_python(name: str) -> str:
    """Return a function as a definition in Python."""
    if name in _PYTHON:
        return f"def {name}(a, b):\n    " + _PYTHON[name].replace("|", "\n    ")
    if name in _PYTHON_OF_ONE:
        return f'def {name}(a):\n    """Return {name} of a number."""\n    {_PYTHON_OF_ONE[name]}'
    if name in _COMPARED:
        said = f"a {_COMPARED[name]} b"
        return f'def {name}(a, b):\n    """Return 1 if {said}, else 0."""\n    return 1.0 if {said} else 0.0'
    source = inspect.getsource(getattr(norms, name)).rstrip()
    return re.sub(r"(?<=[ab]): float|( -> float)(?=:)", "", source)


def in_c(name: str) -> str:
    """Return a function as a definition in C."""
    if name in _C_NORMS:
        return f"static inline double {name}(double a, double b) {{ return {_C_NORMS[name]}; }}"
    if name in _C_HEDGES:
        return f"static inline double {name}(double a) {{ return {_C_HEDGES[name]}; }}"
    if name in _COMPARED:
        return f"static inline double {name}(double a, double b) {{ return a {_COMPARED[name]} b; }}"
    return ""
