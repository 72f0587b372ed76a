"""Partition of an input's universe by its terms: patterns of degrees, and gaps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fuzzy_arbiter.definition import Variable
from fuzzy_arbiter.engines.panels import Indices, roots
from fuzzy_arbiter.shapes import Array, Membership, Shape

Ranks = NDArray[np.int32]  # there are up to twice as many levels as there are weights of rules
Kind = Literal["gap", "below", "above"]
ROUNDING = 1e-12  # degrees nearer to a level between 0 and 1, and sums nearer to 1, are equal to it


@dataclass(frozen=True, slots=True)
class Domain:
    """The finite domain of an input: one place for each pattern of degrees that rules can distinguish."""

    variable: str  # name of the input
    terms: tuple[str, ...]  # names of its terms
    # one for each pattern: a place where it is found, or the term that is taken as a label
    positions: tuple[float | str, ...]
    ranks: Ranks  # (patterns, terms) Degrees as ranks, see `ranked`


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


def ranked(degrees: Array, levels: Sequence[float]) -> Ranks:
    """Return the ranks of degrees among levels."""
    # Minimum and maximum of degrees have the minimum and maximum of their ranks; if with each level one minus it is a
    # level too, then one minus a degree has the rank 2 L - r. So rules can be evaluated on ranks instead of degrees.
    for level in levels[1:-1] if levels[0] == 0.0 else levels:
        degrees = np.where(np.abs(degrees - level) < ROUNDING, level, degrees)
    index = np.searchsorted(levels, degrees)
    equal = np.asarray(levels)[np.minimum(index, len(levels) - 1)] == degrees
    return np.asarray(2 * index + equal, dtype=np.int32)


def crisp(variable: Variable, levels: Sequence[float]) -> Domain:
    """Return the domain of an input whose terms are labels: one holds fully, the others do not."""
    names = variable.term_names
    return Domain(variable.name, names, names[::-1], ranked(np.eye(len(names))[::-1], levels))


def graded(variable: Variable, levels: Sequence[float]) -> Domain:
    """Return the domain of an input that may be any real number in its universe."""
    knots = _positions(variable)
    inner = np.array([level for level in levels if 0.0 < level < 1.0])
    crossings = [knots]
    for term in variable.terms if len(inner) else ():
        for a, b, left, right in zip(knots, knots[1:], *_sides(knots, term.straight.of_many), strict=False):
            passed = inner[(inner - left) * (inner - right) < 0.0]
            crossings.append(a + (passed - left) * (b - a) / (right - left))
    knots = np.unique(np.concatenate(crossings))
    places = np.sort(np.concatenate([knots, (knots[1:] + knots[:-1]) / 2]))
    ranks = ranked(np.array([term.membership.of_many(places) for term in variable.terms]).T, levels)
    _, first = np.unique(ranks, axis=0, return_index=True)
    first.sort()
    return Domain(variable.name, variable.term_names, tuple(places[first].tolist()), ranks[first])


def stretches(variable: Variable) -> tuple[Stretch, ...]:
    """Return the stretches of an input's universe on which degrees do not sum to 1; of curved terms, gaps alone."""
    positions = _positions(variable)
    is_straight = all(isinstance(term.shape, Shape) for term in variable.terms)

    def total(x: Array) -> Array:
        return np.asarray(sum((term.membership.of_many(x) for term in variable.terms), np.zeros(len(x))))

    sums = total(positions).tolist()
    left, right = (side.tolist() for side in _sides(positions, total))
    # positions and the open intervals between them by turns: start, end, and the sum at both ends
    low = float(positions[0])
    parts = [(low, low, sums[0], sums[0])]
    for (a, b), start, end, s in zip(pairwise(positions.tolist()), left, right, sums[1:], strict=True):
        if (start - 1.0) * (end - 1.0) < -ROUNDING:
            one = a + (1.0 - start) * (b - a) / (end - start)
            parts += [(a, one, start, 1.0), (one, one, 1.0, 1.0), (one, b, 1.0, end)]
        else:
            parts.append((a, b, start, end))
        parts.append((b, b, s, s))
    kinds: dict[Kind, Callable[[float, float], bool]] = {"gap": lambda start, end: start == end == 0.0}
    if is_straight:
        kinds["below"] = lambda start, end: start + end < 2.0 - ROUNDING
        kinds["above"] = lambda start, end: start + end > 2.0 + ROUNDING
    return tuple(s for kind, of_kind in kinds.items() for s in _joined(variable.name, kind, parts, of_kind))


def _joined(
    name: str, kind: Kind, parts: Sequence[tuple[float, float, float, float]], of_kind: Callable[[float, float], bool]
) -> list[Stretch]:
    result, run = [], []
    for part in (*parts, None):
        if part is not None and of_kind(part[2], part[3]):
            run.append(part)
            continue
        if run:
            sums = [round(s, 12) + 0.0 for _, _, *ends in run for s in ends]
            (a, a_end, *_), (b, b_end, *_) = run[0], run[-1]
            result.append(Stretch(name, kind, a, b_end, a == a_end, b == b_end, min(sums), max(sums)))
        run = []
    return result


def _positions(variable: Variable) -> Array:
    """Return the positions between which each term is straight, or only rises or only falls, and is 0 or above it."""
    low, high = variable.universe
    knots = np.unique([low, *(x for t in variable.terms for x in t.membership.features((low, high))), high])
    positions = [knots]
    for shape in (term.membership for term in variable.terms if not isinstance(term.membership, Shape)):

        def is_positive(x: Array, _: Indices, shape: Membership = shape) -> Array:
            return np.asarray(np.sign(shape.of_many(x)) - 0.5)

        ends, _ = roots(is_positive, knots[:-1], knots[1:], 1e-15 * (high - low))  # where small degrees become 0
        positions.append(ends[np.isfinite(ends)])
    return np.unique(np.concatenate(positions))


def _sides(positions: Array, function: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Return the values just after the start and just before the end of each interval, if the function is straight."""
    quarter = np.diff(positions) / 4
    one, other = function(positions[:-1] + quarter), function(positions[1:] - quarter)
    return (3.0 * one - other) / 2, (3.0 * other - one) / 2
