"""Small compiled helpers shared by the shapes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import hypotenuse

Array = NDArray[np.float64]


def clamp(x: float, low: float, high: float) -> float:
    """Return `x` clipped to [low, high]."""
    return min(max(x, low), high)


def to_local(p: Array, q: Array, at: int) -> tuple[float, float, float]:
    """Return R^T (p - c) for a center packed at `at`, followed by a rotation matrix, row by row."""
    d0, d1, d2 = p[0] - q[at], p[1] - q[at + 1], p[2] - q[at + 2]
    R = at + 3
    return (
        q[R] * d0 + q[R + 3] * d1 + q[R + 6] * d2,
        q[R + 1] * d0 + q[R + 4] * d1 + q[R + 7] * d2,
        q[R + 2] * d0 + q[R + 5] * d1 + q[R + 8] * d2,
    )


def to_world(q: Array, at: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return R (x, y, z) for a rotation matrix packed at `at`."""
    return (
        q[at] * x + q[at + 1] * y + q[at + 2] * z,
        q[at + 3] * x + q[at + 4] * y + q[at + 5] * z,
        q[at + 6] * x + q[at + 7] * y + q[at + 8] * z,
    )


def product_distance(first: float, second: float) -> tuple[float, float, float]:
    """Return the signed distance to the product of two sets in perpendicular directions, and its derivatives."""
    # Units of arguments and result: first, second [m]; result [m]
    if math.isnan(first) or math.isnan(second):  # a lost position is not safe
        return math.nan, math.nan, math.nan
    if first > 0.0 and second > 0.0:
        distance = hypotenuse(first, second)
        return distance, first / distance, second / distance
    if first >= second:
        return first, 1.0, 0.0
    return second, 0.0, 1.0
