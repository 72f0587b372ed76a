"""Functions that exported code calls: norms, hedges and functions of expressions, in Python and in C."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.terms.norms import AGGREGATIONS, HEDGES, T_NORMS

# each by IEEE 754, where Python raises
_PYTHON = {
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
_C = {"quotient": "a / b", "power": "pow(a, b)"}
_OPERATORS = {one.function: one for one in (*T_NORMS.values(), *AGGREGATIONS.values(), *HEDGES.values())}
# functions of C's math.h
_C_MATH = frozenset((*_PYTHON_OF_ONE, "fmod"))
_CALL = re.compile(r"\b([a-z_][a-z_0-9]*)\(")


def called(texts: Iterable[str]) -> list[str]:
    """Return the functions that some expressions call."""
    names = {name for text in texts for name in _CALL.findall(text) if name not in ("or", "and", "not")}
    for name in names:
        if name not in (*_OPERATORS, *_PYTHON, *_COMPARED, *_C_MATH):
            raise UnsupportedError(f"export: the function {name!r} of a formula is not exported")
    return sorted(names)


def in_python(name: str) -> str:
    """Return a function as a definition in Python."""
    if name in _PYTHON:
        return f"def {name}(a, b):\n    " + _PYTHON[name].replace("|", "\n    ")
    if name in _PYTHON_OF_ONE:
        return f'def {name}(a):\n    """Return {name} of a number."""\n    {_PYTHON_OF_ONE[name]}'
    if name in _COMPARED:
        comparison = f"a {_COMPARED[name]} b"
        return (
            f'def {name}(a, b):\n    """Return 1 if {comparison}, else 0."""\n    return 1.0 if {comparison} else 0.0'
        )
    operator = _OPERATORS[name]
    return f'def {name}({operator.arguments}):\n    """Return {operator.formula}."""\n    return {operator.formula}'


def in_c(name: str) -> str:
    """Return a function as a definition in C; empty for one of ``math.h``."""
    operator = _OPERATORS.get(name)
    arguments = ", ".join(f"double {x}" for x in (operator.arguments if operator else "a, b").split(", "))
    body = _body_in_c(name) if name in _OPERATORS else f"a {_COMPARED[name]} b" if name in _COMPARED else _C.get(name)
    return f"static inline double {name}({arguments}) {{ return {body}; }}" if body else ""


def _body_in_c(name: str) -> str:
    return _expression_in_c(_OPERATORS[name].tree).replace("math.", "")


def _expression_in_c(node: ast.expr) -> str:
    """Format an expression of conditions, sums and products in C."""
    match node:
        case ast.IfExp(test, body, orelse):
            return " ".join((_expression_in_c(test), "?", _expression_in_c(body), ":", _expression_in_c(orelse)))
        case ast.BoolOp(ast.And(), parts):
            return " && ".join(map(_expression_in_c, parts))
    return ast.unparse(_Conditions().visit(node))


class _Conditions(ast.NodeTransformer):
    """Replaces the conditions within an expression by their text in C."""

    def visit_IfExp(self, node: ast.IfExp) -> ast.Name:
        return ast.Name(f"({_expression_in_c(node)})")
