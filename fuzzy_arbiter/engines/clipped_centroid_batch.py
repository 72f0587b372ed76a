"""The algorithm of `fuzzy_arbiter.engines.clipped_centroid` for many samples at a time, equal to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from types import FunctionType

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.clipped_centroid import LARGER, TINY, Outline, centroid, clipped, outline
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.shapes import Array


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
        return (_scaled_centroids if self._scales else _clipped_centroids)(cuts, self._outline)


# the function for one sample, on arrays of many
_clipped_areas = FunctionType(clipped.__code__, {"min": np.minimum, "max": np.maximum, "range": range, "len": len})


def _clipped_centroids(cuts: Array, shape: Outline) -> Array:
    """Return the centroids of clipped terms, joined by their maximum, for many samples."""
    with np.errstate(over="ignore"):  # heights above a line that hardly rises may overflow, and are clipped
        area, moment = _clipped_areas(cuts, *shape)
    return np.asarray(shape.breakpoints[0] + moment / area)


def _scaled_centroids(cuts: Array, shape: Outline) -> Array:
    """Return the centroids of scaled terms, joined by their maximum, for many samples."""
    all_cuts, n = cuts, cuts.shape[1]
    area, moment = np.zeros(n), np.zeros(n)
    for piece in range(len(shape.breakpoints) - 1):
        lines = slice(shape.first[piece], shape.first[piece + 1])
        a, b = (np.reshape(side[lines], (-1, 1)) for side in (shape.left, shape.right))
        cuts = all_cuts[list(shape.term[lines])]
        terms = len(cuts)
        start, width = (
            shape.breakpoints[piece] - shape.breakpoints[0],
            shape.breakpoints[piece + 1] - shape.breakpoints[piece],
        )
        start_at, end_at = a * cuts, b * cuts
        # each against those before it
        others = [(start_at[t], end_at[t], start_at[:t], end_at[:t]) for t in range(1, terms)]
        breaks = [np.zeros((1, n)), np.ones((1, n)), *(_crossings(*pair, n) for pair in others)]
        breakpoints = np.sort(np.concatenate(breaks), axis=0)
        middles = (breakpoints[:-1] + breakpoints[1:]) / 2
        heights, starts, ends = np.zeros((3, *middles.shape))
        for t in range(terms):
            cut, rise = cuts[t], b[t] - a[t]
            degrees, lines = (a[t] + rise * middles) * cut, (a[t] + rise * breakpoints) * cut
            highest = degrees > heights
            np.copyto(starts, lines[:-1], where=highest)
            np.copyto(ends, lines[1:], where=highest)
            np.maximum(heights, degrees, out=heights)
        x, w = start + breakpoints * width, np.diff(breakpoints, axis=0) * width
        for i, (width_i, y0, y1) in enumerate(zip(w, starts, ends, strict=True)):
            # one after another, as for one sample, to the same bits
            area += width_i * (y0 + y1) / 2
            moment += width_i * (x[i] * (2 * y0 + y1) + x[i + 1] * (y0 + 2 * y1)) / 6
    return np.asarray(shape.breakpoints[0] + moment / area)


def _crossings(a: Array, b: Array, c: Array, d: Array, n: int) -> Array:
    """Return the crossings of lines a..b with the line c..d, as fractions of the piece's width; 0 where none cross."""
    a, b, c, d = np.broadcast_arrays(a, b, c, d)
    meet = (a < c) != (b < d)
    shares = np.divide(a - c, (a - c) - (b - d), out=np.zeros(a.shape), where=meet)
    return np.asarray(np.broadcast_to(shares, (len(a), n)))
