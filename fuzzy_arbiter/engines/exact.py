"""The exact centroid of any piecewise-linear Mamdani system."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.engines.sweep import LARGER, TINY, Outline, centroid, outline

BLOCK = 1024  # samples evaluated at a time


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
        for start in range(0, len(result), BLOCK):
            block = slice(start, start + BLOCK)
            result[block] = _centroids(cuts[:, block], self._outlines[k], self._scaled)
        return result


def _centroids(cuts: Array, shape: Outline, scaled: bool) -> Array:
    """Return what `sweep.centroid` does, for each column of the cuts."""
    terms, n = cuts.shape
    area, moment = np.zeros(n), np.zeros(n)
    left, right = (np.reshape(side, (-1, terms, 1)) for side in (shape.left, shape.right))
    for piece, (a, b) in enumerate(zip(left, right, strict=True)):
        start, width = shape.places[piece] - shape.places[0], shape.places[piece + 1] - shape.places[piece]
        if scaled:
            a, b = a * cuts, b * cuts
        levels = [] if scaled else [(a, b, cut, cut) for cut in cuts]  # each term against each cut
        others = [(a[:t], b[:t], a[t], b[t]) for t in range(1, terms)]  # and against the terms before it
        breaks = [np.zeros((1, n)), np.ones((1, n)), *(_crossings(*pair, n) for pair in (*levels, *others))]
        places = np.sort(np.concatenate(breaks), axis=0)
        heights = np.zeros_like(places)
        for t in range(terms):
            degrees = a[t] + (b[t] - a[t]) * places
            np.maximum(heights, degrees if scaled else np.minimum(degrees, cuts[t]), out=heights)
        x, w = start + places * width, np.diff(places, axis=0) * width
        area += (w * (heights[:-1] + heights[1:])).sum(axis=0) / 2.0
        both = x[:-1] * (2.0 * heights[:-1] + heights[1:]) + x[1:] * (heights[:-1] + 2.0 * heights[1:])
        moment += (w * both).sum(axis=0) / 6.0
    return np.asarray(shape.places[0] + moment / area)


def _crossings(a: Array, b: Array, c: Array, d: Array, n: int) -> Array:
    """Return where the lines from a to b meet the line from c to d, in shares of the piece; 0 where they do not."""
    a, b, c, d = np.broadcast_arrays(a, b, c, d)
    meet = (a < c) != (b < d)
    shares = np.divide(c - a, (b - a) - (d - c), out=np.zeros(a.shape), where=meet)
    return np.asarray(np.clip(np.broadcast_to(shares, (len(a), n)), 0.0, 1.0))
