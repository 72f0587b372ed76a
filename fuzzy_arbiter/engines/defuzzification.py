"""From the panels of joined terms to one value: the bisector, the places of the greatest height, and singletons."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre

from fuzzy_arbiter.engines.panels import ANALYSIS, INNER, NODES, WEIGHTS, Indices, Panels, points_of, roots
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.curves import Curve

if TYPE_CHECKING:
    from fuzzy_arbiter.engines.quadrature import Quadrature, Samples

_EQUAL = 1.0 - 1e-12  # heights count as equal if their quotient is above this
_APART = 1e-9  # places count as one within this fraction of the universe
_CLOSER = 2  # times that many points narrow the search for a maximum
_DENSE = np.linspace(-1.0 + 1e-12, 1.0 - 1e-12, 33)  # these points in a panel, on its side of a jump
_LIKELY = 0.95  # least height at the points around a maximum, as a fraction of the greatest at any point


def of_points(of: Quadrature, cuts: Array) -> float:
    """Return the mean of the singletons, weighted by their heights: what very narrow terms of one width tend to."""
    joined = [
        (shape.parameters[0], float(implication(cut, np.array([shape.height]))[0]))
        for cut, implication, t in zip(cuts, of._implications, of._term, strict=True)
        if isinstance(shape := of._shapes[t], Curve) and shape.kind == "singleton"
    ]
    weight = sum(height for _, height in joined)
    return sum(place * height for place, height in joined) / weight if weight > 0.0 else math.nan


def bisectors(samples: Samples, panels: Panels, totals: Array) -> Array:
    """Return for each sample the place that halves the area; of several the middle one."""
    order = np.lexsort((panels.starts, panels.rows))
    rows, starts, ends, areas = (column[order] for column in (panels.rows, panels.starts, panels.ends, panels.areas))
    counts = np.bincount(rows, minlength=samples.n)
    first = np.cumsum(counts) - counts
    rank = np.arange(len(rows)) - first[rows]
    table = np.zeros((samples.n, int(counts.max())))
    table[rows, rank] = areas
    sums = np.cumsum(table, axis=1)
    half = sums[:, -1] / 2
    index = (sums < (half * (1.0 - 1e-14))[:, None]).sum(axis=1)
    index = np.minimum(index, counts - 1)
    every = np.arange(samples.n)
    chosen = first + index
    missing = half - (sums[every, index] - areas[chosen])
    result: Array = ends[chosen].copy()
    at_end = np.abs(missing - areas[chosen]) <= 1e-14 * half  # perhaps of a gap, whose end is the next start
    for row in np.flatnonzero(at_end).tolist():
        after = np.flatnonzero(table[row, index[row] + 1 : counts[row]] > 0.0)
        if len(after):
            result[row] = (result[row] + starts[chosen[row] + 1 + after[0]]) / 2
    inside = np.flatnonzero(~at_end & (totals > 0.0))

    def lacking(x: Array, which: Indices) -> Array:
        row = inside[which]
        start = starts[chosen[row]]
        heights = samples.heights(points_of(start, x, NODES), row).height
        return np.asarray((heights * WEIGHTS).sum(axis=-1) * (x - start) / 2 - missing[row])

    at, found = roots(lacking, starts[chosen[inside]], ends[chosen[inside]], samples.of.precision)
    result[inside[found]] = at[found]
    return result


def of_maximum(samples: Samples, panels: Panels, kind: str) -> Array:
    """Return for each sample the mean, the smallest or the largest of the places where the height is greatest."""
    of, n = samples.of, samples.n
    tops = panels.heights.max(axis=1)
    greatest = np.zeros(n)
    np.maximum.at(greatest, panels.rows, tops)
    found = [(np.repeat(np.arange(n), len(of.edges)), np.tile(of.edges, n))]
    high = np.flatnonzero(~panels.flat & (tops >= _LIKELY * greatest[panels.rows]))
    if len(high):
        some = panels.chosen(high)
        best = points_of(some.starts, some.ends, NODES)[np.arange(len(high)), some.heights[:, INNER].argmax(axis=1)]
        # a height that jumps at an end is greatest beside it
        beside = np.minimum(4.0 * of.precision, (some.ends - some.starts) * 1e-3)
        ends = (some.starts, some.ends, some.starts + beside, some.ends - beside)
        found += [*((some.rows, x) for x in (*ends, best)), _turning(samples, some)]
    rows, places = (np.concatenate(column) for column in zip(*found, strict=True))
    heights = samples.heights(places, rows).height
    greatest = np.zeros(n)
    np.maximum.at(greatest, rows, heights)
    np.maximum.at(greatest, panels.rows[panels.flat], tops[panels.flat])
    top = (heights >= greatest[rows] * _EQUAL) & (heights > 0.0)
    rows, places = rows[top], places[top]
    level = panels.flat & (tops >= greatest[panels.rows] * _EQUAL) & (tops > 0.0)
    flat, left, right = panels.rows[level], panels.starts[level], panels.ends[level]
    result = np.full(n, math.nan)
    if kind == "mom":
        order = np.lexsort((places, rows))
        rows, places = rows[order], places[order]
        one = np.ones(len(rows), dtype=bool)
        one[1:] = (rows[1:] != rows[:-1]) | (np.diff(places) > _APART * of.width)
        count = np.bincount(rows[one], minlength=n)
        some_points = count > 0
        result[some_points] = np.bincount(rows[one], places[one] - of.low, n)[some_points] / count[some_points] + of.low
        length = np.bincount(flat, right - left, n)
        wide = length > _APART * of.width
        moment = np.bincount(flat, (right - left) * ((left + right) / 2 - of.low), n)
        result[wide] = of.low + moment[wide] / length[wide]
        return result
    pick, ends = (np.fmin, left) if kind == "som" else (np.fmax, right)
    pick.at(result, rows, places)
    pick.at(result, flat, ends)
    return result


def _turning(samples: Samples, panels: Panels) -> tuple[Indices, Array]:
    """Return samples and places where the height within a panel turns from rising to falling."""
    rows, starts, ends = panels.rows, panels.starts, panels.ends
    for _ in range(_CLOSER):
        places = points_of(starts, ends, _DENSE)
        heights = samples.heights(places, rows).height
        around = np.pad(heights, ((0, 0), (1, 1)))
        items, at = np.nonzero((heights >= around[:, :-2]) & (heights > around[:, 2:]))
        rows, starts, ends = rows[items], places[items, np.maximum(at - 1, 0)], places[items, np.minimum(at + 1, 32)]
        best, height = places[items, at], heights[items, at]
    slope = legendre.legder(
        np.einsum("pj,kj->kp", samples.heights(points_of(starts, ends, NODES), rows).height, ANALYSIS)
    )
    bend = legendre.legder(slope)
    x = np.zeros(len(rows))
    for _ in range(6):  # Newton's method
        with np.errstate(divide="ignore", invalid="ignore"):
            step = legendre.legval(x, slope, tensor=False) / legendre.legval(x, bend, tensor=False)
        x = np.clip(np.where(np.isfinite(step), x - step, x), -1.0, 1.0)
    places = points_of(starts, ends, x[:, None])[:, 0]
    return rows, np.where(samples.heights(places, rows).height >= height * _EQUAL, places, best)
