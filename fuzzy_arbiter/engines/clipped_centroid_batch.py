"""The algorithm of `fuzzy_arbiter.engines.clipped_centroid` for many samples at a time, equal to the bit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.clipped_centroid import LARGER, TINY, Outline, centroid, outline
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


def _clipped_centroids(cuts: Array, shape: Outline) -> Array:
    """Return the centroids of clipped terms, joined by their maximum, for many samples."""
    n = cuts.shape[1]
    area, moment = np.zeros(n), np.zeros(n)
    for piece in range(len(shape.breakpoints) - 1):
        width = shape.breakpoints[piece + 1] - shape.breakpoints[piece]
        start = shape.breakpoints[piece] - shape.breakpoints[0]
        below: Array | None = None  # the highest cut of the lines above; None where there are none
        for line in shape.order[shape.first[piece] : shape.first[piece + 1]]:
            t = shape.term[line]
            band, lever = _band(shape.left[line], shape.right[line], below, cuts[t])
            area += width * band
            lever *= width
            if start:
                lever += start * band
            lever *= width
            moment += lever
            below = cuts[t] if below is None else np.maximum(below, cuts[t])
    return np.asarray(shape.breakpoints[0] + moment / area)


def _band(a: float, b: float, below: Array | None, cut: Array) -> tuple[Array, Array]:
    """Return area and moment of the band under a line from a to b between two heights, over a piece of the width 1."""
    low, high = min(a, b), max(a, b)  # a falling line is treated as the mirrored rising one
    h1 = np.minimum(cut, high)
    if below is None:
        if low == 0.0:  # half of all lines: nothing below them, and they begin at 0
            s1 = h1 / high
            band = s1 * h1 / 2
            lever = s1 * (s1 * (2 * h1)) / 6
            clipped_width = 1.0 - s1
            band += clipped_width * h1
            lever += clipped_width * (1.0 + s1) / 2 * h1
            return band, (lever if a < b else band - lever)
        h0 = y0 = np.minimum(cut, low)
        y1 = h1
    else:
        y0, y1 = np.maximum(np.minimum(cut, low), below), np.maximum(h1, below)
        h0, h1 = y0 - below, y1 - below
    if low == high:
        return h1, h1 / 2
    with np.errstate(over="ignore"):  # heights above a line that hardly rises may overflow, and are clipped
        s0, s1 = ((y - low) / (high - low) for y in (y0, y1))
    for fraction in (s0, s1):
        np.minimum(np.maximum(fraction, 0.0, out=fraction), 1.0, out=fraction)
    clipped_width, width = 1.0 - s1, s1 - s0
    band = width * (h0 + h1) / 2 + clipped_width * h1
    lever = width * (s0 * (2 * h0 + h1) + s1 * (h0 + 2 * h1)) / 6 + clipped_width * (1.0 + s1) / 2 * h1
    return band, (lever if a <= b else band - lever)


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
