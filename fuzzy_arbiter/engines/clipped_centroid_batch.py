"""The centroid of straight terms for one sample and for many, by the functions of `clipped_centroid`."""

from __future__ import annotations

from collections.abc import Sequence
from types import FunctionType
from typing import Any

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.clipped_centroid import LARGER, TINY, centroid, clipped, outline, scaled
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.shapes import Array


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
