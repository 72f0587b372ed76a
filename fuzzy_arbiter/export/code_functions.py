"""Functions that exported code calls: norms, hedges and functions of expressions, in Python and in C."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

from fuzzy_arbiter.terms.expressions import EXPORTED
from fuzzy_arbiter.terms.functions import FUNCTIONS, OPERATORS, arguments_of
from fuzzy_arbiter.terms.norms import AGGREGATIONS, HEDGES, T_NORMS

_NORMS = {one.function: one.formula for one in (*T_NORMS.values(), *AGGREGATIONS.values(), *HEDGES.values())}
_EXPRESSIONS = {
    EXPORTED.get(name, name): function.formula for name, function in {**FUNCTIONS, "/": OPERATORS["/"]}.items()
}
_FORMULAS = {**_EXPRESSIONS, **_NORMS}
# bodies in C that differ from those in Python, and which need no conditions
_C = {"quotient": "a / b", "power": "pow(a, b)"}
_CALL = re.compile(r"\b([a-z_][a-z_0-9]*)\(")


def called(texts: Iterable[str]) -> list[str]:
    """Return the functions that some expressions call."""
    return sorted({name for text in texts for name in _CALL.findall(text) if name in _FORMULAS})


def in_python(name: str) -> str:
    """Return a function as a definition in Python."""
    lines = [f"def {name}({arguments_of(_FORMULAS[name])}):"]
    node = ast.parse(_FORMULAS[name], mode="eval").body
    while isinstance(node, ast.IfExp):
        lines += [f"    if {ast.unparse(node.test)}:", f"        return {ast.unparse(node.body)}"]
        node = node.orelse
    return "\n".join([*lines, f"    return {ast.unparse(node)}"])


def in_c(name: str) -> str:
    """Return a function as a definition in C; empty for one of ``math.h``."""
    formula = _FORMULAS[name]
    if ("math." in formula and name not in (*_C, *_NORMS)) or name in ("fabs", "rint"):
        return ""
    body = _C.get(name) or _in_c(ast.parse(formula, mode="eval").body).replace("math.", "")
    arguments = ", ".join(f"double {x}" for x in arguments_of(formula).split(", "))
    return f"static inline double {name}({arguments}) {{ return {body}; }}"


def _in_c(node: ast.expr) -> str:
    """Format an expression of conditions, sums and products in C."""
    match node:
        case ast.IfExp(test, body, orelse):
            return f"{_in_c(test)} ? {_in_c(body)} : {_in_c(orelse)}"
        case ast.BoolOp(ast.And(), parts):
            return " && ".join(map(_in_c, parts))
    return ast.unparse(_Conditions().visit(node))


class _Conditions(ast.NodeTransformer):
    """Replaces the conditions within an expression by their text in C."""

    def visit_IfExp(self, node: ast.IfExp) -> ast.Name:
        return ast.Name(f"({_in_c(node)})")
