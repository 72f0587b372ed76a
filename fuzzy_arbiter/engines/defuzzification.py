"""From the panels of joined terms to one value: the bisector, the positions of the maximum height, and singletons."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre

from fuzzy_arbiter.engines.panels import ANALYSIS, INNER, NODES, ORDER, WEIGHTS, Indices, Panels, points_of, roots
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.curves import Curve

if TYPE_CHECKING:
    from fuzzy_arbiter.engines.quadrature import Quadrature, Samples

HEIGHT_RATIO = 1.0 - 1e-12  # quotient of heights above which they count as equal
_MIN_DISTANCE = 1e-9  # positions that are nearer than this fraction of the universe count as one
_DENSE = np.linspace(-1.0, 1.0, 17)  # points of a panel between which its slope has one zero at most
_DENSE_POLYNOMIALS = legendre.legvander(_DENSE, ORDER - 2)
_LIKELY = 0.95  # minimum height at the points around a maximum, as a fraction of the maximum at any point


def of_points(quad: Quadrature, cuts: Array) -> float:
    """Return the mean of the singletons, weighted by their heights: what very narrow terms of one width tend to."""
    joined = [
        (shape.parameters[0], implication.number(cut, shape.height))
        for cut, implication, t in zip(cuts.tolist(), quad.implications, quad.terms, strict=True)
        if isinstance(shape := quad.shapes[t], Curve) and shape.kind == "singleton"
    ]
    weight = sum(height for _, height in joined)
    return sum(position * height for position, height in joined) / weight if weight > 0.0 else math.nan


def bisectors(samples: Samples, panels: Panels, totals: Array) -> Array:
    """Return for each sample the position that halves the area; of several the middle one."""
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
    all_rows = np.arange(samples.n)
    panel = first + index
    missing = half - (sums[all_rows, index] - areas[panel])
    result: Array = ends[panel].copy()
    at_end = np.abs(missing - areas[panel]) <= 1e-14 * half  # perhaps of a gap, whose end is the next start
    for row in np.flatnonzero(at_end).tolist():
        after = np.flatnonzero(table[row, index[row] + 1 : counts[row]] > 0.0)
        if len(after):
            result[row] = (result[row] + starts[panel[row] + 1 + after[0]]) / 2
    inside = np.flatnonzero(~at_end & (totals > 0.0))

    def lacking(x: Array, which: Indices) -> Array:
        row = inside[which]
        start = starts[panel[row]]
        heights = samples.heights(points_of(start, x, NODES), row).height
        return np.asarray(WEIGHTS @ heights * (x - start) / 2 - missing[row])

    middles, has_root = roots(lacking, starts[panel[inside]], ends[panel[inside]], samples.quad.precision)
    result[inside[has_root]] = middles[has_root]
    return result


def of_maximum(samples: Samples, panels: Panels, kind: str) -> Array:
    """Return for each sample the mean, smallest or largest position of the maximum height."""
    quad, n = samples.quad, samples.n
    tops = panels.heights.max(axis=0)
    max_heights = np.zeros(n)
    np.maximum.at(max_heights, panels.rows, tops)
    candidates = [(np.repeat(np.arange(n), len(quad.edges)), np.tile(quad.edges, n))]
    high = np.flatnonzero(~panels.flat & (tops >= _LIKELY * max_heights[panels.rows]))
    if len(high):
        tall = panels.chosen(high)
        best = points_of(tall.starts, tall.ends, NODES)[tall.heights[INNER].argmax(axis=0), np.arange(len(high))]
        # a height that jumps at an end reaches its maximum just inside
        inset = np.minimum(4.0 * quad.precision, (tall.ends - tall.starts) * 1e-3)
        ends = (tall.starts, tall.ends, tall.starts + inset, tall.ends - inset)
        candidates += [*((tall.rows, x) for x in (*ends, best)), _turning(samples, tall)]
    rows, positions = (np.concatenate(column) for column in zip(*candidates, strict=True))
    heights = samples.heights(positions, rows).height
    max_heights = np.zeros(n)
    np.maximum.at(max_heights, rows, heights)
    np.maximum.at(max_heights, panels.rows[panels.flat], tops[panels.flat])
    top = (heights >= max_heights[rows] * HEIGHT_RATIO) & (heights > 0.0)
    rows, positions = rows[top], positions[top]
    level = panels.flat & (tops >= max_heights[panels.rows] * HEIGHT_RATIO) & (tops > 0.0)
    rows = np.concatenate([rows, panels.rows[level]])
    sides = [np.concatenate([positions, column[level]]) for column in (panels.starts, panels.ends)]
    return positions_of_maximum(kind, rows, sides[0], sides[1], n, (quad.low, quad.low + quad.width))


def positions_of_maximum(
    kind: str, rows: Indices, starts: Array, ends: Array, n: int, universe: tuple[float, float]
) -> Array:
    """Return for n samples the mean, smallest or largest position of segments; a start that is its end is a point."""
    result, (low, high) = np.full(n, math.nan), universe
    if kind != "mom":
        pick, positions = (np.fmin, starts) if kind == "som" else (np.fmax, ends)
        pick.at(result, rows, positions)
        return result
    order = np.lexsort((starts + ends, rows))
    rows, centers, lengths = rows[order], (starts + ends)[order] / 2 - low, (ends - starts)[order]
    distance = _MIN_DISTANCE * (high - low)
    begins = np.append(True, (rows[1:] != rows[:-1]) | (np.diff(centers) > distance))[: len(rows)]
    weights = np.where(np.bincount(rows, lengths, n)[rows] > distance, lengths, begins)
    totals = np.bincount(rows, weights, n)
    np.divide(np.bincount(rows, weights * centers, n), totals, out=result, where=totals > 0.0)
    return result + low


def _turning(samples: Samples, panels: Panels) -> tuple[Indices, Array]:
    """Return samples and positions where the height within a panel turns from rising to falling."""
    rows, starts, ends, heights = panels.rows, panels.starts, panels.ends, panels.heights[INNER]
    # a part of the panel around the turn, which a polynomial meets more closely; then that turn
    for near in (0.1, 0.0):
        slope = legendre.legder(ANALYSIS @ heights)
        slopes = _DENSE_POLYNOMIALS @ slope
        index, items = np.nonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))
        slope, low, high = slope[:, items], _DENSE[index], _DENSE[index + 1]
        bend, x = legendre.legder(slope), (low + high) / 2
        for _ in range(6):  # Newton's method
            with np.errstate(divide="ignore", invalid="ignore"):
                step = legendre.legval(x, slope, tensor=False) / legendre.legval(x, bend, tensor=False)
            x = np.clip(np.where(np.isfinite(step), x - step, x), low, high)
        rows, sides = rows[items], np.clip([x - near, x + near], -1.0, 1.0)
        starts, ends = points_of(starts[items], ends[items], sides)
        heights = samples.heights(points_of(starts, ends, NODES), rows).height if near else heights
    return rows, starts
