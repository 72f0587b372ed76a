"""Exact partition of an input's universe by its terms: patterns of degrees, and gaps."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.definition import Variable
from fuzzy_arbiter.shapes import Shape

Ranks = NDArray[np.int32]  # there are up to twice as many levels as there are weights of rules
Kind = Literal["gap", "below", "above"]
ROUNDING = Fraction(1, 2**50)  # a sum of degrees that is nearer to 1 than this is 1: decimal degrees are rounded


@dataclass(frozen=True, slots=True)
class Domain:
    """The finite domain of an input: one place for each pattern of degrees that rules can distinguish."""

    variable: str  # name of the input
    terms: tuple[str, ...]  # names of its terms
    # one for each pattern: a place where it is found, or the term that is taken as a label
    places: tuple[float | str, ...]
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
    degrees = _exact(variable)
    knots = list(map(Fraction, variable.knots))
    crossings = {
        a + (level - left) * (b - a) / (right - left)
        for a, b in zip(knots, knots[1:], strict=False)
        for left, right in zip(_between(degrees, a, b, False), _between(degrees, a, b, True), strict=True)
        for level in levels
        if (left - level) * (right - level) < 0
    }
    knots = sorted({*knots, *crossings})
    middles = [(a + b) / 2 for a, b in zip(knots, knots[1:], strict=False)]
    patterns: dict[tuple[int, ...], float] = {}
    for place in sorted([*knots, *middles]):
        pattern = tuple(rank(max(of(place, False), of(place, True)), levels) for of in degrees)
        patterns.setdefault(pattern, float(place))
    return Domain(
        variable.name, variable.term_names, tuple(patterns.values()), np.array(list(patterns), dtype=np.int32)
    )


def stretches(variable: Variable) -> tuple[Stretch, ...]:
    """Return the stretches of an input's universe on which the degrees do not sum to 1."""
    degrees = _exact(variable)
    places = list(map(Fraction, variable.knots))

    def at(place: Fraction) -> Fraction:
        return _snapped(sum((max(of(place, False), of(place, True)) for of in degrees), Fraction(0)))

    # places and the open intervals between them by turns: start, end, and the sum at both ends
    parts = [(places[0], places[0], at(places[0]), at(places[0]))]
    for a, b in zip(places, places[1:], strict=False):
        left, right = (_snapped(sum(_between(degrees, a, b, end), Fraction(0))) for end in (False, True))
        if (left - 1) * (right - 1) < 0:
            one = a + (1 - left) * (b - a) / (right - left)
            parts += [(a, one, left, Fraction(1)), (one, one, Fraction(1), Fraction(1)), (one, b, Fraction(1), right)]
        else:
            parts.append((a, b, left, right))
        parts.append((b, b, at(b), at(b)))
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


def _snapped(total: Fraction) -> Fraction:
    return Fraction(1) if abs(total - 1) <= ROUNDING else total


Degree = Callable[[Fraction, bool], Fraction]


def _exact(variable: Variable) -> list[Degree]:
    """Return each term's exact degree just before or just after a place, complements as one minus the other."""
    result: list[Degree] = []
    for i, term in enumerate(variable.terms):
        of = _limit(term.straight)
        for j, earlier in enumerate(variable.terms[:i]):
            if _opposite(earlier.straight, term.straight):
                of = _complement(result[j])
                break
        result.append(of)
    return result


def _opposite(shape: Shape, other: Shape) -> bool:
    """Return True if shapes sum to 1 but for rounding, and exactly so where one is 0 or 1."""
    if shape.jumps or other.jumps or len(shape.points) != len(other.points):
        return False
    return (shape.complement() == other or other.complement() == shape) and all(
        {a, b} == {0.0, 1.0} or 0.0 < min(a, b) <= max(a, b) < 1.0
        for (_, a), (_, b) in zip(shape.points, other.points, strict=True)
    )


def _complement(of: Degree) -> Degree:
    return lambda place, after: 1 - of(place, after)


def _limit(shape: Shape) -> Degree:
    points = [(Fraction(x), Fraction(degree)) for x, degree in shape.points]
    places = [x for x, _ in points]

    def of(place: Fraction, after: bool) -> Fraction:
        i = bisect_left(places, place)  # the first point that is not before the place
        if after:
            while i < len(places) and places[i] == place:
                i += 1
        if i == 0 or i == len(points):
            return points[min(i, len(points) - 1)][1]
        (a, left), (b, right) = points[i - 1], points[i]
        return left + (right - left) * (place - a) / (b - a)

    return of


def _between(degrees: Sequence[Degree], a: Fraction, b: Fraction, end: bool) -> list[Fraction]:
    """Return the degrees just within the interval from a to b, at its end or at its start."""
    return [of(b, False) if end else of(a, True) for of in degrees]
