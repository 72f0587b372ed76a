"""The exact centroid of any piecewise-linear Mamdani system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.engines.sweep import LARGER, TINY, Outline, centroid, outline

_BLOCK = 1024  # samples evaluated at a time


class ExactEngine(Engine):
    """Integrates the joined output terms exactly, over all their breakpoints."""

    name: ClassVar[str] = "exact"

    def __init__(self, system: System) -> None:
        self._outlines = [outline(v) for v in system.outputs]
        self._scaled = system.implication == "prod"
        super().__init__(system)

    def centroid(self, k: int, cuts: Sequence[float]) -> float:
        """Return the centroid of an output, exact to rounding."""
        return float(centroid(cuts, *self._outlines[k], self._scaled))

    def centroid_of_many(self, k: int, cuts: Array) -> Array:
        """Return the centroids of an output for many samples, exact to rounding."""
        cuts = np.where(cuts.max(axis=0) < TINY, cuts * LARGER, cuts)
        result = np.empty(cuts.shape[1])
        for start in range(0, len(result), _BLOCK):
            block = slice(start, start + _BLOCK)
            result[block] = _centroids(cuts[:, block], self._outlines[k], self._scaled)
        return result


def _centroids(cuts: Array, shape: Outline, scaled: bool) -> Array:
    """Return what `sweep.centroid` does, for each column of the cuts."""
    terms, n = cuts.shape
    area, moment = np.zeros(n), np.zeros(n)
    left, right = (np.reshape(side, (-1, terms, 1)) for side in (shape.left, shape.right))
    for piece, (a, b) in enumerate(zip(left, right, strict=True)):
        start, width = shape.places[piece] - shape.places[0], shape.places[piece + 1] - shape.places[piece]
        start_at, end_at = (a * cuts, b * cuts) if scaled else (a, b)
        levels = [] if scaled else [(a, b, cut, cut) for cut in cuts]  # each term against each cut
        # and each against those before it
        others = [(start_at[t], end_at[t], start_at[:t], end_at[:t]) for t in range(1, terms)]
        breaks = [np.zeros((1, n)), np.ones((1, n)), *(_crossings(*pair, n) for pair in (*levels, *others))]
        places = np.sort(np.concatenate(breaks), axis=0)
        middles = (places[:-1] + places[1:]) / 2
        heights, starts, ends = np.zeros((3, *middles.shape))
        for t in range(terms):
            cut, rise = cuts[t], b[t] - a[t]
            degrees = a[t] + rise * middles
            lines = a[t] + rise * places
            if scaled:
                degrees, lines = degrees * cut, lines * cut
                greatest = degrees > heights
                np.copyto(starts, lines[:-1], where=greatest)
                np.copyto(ends, lines[1:], where=greatest)
            else:
                level = degrees >= cut
                degrees = np.minimum(degrees, cut)
                greatest = degrees > heights
                np.copyto(starts, np.where(level, cut, lines[:-1]), where=greatest)
                np.copyto(ends, np.where(level, cut, lines[1:]), where=greatest)
            np.maximum(heights, degrees, out=heights)
        x, w = start + places * width, np.diff(places, axis=0) * width
        for i, (width_i, y0, y1) in enumerate(zip(w, starts, ends, strict=True)):
            # one after another, as for one sample, to the same bits
            area += width_i * (y0 + y1) / 2
            moment += width_i * (x[i] * (2 * y0 + y1) + x[i + 1] * (y0 + 2 * y1)) / 6
    return np.asarray(shape.places[0] + moment / area)


def _crossings(a: Array, b: Array, c: Array, d: Array, n: int) -> Array:
    """Return where the lines from a to b meet the line from c to d, in shares of the piece; 0 where they do not."""
    a, b, c, d = np.broadcast_arrays(a, b, c, d)
    meet = (a < c) != (b < d)
    shares = np.divide(a - c, (a - c) - (b - d), out=np.zeros(a.shape), where=meet)
    return np.asarray(np.broadcast_to(shares, (len(a), n)))
