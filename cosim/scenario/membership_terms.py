"""Membership functions of criteria: piecewise linear ones, curves and formulas."""

from __future__ import annotations

import functools
import json
import re
from typing import Any

from cosim.errors import ScenarioError
from fuzzy_arbiter import ArbiterError, Shape
from fuzzy_arbiter.formats import reads
from fuzzy_arbiter.shapes import Membership
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.parser import Node
from fuzzy_arbiter.terms.values import Formula

_REACH = 1000.0  # m, rad or s: bound of the arguments for which a formula must give degrees
MAX_STACK = 32  # stack depth of a formula
FUNCTIONS = (
    *("+", "-", "*", "/", "^", "pow", "~", "abs", "sqrt", "exp", "log", "cos", "sin", "tan"),
    *("min", "max", "lt", "le", "gt", "ge", "eq", "neq"),
)
"""Functions in curves and formulas, named as in `fuzzy_arbiter`'s expressions; ``~`` is the unary minus."""


def read_term(data: Any, of_time: bool, where: str) -> Membership:
    """Parse a term as in the files of `fuzzy_arbiter`."""
    return _read(json.dumps(data, default=str), of_time, where)


@functools.lru_cache(maxsize=64)
def _read(value: str, of_time: bool, where: str) -> Membership:
    curved = _is_curve(json.loads(value))
    low = 0.0 if of_time else -_REACH
    if curved:
        text = f"""{{"inputs": [{{"name": "x", "universe": [{low}, {_REACH}], "terms": {{"t": {value}}}}}],
            "outputs": [{{"name": "y", "universe": [0, 1], "terms": {{"t": [[0, 0], [1, 1]]}}}}],
            "rules": ["if x is t then y is t"]}}"""
        prefix = r"^inputs\[0\](?:\.terms\.t|: variable 'x': term 't'(?:: term 't')?)"
    else:
        text = f'{{"criteria": [{{"name": "x", "on": "pressing", "off": "satisfied", "membership": {value}}}]}}'
        prefix = r"^criteria\[0\](?:\.membership)?(?:: criterion 'x')?"
    try:
        term = reads(text, "json").inputs[0].terms[-1].shape
    except ArbiterError as error:
        message = re.sub(prefix, where, str(error))
        raise ScenarioError(message if message.startswith(where) else f"{where}: {message}") from error
    assert isinstance(term, Membership)
    if isinstance(term, Curve) and term.jumps:
        raise ScenarioError(f"{where}: {term.kind} {list(term.parameters)} jumps, expected a change without jumps")
    for _, tree in pieces_of(term):
        unknown = next((word for word in _functions_in(tree) if word not in FUNCTIONS), None)
        if unknown is not None:
            known = ", ".join(word for word in FUNCTIONS if word.isalpha())
            raise ScenarioError(f"{where}: the function {unknown!r}, expected of {known}; arbiter.file takes any")
        if _stack_depth(tree) > MAX_STACK:
            raise ScenarioError(f"{where}: a formula nested so deep, expected at most {MAX_STACK} numbers that wait")
    return term


def _is_curve(data: Any) -> bool:
    return isinstance(data, dict) and any(key in KINDS or key == "formula" for key in data)


def pieces_of(term: Membership) -> list[tuple[float, Node]]:
    """Return the end and the expression in ``x`` of each piece of a curve or formula; an empty list for others."""
    if isinstance(term, Curve):
        return list(zip(term.ends, term.trees, strict=True))
    return [(float("inf"), term.expression(["x"]).tree)] if isinstance(term, Formula) else []


def _functions_in(tree: Node) -> list[str]:
    return [tree[0], *(word for part in tree[1:] for word in _functions_in(part))] if isinstance(tree, tuple) else []


def _stack_depth(tree: Node) -> int:
    return max(k + _stack_depth(part) for k, part in enumerate(tree[1:])) if isinstance(tree, tuple) else 1


def term_in_words(term: Membership, unit: str) -> str:
    """Describe a term in words."""
    if isinstance(term, Shape):
        return ", ".join(f"{degree:g} at {position:g} {unit}" for position, degree in term.points)
    if isinstance(term, Formula):
        return f"{term.text}, with x in {unit}"
    assert isinstance(term, Curve)
    named = zip(KINDS[term.kind].parameters, term.parameters, strict=True)
    height = "" if term.height == 1.0 else f", height {term.height:g}"
    return (
        f"{term.kind.replace('_', ' ')} of {', '.join(f'{name} {value:g}' for name, value in named)}{height}, in {unit}"
    )
