"""Exact partition of an input's universe by its terms: patterns of degrees, and gaps."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.definition import Variable
from fuzzy_arbiter.shapes import Shape

Ranks = NDArray[np.int32]  # there are up to twice as many levels as there are weights of rules
Limits = Callable[[Fraction], tuple[Fraction, Fraction]]  # degrees just before and just after a place
Kind = Literal["gap", "below", "above"]
ROUNDING = Fraction(1, 2**50)  # a sum of degrees that is nearer to 1 than this is 1: decimal degrees are rounded


@dataclass(frozen=True, slots=True)
class Domain:
    """The finite domain of an input: one place for each pattern of degrees that rules can distinguish."""

    variable: str  # name of the input
    terms: tuple[str, ...]  # names of its terms
    # one for each pattern: a place where it is found, or the term that is taken as a label
    positions: tuple[float | str, ...]
    ranks: Ranks  # (patterns, terms) Degrees as ranks, see `rank`


@dataclass(frozen=True, slots=True)
class Stretch:
    """A part of a universe where degrees do not sum to 1."""

    variable: str  # name of the input
    kind: Kind  # no term has a degree above 0; the sum is below 1 (gaps are part of that); the sum is above 1
    start: float  # ends of the stretch
    end: float  # ends of the stretch
    start_in: bool  # true if this end belongs to the stretch
    end_in: bool  # true if this end belongs to the stretch
    least: float  # bounds of the sum in it, reached or approached
    greatest: float  # bounds of the sum in it, reached or approached

    @property
    def place(self) -> str:
        """The stretch as an interval, or as the single place it is."""
        if self.start == self.end:
            return f"{self.start:g}"
        return f"{'[' if self.start_in else '('}{self.start:g}, {self.end:g}{']' if self.end_in else ')'}"


def rank(degree: Fraction, levels: Sequence[Fraction]) -> int:
    """Return the rank of a degree among levels."""
    # Minimum and maximum of degrees have the minimum and maximum of their ranks; if with each level one minus it is a
    # level too, then one minus a degree has the rank 2 L - r. So rules can be evaluated on ranks instead of degrees.
    i = bisect_left(levels, degree)
    return 2 * i + (i < len(levels) and levels[i] == degree)


def crisp(variable: Variable, levels: Sequence[Fraction]) -> Domain:
    """Return the domain of an input whose terms are labels: one holds fully, the others do not."""
    names = variable.term_names
    degrees = [[Fraction(a == b) for b in names] for a in reversed(names)]
    ranks = np.array([[rank(d, levels) for d in row] for row in degrees], dtype=np.int32)
    return Domain(variable.name, names, names[::-1], ranks)


def graded(variable: Variable, levels: Sequence[Fraction]) -> Domain:
    """Return the domain of an input that may be any real number in its universe."""
    terms = _exact(variable)
    knots = list(map(Fraction, variable.knots))
    crossings = {
        a + (level - left) * (b - a) / (right - left)
        for a, b in pairwise(knots)
        for left, right in ((limits(a)[1], limits(b)[0]) for limits in terms)
        for level in levels
        if (left - level) * (right - level) < 0
    }
    knots = sorted({*knots, *crossings})
    patterns: dict[tuple[int, ...], float] = {}
    for place in sorted([*knots, *((a + b) / 2 for a, b in pairwise(knots))]):
        patterns.setdefault(tuple(rank(max(limits(place)), levels) for limits in terms), float(place))
    ranks = np.array(list(patterns), dtype=np.int32)
    return Domain(variable.name, variable.term_names, tuple(patterns.values()), ranks)


def stretches(variable: Variable) -> tuple[Stretch, ...]:
    """Return the stretches of an input's universe on which the degrees do not sum to 1."""
    terms = _exact(variable)
    positions = list(map(Fraction, variable.knots))

    def part(place: Fraction) -> tuple[Fraction, Fraction, Fraction, Fraction]:
        total = _sum(max(limits(place)) for limits in terms)
        return place, place, total, total

    # positions and the open intervals between them by turns: start, end, and the sum at both ends
    parts = [part(positions[0])]
    for a, b in pairwise(positions):
        left, right = _sum(limits(a)[1] for limits in terms), _sum(limits(b)[0] for limits in terms)
        if (left - 1) * (right - 1) < 0:
            one = a + (1 - left) * (b - a) / (right - left)
            parts += [(a, one, left, Fraction(1)), (one, one, Fraction(1), Fraction(1)), (one, b, Fraction(1), right)]
        else:
            parts.append((a, b, left, right))
        parts.append(part(b))
    kinds: dict[Kind, Callable[[Fraction, Fraction], bool]] = {
        "gap": lambda left, right: left == right == 0,
        "below": lambda left, right: left + right < 2,
        "above": lambda left, right: left + right > 2,
    }
    return tuple(stretch for kind, of_kind in kinds.items() for stretch in _joined(variable.name, kind, parts, of_kind))


def _joined(
    name: str,
    kind: Kind,
    parts: Sequence[tuple[Fraction, Fraction, Fraction, Fraction]],
    of_kind: Callable[[Fraction, Fraction], bool],
) -> list[Stretch]:
    result, run = [], []
    for part in (*parts, None):
        if part is not None and of_kind(part[2], part[3]):
            run.append(part)
            continue
        if run:
            sums = [float(s) for _, _, *ends in run for s in ends]
            (a, a_end, *_), (b, b_end, *_) = run[0], run[-1]
            result.append(Stretch(name, kind, float(a), float(b_end), a == a_end, b == b_end, min(sums), max(sums)))
        run = []
    return result


def _sum(degrees: Iterable[Fraction]) -> Fraction:
    total = sum(degrees, Fraction(0))
    return Fraction(1) if abs(total - 1) <= ROUNDING else total


def _exact(variable: Variable) -> list[Limits]:
    """Return each term's exact degrees just before and just after a place, complements as one minus the other."""
    result: list[Limits] = []
    for i, term in enumerate(variable.terms):
        opposite = (j for j, earlier in enumerate(variable.terms[:i]) if _opposite(earlier.straight, term.straight))
        j = next(opposite, None)
        limits = _limits(term.straight) if j is None else _complement(result[j])
        result.append(limits)
    return result


def _complement(limits: Limits) -> Limits:
    return lambda place: (1 - limits(place)[0], 1 - limits(place)[1])


def _opposite(shape: Shape, other: Shape) -> bool:
    """Return True if shapes sum to 1 but for rounding, and exactly so where one is 0 or 1."""
    if shape.jumps or other.jumps or len(shape.points) != len(other.points):
        return False
    return (shape.complement() == other or other.complement() == shape) and all(
        {a, b} == {0.0, 1.0} or 0.0 < min(a, b) <= max(a, b) < 1.0
        for (_, a), (_, b) in zip(shape.points, other.points, strict=True)
    )


def _limits(shape: Shape) -> Limits:
    points = [(Fraction(x), Fraction(degree)) for x, degree in shape.points]
    positions = [x for x, _ in points]

    def degree(place: Fraction, i: int) -> Fraction:
        """Return the degree at a place by the line that ends at the i-th point."""
        if i in (0, len(points)):
            return points[min(i, len(points) - 1)][1]
        (a, left), (b, right) = points[i - 1], points[i]
        return left + (right - left) * (place - a) / (b - a)

    return lambda place: (degree(place, bisect_left(positions, place)), degree(place, bisect_right(positions, place)))
