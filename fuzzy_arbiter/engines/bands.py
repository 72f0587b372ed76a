"""The algorithm of `fuzzy_arbiter.engines.sweep` for many samples at a time, equal to the bit."""

from __future__ import annotations

import numpy as np

from fuzzy_arbiter.engines.sweep import Outline
from fuzzy_arbiter.shapes import Array


def centroids(cuts: Array, shape: Outline) -> Array:
    """Return the centroids of clipped terms, joined by their maximum, for many samples."""
    n = cuts.shape[1]
    area, moment = np.zeros(n), np.zeros(n)
    for piece in range(len(shape.places) - 1):
        width = shape.places[piece + 1] - shape.places[piece]
        start = shape.places[piece] - shape.places[0]
        below: Array | None = None  # the greatest cut of the lines above; None where there are none
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
    return np.asarray(shape.places[0] + moment / area)


def _band(a: float, b: float, below: Array | None, cut: Array) -> tuple[Array, Array]:
    """Return area and moment of the band under a line from a to b between two heights, over a piece of the width 1."""
    low, high = min(a, b), max(a, b)  # a falling line is treated as the mirrored rising one
    h1 = np.minimum(cut, high)
    if below is None:
        if low == 0.0:  # half of all lines: nothing below them, and they begin at 0
            s1 = h1 / high
            band = s1 * h1 / 2
            lever = s1 * (s1 * (2 * h1)) / 6
            rest = 1.0 - s1
            band += rest * h1
            lever += rest * (1.0 + s1) / 2 * h1
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
    for share in (s0, s1):
        np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share)
    rest, width = 1.0 - s1, s1 - s0
    band = width * (h0 + h1) / 2 + rest * h1
    lever = width * (s0 * (2 * h0 + h1) + s1 * (h0 + 2 * h1)) / 6 + rest * (1.0 + s1) / 2 * h1
    return band, (lever if a <= b else band - lever)
