"""The exact centroid of one output, piece by piece of its straight terms, clipped or scaled."""

# Between two neighboring knots, or positions where two terms' lines meet, the lines l_1, l_2, .. have one order, the
# highest first. Clipped at their cuts c_1, c_2, .. and joined by the maximum they are a sum of single clipped lines:
# with C_t the greatest of the first t cuts,
#
#     max_t min(c_t, l_t) = sum_t (clip(l_t, C_(t-1), C_t) - C_(t-1)),
#
# for what fills the heights from C_(t-1) to C_t is line t, or a lower one; the higher ones are cut below them. Each of
# these bands is integrated by itself.
#
# Scaled by their cuts the lines have no order. They are joined where two of them meet, and integrated as trapezoids.
#
# The functions work on floats, on fractions and, with other names for `min` and so on, on arrays alike; Numba compiles
# them as they are.

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from fuzzy_arbiter.definition import Output, Variable
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array

Numbers = Sequence[Any]  # all floats, or all fractions
TINY = 1e-120  # if no cut is greater, all are scaled up alike: the centroid stays, and nothing underflows
LARGER = 2.0**266  # factor of that scaling
MAX_LINES = 200_000  # maximum number of lines of an outline


class Outline(NamedTuple):
    """The straight pieces of a variable's terms over its universe."""

    breakpoints: tuple[Any, ...]  # knots of the variable
    # index of each piece's first line, and the number of lines; a term that is 0 in a piece has no line there
    first: tuple[int, ...]
    term: tuple[int, ...]  # term of each line, in rising order within a piece
    left: tuple[Any, ...]  # degree just right of the piece's start, and just left of its end
    right: tuple[Any, ...]  # degree just right of the piece's start, and just left of its end
    order: tuple[int, ...]  # indices of each piece's lines, the highest first


def outline(variable: Variable, number: Callable[[float], Any] = float) -> Outline:
    """Return the straight pieces of a variable's terms over its universe."""
    knots = tuple(map(number, variable.knots))
    breakpoints, first, left, right = [knots[0]], [0], list[Any](), list[Any]()
    term, order = list[int](), list[int]()
    for a, b, lines in zip(knots, knots[1:], _lines(variable, knots, number), strict=False):
        terms, starts, ends = ([line[k] for line in lines] for k in range(3))
        # parts in which no two lines meet
        meet = (_meeting(starts, ends, t, u) for t, u in _passing(starts, ends, variable.name))
        shares = sorted({knots[0] * 0, knots[0] * 0 + 1, *(share for share in meet if share is not None)})
        for s0, s1 in zip(shares, shares[1:], strict=False):
            at, to = _between(starts, ends, s0), _between(starts, ends, s1)
            breakpoints.append(b if s1 == 1 else a + s1 * (b - a))
            order += sorted(
                range(len(left), len(left) + len(at)), key=lambda i: -(at[i - first[-1]] + to[i - first[-1]])
            )
            term += terms
            left += at
            right += to
            first.append(len(left))
            _require_few(len(left), variable.name)
    return Outline(*map(tuple, (breakpoints, first, term, left, right, order)))


def _lines(variable: Variable, knots: Numbers, number: Callable[[float], Any]) -> list[list[tuple[int, Any, Any]]]:
    """Return for each interval between knots the terms that are not 0 there, and their degrees at its ends."""
    result: list[list[tuple[int, Any, Any]]] = [[] for _ in knots[1:]]
    count = 0
    for t, each in enumerate(variable.terms):
        points = [(number(x), number(y)) for x, y in each.straight.points]
        # between two points, so that at a jump each interval sees its own side; constant before and after them
        parts = [(points[0], points[0]), *zip(points, points[1:], strict=False), (points[-1], points[-1])]
        for i, ((x0, y0), (x1, y1)) in enumerate(parts):
            if y0 == 0 and y1 == 0:
                continue
            low = bisect_left(knots, x0) if i else 0
            high = bisect_left(knots, x1) if i < len(parts) - 1 else len(knots)
            slope = (y1 - y0) / (x1 - x0) if x0 < x1 else y1 - y1
            for k in range(low, min(high, len(knots) - 1)):
                a, b = knots[k], knots[k + 1]
                start, end = y0 + slope * (a - x0) if x0 < a else y0, y1 + slope * (b - x1) if b < x1 else y1
                if start != 0 or end != 0:
                    result[k].append((t, start, end))
                    count += 1
        _require_few(count, variable.name)
    return result


def _passing(starts: Numbers, ends: Numbers, name: str) -> list[tuple[int, int]]:
    """Return the pairs of lines, the later first, of which one is higher at the start and the other at the end."""
    result: list[tuple[int, int]] = []
    earlier: list[tuple[Any, int]] = []  # ends of the lines that start lower, in rising order
    for t in sorted(range(len(starts)), key=lambda t: (starts[t], ends[t])):
        passed = earlier[bisect_right(earlier, (ends[t], len(starts))) :]
        result += [(max(t, u), min(t, u)) for _, u in passed]
        insort(earlier, (ends[t], t))
        _require_few(len(result), name)
    return result


def _require_few(lines: int, name: str) -> None:
    if lines > MAX_LINES:
        raise EngineError(f"output {name!r}: its terms overlap in {lines} places or more, expected at most {MAX_LINES}")


def _meeting(starts: Numbers, ends: Numbers, t: int, u: int) -> Any:
    """Return the crossing of two lines, as a fraction of the piece's width; None if they do not cross."""
    before, after = starts[t] - starts[u], ends[t] - ends[u]
    return before / (before - after) if before * after < 0 else None


def _between(starts: Numbers, ends: Numbers, fraction: Any) -> list[Any]:
    """Return the heights of lines within a piece."""
    if fraction == 0:
        return list(starts)
    return [b if fraction == 1 else a + fraction * (b - a) for a, b in zip(starts, ends, strict=True)]


def clipped(
    cuts: Numbers, breakpoints: Numbers, first: Numbers, term: Numbers, left: Numbers, right: Numbers, order: Numbers
) -> tuple[Any, Any]:
    """Return the area under the envelope of clipped terms, and its moment."""
    zero = cuts[0] * 0
    one = zero + 1
    area = moment = zero
    for piece in range(len(breakpoints) - 1):
        width = breakpoints[piece + 1] - breakpoints[piece]
        start = breakpoints[piece] - breakpoints[0]
        below = zero  # the greatest cut of the lines above
        for i in range(first[piece], first[piece + 1]):
            line = order[i]
            cut = cuts[term[line]]
            a, b = left[line], right[line]
            low, high = min(a, b), max(a, b)  # a falling line is treated as the mirrored rising one
            y0 = max(min(cut, low), below)
            y1 = max(min(cut, high), below)
            h0, h1 = y0 - below, y1 - below
            # where the line has these heights, in shares of the piece
            s0 = min(max((y0 - low) / (high - low), zero), one) if low < high else zero
            s1 = min(max((y1 - low) / (high - low), zero), one) if low < high else zero
            band = (s1 - s0) * (h0 + h1) / 2 + (one - s1) * h1
            lever = (s1 - s0) * (s0 * (2 * h0 + h1) + s1 * (h0 + 2 * h1)) / 6 + (one - s1) * (one + s1) / 2 * h1
            if a > b:
                lever = band - lever
            area = area + width * band
            moment = moment + width * (start * band + width * lever)
            below = max(below, cut)
    return area, moment


def crossing(a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return where a line from a to b meets one from c to d, as a fraction of the width; 0 where they do not."""
    # their differences at the ends have not one sign, nor are both 0
    return (a - c) / ((a - c) - (b - d)) if (a < c) != (b < d) else (a - a) * 0


def higher(degree: Any, height: Any, new: Any, old: Any) -> Any:
    """Return the new value where a degree is above a height, else the old one."""
    return new if degree > height else old


def scaled(
    cuts: Numbers, breakpoints: Numbers, first: Numbers, term: Numbers, left: Numbers, right: Numbers
) -> tuple[Any, Any]:
    """Return the area under the envelope of scaled terms, and its moment."""
    zero = cuts[0] * 0
    one = zero + 1
    area = moment = zero
    for piece in range(len(breakpoints) - 1):
        width = breakpoints[piece + 1] - breakpoints[piece]
        start = breakpoints[piece] - breakpoints[0]
        # where the envelope may break, in shares of the piece
        breaks = [one]
        for i in range(first[piece], first[piece + 1]):
            for j in range(first[piece], i):
                a, b = left[i] * cuts[term[i]], right[i] * cuts[term[i]]
                breaks.append(crossing(a, b, left[j] * cuts[term[j]], right[j] * cuts[term[j]]))
        x0 = zero
        for x1 in sorted(breaks):
            # the middle shows which line is the greatest; at an end it would be lost to rounding
            height = y0 = y1 = zero
            for i in range(first[piece], first[piece + 1]):
                a, rise, cut = left[i], right[i] - left[i], cuts[term[i]]
                degree = (a + rise * ((x0 + x1) / 2)) * cut
                y0 = higher(degree, height, (a + rise * x0) * cut, y0)
                y1 = higher(degree, height, (a + rise * x1) * cut, y1)
                height = max(height, degree)
            w = (x1 - x0) * width
            area = area + w * (y0 + y1) / 2
            moment = moment + w * ((start + x0 * width) * (2 * y0 + y1) + (start + x1 * width) * (y0 + 2 * y1)) / 6
            x0 = x1
    return area, moment


def centroid(
    cuts: Numbers, breakpoints: Numbers, first: Numbers, term: Numbers,
    left: Numbers, right: Numbers, order: Numbers, scales: bool,
) -> Any:  # fmt: skip
    """Return the centroid of clipped (or scaled) terms, joined by their maximum."""
    tables = breakpoints, first, term, left, right
    largest = cuts[0]
    for cut in cuts:
        largest = max(largest, cut)
    if largest < TINY:
        larger = [cut * LARGER for cut in cuts]
        area, moment = scaled(larger, *tables) if scales else clipped(larger, *tables, order)
    else:
        area, moment = scaled(cuts, *tables) if scales else clipped(cuts, *tables, order)
    return breakpoints[0] + moment / area


def term_centroids(output: Variable, number: Callable[[float], Any] = float) -> list[Any]:
    """Return the centroid of each of an output's terms, alone and whole."""
    shape = outline(output, number)
    n = len(output.terms)
    return [centroid([number(i == j) for i in range(n)], *shape, False) for j in range(n)]


def _crossing(a: Array, b: Array, c: Array, d: Array) -> Any:
    return np.divide(a - c, (a - c) - (b - d), out=np.zeros(np.shape(a)), where=(a < c) != (b < d))


# the functions for one sample, on arrays of many
_ON_ARRAYS = {
    "min": np.minimum, "max": np.maximum, "range": range, "len": len, "crossing": _crossing,
    "higher": lambda degree, height, new, old: np.where(degree > height, new, old),
    "sorted": lambda breaks: np.sort(np.array(breaks), axis=0),
}  # fmt: skip
_clipped, _scaled = (FunctionType(function.__code__, _ON_ARRAYS) for function in (clipped, scaled))


class Centroid(Defuzzifier):
    """The centroid of straight terms, clipped or scaled, joined by their maximum."""

    method = "exact integrals, to rounding"

    def __init__(self, output: Output, scales: bool) -> None:
        self._outline = outline(output)
        self._scales = scales

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the centroid for one sample."""
        return float(centroid(cuts, *self._outline, self._scales))

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the centroids for many samples."""
        cuts = np.where(cuts.max(axis=0) < TINY, cuts * LARGER, cuts)
        with np.errstate(over="ignore"):  # heights above a line that hardly rises may overflow, and are clipped
            area, moment = _scaled(cuts, *self._outline[:-1]) if self._scales else _clipped(cuts, *self._outline)
        return np.asarray(self._outline.breakpoints[0] + moment / area)
