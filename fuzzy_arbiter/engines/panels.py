"""Panels for Gauss-Legendre quadrature: their points, their error, and the panels in which all terms are smooth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from fuzzy_arbiter.shapes import Array, Membership
from fuzzy_arbiter.terms.curves import Curve

Mask = NDArray[np.bool_]
Indices = NDArray[np.intp]

ORDER = 8
NODES, WEIGHTS = legendre.leggauss(ORDER)
_BESIDE = 1e-9  # distance of the outer points from the panel's ends, as a fraction of its half, on its side of a jump
POINTS = np.array([-1.0 + _BESIDE, *NODES, 1.0 - _BESIDE])
INNER = slice(1, -1)  # the nodes among the points
# coefficients of the Legendre series through the values at the nodes, a row for each degree
ANALYSIS = (np.arange(ORDER)[:, None] + 0.5) * legendre.legvander(NODES, ORDER - 1).T * WEIGHTS
NARROWEST = 1e-14  # least width of a panel that is divided, as a fraction of the universe's maximum number
_STATIC = 1e-13  # tolerance of a panel of one term, as a fraction of the term's area
# factors of the values at the nodes: of the series' last terms, and of its values at the outer points
_FACTORS = np.vstack([ANALYSIS[4:], legendre.legvander(POINTS[[0, -1]], ORDER - 1) @ ANALYSIS])
_REST = 8.0  # greatest rest of a smooth function's series at an end, as a multiple of its last terms
_MAX_PANELS = 4096
_MAX_HALVINGS = 60


class Panels(NamedTuple):
    """Panels of many samples, in each of which the joined terms are smooth."""

    rows: Indices  # sample of each panel
    starts: Array
    ends: Array
    areas: Array
    moments: Array  # about the universe's start
    flat: Mask  # True where the height is constant
    heights: Array  # at the points of each panel, shape (points, panels)

    def chosen(self, which: Mask | Indices) -> Panels:
        """Return some of the panels."""
        columns: list[Any] = [column[..., which] for column in self]
        return Panels(*columns)


def points_of(starts: Array, ends: Array, at: Array = POINTS) -> Array:
    """Return the points of each panel, shape (points, panels); `at` is that of (points,) or of (points, panels)."""
    places = at[:, None] if at.ndim == 1 else at
    return np.asarray((starts + ends) / 2 + (ends - starts) / 2 * places)


def integrals(values: Array) -> tuple[Array, Array, Array]:
    """Return the area and the moment of panels from -1 to 1 for values at `POINTS`, and an estimate of errors."""
    # A series whose terms fall by r from the degrees 4 and 5 to 6 and 7 falls by r^5 until degree 16, the first that
    # the nodes do not integrate. A series that does not reach the values at the ends hides a steep part between an end
    # and the node beside it.
    *series, first, last = _FACTORS @ values[INNER]
    before, rest = np.abs(series[0]) + np.abs(series[1]), np.abs(series[2]) + np.abs(series[3])
    with np.errstate(divide="ignore", invalid="ignore"):
        decay = np.where(rest < before, rest / before, 1.0)
    off = np.maximum(np.abs(first - values[0]), np.abs(last - values[-1]))
    hidden = np.where(off > _REST * rest, off * (1.0 - NODES[-1]) / 2, 0.0)
    # not by a product of matrices, of which a column's bits depend on the number of columns
    area, moment = (np.add.reduce(factors[:, None] * values[INNER]) for factors in (WEIGHTS, WEIGHTS * NODES))
    return area, moment, np.maximum(rest * decay**5, hidden)


def smooth_panels(universe: tuple[float, float], shapes: Sequence[Membership]) -> Array:
    """Return the ends of panels in which each of some terms is smooth enough for the quadrature, in rising order."""
    low, high = universe
    edges = np.unique([low, *(x for shape in shapes for x in shape.features(universe)), high])
    narrowest = NARROWEST * max(abs(low), abs(high), high - low)
    starts, ends = edges[:-1], edges[1:]
    areas = np.zeros(len(shapes))
    for _ in range(_MAX_HALVINGS):
        positions = points_of(starts, ends)
        rough = np.zeros(len(starts), dtype=bool)
        for k, shape in enumerate(shapes):
            sums, _, errors = integrals(shape.of_many(positions.ravel()).reshape(positions.shape))
            areas[k] = max(areas[k], float(sums @ (ends - starts)) / 2)
            rough |= errors * (ends - starts) > _STATIC * areas[k]
        rough &= ends - starts > narrowest
        if not rough.any() or len(edges) + rough.sum() > _MAX_PANELS:
            break
        middles = (starts[rough] + ends[rough]) / 2
        edges = np.concatenate([edges, middles])
        starts, ends = np.concatenate([starts[rough], middles]), np.concatenate([middles, ends[rough]])
    return np.unique(edges)


def halved(edges: Array) -> Array:
    """Return the ends of the halves of panels, of which none has the maximum height at both ends only."""
    return np.sort([*edges, *(edges[1:] + edges[:-1]) / 2])


def constant_panels(shape: Membership, middles: Array, degrees: Array) -> Mask:
    """Return True for panels in which a term is constant; a curve that only rounds to 1 is not."""
    if isinstance(shape, Curve):
        pieces = [isinstance(tree, float) for tree in shape.trees]
        return np.array(pieces)[np.searchsorted(shape.ends, middles)]
    return np.asarray(np.ptp(degrees, axis=0) == 0.0)


def dividing(items: Indices, positions: Array, starts: Array, ends: Array) -> tuple[Indices, Array, Array]:
    """Divide some panels at positions within them; return the panel of each part, its start and its end."""
    divided = np.unique(items)
    items, positions = np.concatenate([divided, items]), np.concatenate([starts[divided], positions])
    order = np.lexsort((positions, items))
    items, positions = items[order], positions[order]
    until = np.append(positions[1:], 0.0)
    last = np.append(items[1:] != items[:-1], True)
    until[last] = ends[items[last]]
    wide = until > positions
    return items[wide], positions[wide], until[wide]


def lowest_between(values: Array) -> tuple[Mask, Array]:
    """Find panels where a positive function may fall to 0 between its points; return where it comes closest to 0."""
    # A parabola through each three neighboring points shows where the function turns, and how far below the points.
    x0, x1, x2 = POINTS[:-2, None], POINTS[1:-1, None], POINTS[2:, None]
    v0, v1, v2 = values[:-2], values[1:-1], values[2:]
    slope = (v1 - v0) / (x1 - x0)
    bend = ((v2 - v1) / (x2 - x1) - slope) / (x2 - x0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        turn = (x0 + x1) / 2 - slope / (2 * bend)
        minimum = v0 + slope * (turn - x0) + bend * (turn - x0) * (turn - x1)
        rise = np.maximum(v0, v2) - minimum
        near = (bend > 0.0) & (x0 < turn) & (turn < x2) & (minimum < rise / 2) & (rise > 1e-12)
    best = np.where(near, minimum, np.inf).argmin(axis=0)
    return near.any(axis=0), np.take_along_axis(turn, best[None], axis=0)[0]


def roots(
    function: Callable[[Array, Indices], Array], starts: Array, ends: Array, tolerance: float
) -> tuple[Array, Mask]:
    """Find a root of each of many functions between two positions, by Chandrupatla's method."""
    active = np.arange(len(starts))
    f1, f2 = function(starts, active), function(ends, active)
    has_root = (f1 >= 0.0) != (f2 >= 0.0)
    result = np.where(has_root, starts, np.nan)
    active = active[has_root]
    x1, x2, f1, f2 = starts[has_root], ends[has_root], f1[has_root], f2[has_root]
    fraction = f1 / (f1 - f2)
    while len(active):
        x = x1 + fraction * (x2 - x1)
        f = function(x, active)
        same = (f >= 0.0) == (f1 >= 0.0)
        x3, f3 = np.where(same, x1, x2), np.where(same, f1, f2)
        x2, f2 = np.where(same, x2, x1), np.where(same, f2, f1)
        x1, f1 = x, f
        result[active] = np.where(np.abs(f1) < np.abs(f2), x1, x2)
        with np.errstate(all="ignore"):
            min_fraction = tolerance / np.abs(x2 - x1)
            position, value = (x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2)
            quadratic = (1.0 - np.sqrt(1.0 - position) < value) & (value < np.sqrt(position))
            fraction = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        fraction = np.clip(np.where(quadratic, fraction, 0.5), min_fraction, 1.0 - min_fraction)
        go = (min_fraction < 0.5) & (f1 != 0.0)
        active, fraction = active[go], fraction[go]
        x1, x2, f1, f2 = x1[go], x2[go], f1[go], f2[go]
    return result, has_root
