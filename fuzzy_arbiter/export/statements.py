"""Statements of exported code: lines of C without declarations, whose expressions are valid in Python, too."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from functools import partial, reduce
from itertools import accumulate

from fuzzy_arbiter.shapes import DEGREE, Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.expressions import code
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS
from fuzzy_arbiter.terms.values import Formula

JOINS = {name: f"{norm.function}({{}}, {{}})" for name, norm in {**T_NORMS, **AGGREGATIONS}.items()}
JOINS |= {"prod": "({} * {})", "sum": "({} + {})"}
_MAX_DEPTH = 20  # maximum number of nested parentheses; parsers accept some hundred
_MAX_BRANCHES = 16  # maximum number of branches of one choice; parsers accept some hundred

Cases = Sequence[tuple[str, str]]  # conditions, of which the last may be empty, and the value where each is the first


def assign(name: str, expression: str, words: str = "") -> str:
    """Format an assignment, and its comment."""
    return f"{name} = {expression};" + (f" /* {safe(words)} */" if words else "")


def safe(words: str) -> str:
    """Return words that neither begin nor end a comment, nor make a trigraph."""
    return re.sub(r"\*(?=/)|/(?=\*)|\?(?=\?)", r"\g<0> ", words)


def choose(*branches: tuple[str, Iterable[str]]) -> Iterator[str]:
    """Format branches, of which the first runs whose condition holds; an empty condition always holds."""
    for i, (condition, lines) in enumerate(branches):
        yield f"{'} else ' if i else ''}{f'if ({condition}) ' if condition else ''}{{"
        yield from (f"    {line}" for line in lines)
    yield "}"


def assign_first(name: str, cases: Cases, words: str = "") -> Iterator[str]:
    """Assign the value of the first case whose condition holds."""
    if len(cases) == 1:
        yield assign(name, cases[0][1], words)
    else:
        yield assign(name, "0.0", words)
        yield from _halved(name, cases)


def _halved(name: str, cases: Cases) -> Iterator[str]:
    """Choose among cases, by halves where there are many."""
    if len(cases) <= _MAX_BRANCHES:
        return choose(*((condition, [assign(name, value)]) for condition, value in cases))
    half = next(i for i in range(len(cases) // 2, len(cases)) if " < " in cases[i][0])  # rises from one to the next
    condition, value = cases[half]
    return choose((condition, _halved(name, (*cases[:half], ("", value)))), ("", _halved(name, cases[half + 1 :])))


class Expressions:
    """Format operators on degrees; a deep expression is assigned to a name before the statement that uses it."""

    def __init__(self) -> None:
        self._names = 0
        self._waiting: list[str] = []

    def apply(self, template: str, *degrees: str) -> str:
        """Return the expression of an operator's value."""
        text = template.format(*degrees)
        depth = max(accumulate((sign == "(") - (sign == ")") for sign in text))
        if depth <= _MAX_DEPTH:
            return text
        self._names += 1
        self._waiting.append(assign(f"t{self._names}", text))
        return f"t{self._names}"

    def join(self, kind: str, degrees: Iterable[str]) -> str:
        """Return the expression that joins several degrees, from left to right."""
        return reduce(partial(self.apply, JOINS[kind]), degrees)

    def assign(self, name: str, expression: str, words: str = "") -> Iterator[str]:
        """Assign a value to a name, after the assignments that it needs."""
        yield from self._waiting
        self._waiting.clear()
        yield assign(name, expression, words)


def degree_of(x: str, shape: Membership, universe: tuple[float, float]) -> Cases:
    """Format a membership function in its universe with the operations of the shape itself."""
    if isinstance(shape, Formula):
        return [("", _held(code(shape.expression(["x"]).tree, {"x": x})))]
    cases: list[tuple[str, str]] = []
    if isinstance(shape, Curve):
        for end, tree in zip(shape.ends, shape.trees, strict=True):
            cases.append(("" if end == math.inf else f"{x} < {end!r}", _held(code(tree, {"x": x}))))
            if end < math.inf:  # at a jump it has the greater degree
                cases.append((f"{x} == {end!r}", repr(shape(end))))
        return cases
    assert isinstance(shape, Shape)
    if shape == DEGREE and universe == (0.0, 1.0):
        return [("", x)]
    last = repr(shape.points[-1][1])
    for (a, start), (b, end) in zip((shape.points[0], *shape.points), shape.points, strict=False):
        if not cases:
            cases.append((f"{x} < {b!r}", repr(end)))
        elif a == b:  # a jump
            cases.pop()
        else:
            cases.append((f"{x} < {b!r}", _line(x, a, start, b - a, end - start)))
        cases.append((f"{x} == {b!r}", repr(max(start, end) if a == b else end)))
    if cases[0][1] == cases[1][1]:
        cases[:2] = [(f"{x} <= {shape.points[0][0]!r}", cases[0][1])]
    return [*(cases[:-1] if cases[-1][1] == last else cases), ("", last)]


def _held(expression: str) -> str:
    return f"least(greatest({expression}, 0.0), 1.0)"


def _line(x: str, a: float, start: float, run: float, rise: float) -> str:
    """Format start + rise * ((x - a) / run), without operations that change no bit."""
    fraction = (x if a == 0.0 else f"({x} - {a!r})") + ("" if run == 1.0 else f" / {run!r}")
    if rise == 0.0:
        return repr(start)
    climb = fraction if rise == 1.0 else f"{rise!r} * ({fraction})" if " " in fraction else f"{rise!r} * {fraction}"
    return climb if start == 0.0 else f"{start!r} + {climb}"
