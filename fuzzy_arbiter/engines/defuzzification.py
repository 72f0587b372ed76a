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
    greatest = np.zeros(n)
    np.maximum.at(greatest, panels.rows, panels.heights.max(axis=1))
    edges = np.tile(of.edges, n)
    found = [(np.repeat(np.arange(n), len(of.edges)), edges)]
    high = np.flatnonzero(~panels.flat & (panels.heights.max(axis=1) >= _LIKELY * greatest[panels.rows]))
    if len(high):
        some = panels.chosen(high)
        best = some.heights[:, INNER].argmax(axis=1)
        highest = points_of(some.starts, some.ends, NODES)[np.arange(len(high)), best]
        found += [(some.rows, x) for x in (some.starts, some.ends, highest)]
        found.append(_turning(samples, some))
    rows, places = (np.concatenate(column) for column in zip(*found, strict=True))
    heights = samples.heights(places, rows).height
    np.maximum.at(greatest, rows, heights)
    top = (heights >= greatest[rows] * _EQUAL) & (heights > 0.0)
    rows, places = rows[top], places[top]
    level = panels.flat & (panels.heights[:, 4] >= greatest[panels.rows] * _EQUAL) & (panels.heights[:, 4] > 0.0)
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
    rows, starts, ends, heights = panels.rows, panels.starts, panels.ends, panels.heights[:, INNER]
    first, last = starts, ends
    for closer in (True, False):
        series = np.einsum("pj,kj->kp", heights, ANALYSIS)
        slope = legendre.legder(series)
        bend = legendre.legder(slope)
        values = legendre.legval(np.linspace(-1.0, 1.0, 33), slope)
        items, at = np.nonzero((values[:, :-1] > 0.0) & (values[:, 1:] <= 0.0))
        x = -1.0 + (at + 0.5) / 16
        for _ in range(6):  # Newton's method
            with np.errstate(divide="ignore", invalid="ignore"):
                step = legendre.legval(x, slope[:, items], tensor=False) / legendre.legval(
                    x, bend[:, items], tensor=False
                )
            x = np.clip(np.where(np.isfinite(step), x - step, x), -1.0, 1.0)
        half = (ends - starts)[items] / 2
        rows, places, first, last = rows[items], (starts + ends)[items] / 2 + x * half, first[items], last[items]
        if closer:
            starts, ends = np.maximum(places - half / 50, first), np.minimum(places + half / 50, last)
            heights = samples.heights(points_of(starts, ends, NODES), rows).height
    return rows, places
