"""Statements of exported code, and its expressions, which C and Python share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class Assign:
    """Assign an expression to a name; `words` is its comment."""

    name: str
    expression: str
    words: str = ""


@dataclass(frozen=True, slots=True)
class Choose:
    """Run the first branch whose condition holds; an empty condition always holds."""

    branches: tuple[tuple[str, tuple[Statement, ...]], ...]


@dataclass(frozen=True, slots=True)
class Sweep:
    """Assign the value of the k-th output, whose terms are cut at these numbers."""

    name: str
    k: int
    cuts: tuple[str, ...]
    method: str  # ``clipped`` or ``scaled``, whose centroid is exact; else a defuzzifier in `FUNCTIONS`


@dataclass(frozen=True, slots=True)
class Return:
    """Return a status, or an expression."""

    status: int | str


Statement = Assign | Choose | Sweep | Return
# function of heights that computes each defuzzifier, and its last argument
FUNCTIONS = {
    **{name: ("center_of_area", halves) for name, halves in (("centroid", 0), ("bisector", 1))},
    **{name: ("position_of_maximum", side) for name, side in (("som", -1), ("mom", 0), ("lom", 1))},
}


def format_statements(
    statements: Iterable[Statement],
    simple: Callable[[Statement], Iterable[str]],
    branch: Callable[[int, str], str],
    end: str,
    indent: str = "    ",
) -> Iterator[str]:
    """Format statements: `simple` one without branches, `branch` the head of the i-th branch, `end` those of all."""
    for statement in statements:
        if isinstance(statement, Choose):
            for i, (condition, inner) in enumerate(statement.branches):
                yield indent + branch(i, condition)
                yield from format_statements(inner, simple, branch, end, indent + "    ")
            if end:
                yield indent + end
        else:
            yield from (indent + line for line in simple(statement))


def expressions(statements: Sequence[Statement]) -> Iterator[str]:
    """Yield all expressions."""
    for statement in statements:
        if isinstance(statement, Assign):
            yield statement.expression
        elif isinstance(statement, Choose):
            for condition, inner in statement.branches:
                yield condition
                yield from expressions(inner)


class Expressions:
    """Format operators on degrees; a deep expression is assigned to a name before the statement that uses it."""

    def __init__(self) -> None:
        self._names = 0
        self._waiting: list[Statement] = []

    def apply(self, template: str, *degrees: str) -> str:
        """Return the expression of an operator's value."""
        text = template.format(*degrees)
        depth = max(accumulate((sign == "(") - (sign == ")") for sign in text))
        if depth <= _MAX_DEPTH:
            return text
        self._names += 1
        self._waiting.append(Assign(f"t{self._names}", text))
        return f"t{self._names}"

    def join(self, kind: str, degrees: Iterable[str]) -> str:
        """Return the expression that joins several degrees, from left to right."""
        return reduce(partial(self.apply, JOINS[kind]), degrees)

    def assign(self, name: str, expression: str, words: str) -> Iterator[Statement]:
        """Assign a value to a name, after the assignments that it needs."""
        yield from self._waiting
        self._waiting.clear()
        yield Assign(name, expression, words)


def assign_first(name: str, values: Sequence[tuple[str, str]], words: str) -> Iterator[Statement]:
    """Give a name to the first value of which the condition holds."""
    if len(values) == 1:
        yield Assign(name, values[0][1], words)
    else:
        yield Assign(name, "0.0", words)
        yield _first(name, values)


def _first(name: str, values: Sequence[tuple[str, str]]) -> Choose:
    """Give a name to the first value of which the condition holds, by halves where there are many."""
    if len(values) <= _MAX_BRANCHES:
        return Choose(tuple((condition, (Assign(name, value),)) for condition, value in values))
    half = next(i for i in range(len(values) // 2, len(values)) if " < " in values[i][0])  # rises from one to the next
    condition, value = values[half]
    below, above = (*values[:half], ("", value)), values[half + 1 :]
    return Choose(((condition, (_first(name, below),)), ("", (_first(name, above),))))


def degree_of(x: str, shape: Membership, universe: tuple[float, float]) -> list[tuple[str, str]]:
    """Format a membership function in its universe with the operations of the shape itself."""
    if isinstance(shape, Curve):
        pieces: list[tuple[str, str]] = []
        for end, tree in zip(shape.ends, shape.trees, strict=True):
            condition = "" if end == math.inf else f"{x} < {end!r}"
            pieces.append((condition, f"least(greatest({code(tree, {'x': x})}, 0.0), 1.0)"))
            if end < math.inf:  # at a jump it has the greater degree
                pieces.append((f"{x} == {end!r}", repr(shape(end))))
        return pieces
    if isinstance(shape, Formula):
        return [("", f"least(greatest({code(shape.expression(['x']).tree, {'x': x})}, 0.0), 1.0)")]
    assert isinstance(shape, Shape)
    if shape == DEGREE and universe == (0.0, 1.0):
        return [("", x)]
    knots: list[tuple[float, float, float]] = []  # position, degree left and right of it
    for x0, degree in shape.points:
        if knots and knots[-1][0] == x0:
            knots[-1] = (x0, knots[-1][1], degree)
        else:
            knots.append((x0, degree, degree))
    x0, left, right = knots[0]
    if len(knots) == 1 and left == right:
        return [("", repr(left))]
    values = [(f"{x} < {x0!r}", repr(left)), (f"{x} == {x0!r}", repr(max(left, right)))]
    if left >= right:
        values = [(f"{x} <= {x0!r}", repr(left))]
    for (a, _, start), (x0, left, right) in zip(knots, knots[1:], strict=False):
        values.append((f"{x} < {x0!r}", _line(x, a, start, x0 - a, left - start)))
        values.append((f"{x} == {x0!r}", repr(max(left, right))))
    if values[-1][1] == repr(right):
        del values[-1]
    return [*values, ("", repr(right))]


def _line(x: str, a: float, start: float, run: float, rise: float) -> str:
    """Format start + rise * ((x - a) / run), without operations that change no bit."""
    fraction = (x if a == 0.0 else f"({x} - {a!r})") + ("" if run == 1.0 else f" / {run!r}")
    if rise == 0.0:
        return repr(start)
    climb = fraction if rise == 1.0 else f"{rise!r} * ({fraction})" if " " in fraction else f"{rise!r} * {fraction}"
    return climb if start == 0.0 else f"{start!r} + {climb}"
