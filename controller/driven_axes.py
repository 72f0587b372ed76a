"""Axes that thrusters drive, and passive ones, which the righting moment holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.errors import LawError
from controller.force_limits import max_forces

Array = NDArray[np.float64]

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
ROLL, PITCH, YAW = 3, 4, 5
_PASSIVE_SETS: tuple[list[int], ...] = ([], [PITCH], [ROLL], [ROLL, PITCH])  # fewest axes first
_WEAK, _ZERO = 1e-2, 1e-6  # force or moment that is too weak, and 0, as a fraction of the greatest of a thruster
_SIGNED_AXES: Array = np.repeat(np.eye(3), 2, axis=0) * np.array([[1.0], [-1.0]] * 3)  # each of three axes both ways


def driven_both_ways(
    matrix: Array, lower: Array, upper: Array, passive: list[int], min_fraction: float
) -> NDArray[np.bool_]:
    """Return a mask (k, 6) of the axes that are passive, or driven both ways without any other; limits (k, m)."""
    # A force, or a moment, is compared with the greatest one of a thruster.
    B = matrix.copy()
    B[passive] = 0.0
    parts = (B, np.roll(B, 3, axis=0))
    ends = np.concatenate([max_forces(rows, lower, upper, _SIGNED_AXES) for rows in parts], axis=-1)
    limit = np.abs([lower, upper]).max()
    sizes = limit * np.repeat([np.linalg.norm(part, axis=0).max() for part in (matrix[:3], matrix[3:])], 3)
    weakest = np.nan_to_num(ends).reshape(*lower.shape[:-1], 6, 2).min(axis=-1)
    driven: NDArray[np.bool_] = weakest > min_fraction * sizes
    driven[..., passive] = True
    return driven


def passive_axes(matrix: Array, lower: Array, upper: Array) -> list[list[int] | None]:
    """Return the passive axes for each row of limits (k, m); None: that is not enough."""
    result: list[list[int] | None] = [None] * len(lower)
    for min_fraction in (_WEAK, _ZERO):
        for passive in _PASSIVE_SETS:
            if None not in result:
                break
            enough = [bool(driven.all()) for driven in driven_both_ways(matrix, lower, upper, passive, min_fraction)]
            result = [passive if axes is None and ok else axes for axes, ok in zip(result, enough, strict=True)]
    return result


def require_driven(matrix: Array, lower: Array, upper: Array, righting_moment: float) -> list[int]:
    """Return the passive axes; raise `LawError` for other undriven ones, or without a righting moment [N m]."""
    passive = undriven_axes(matrix, lower, upper)
    if not {ROLL, PITCH} >= set(passive):
        raise LawError(
            f"thrusters.matrix with its limits does not drive {join_axes(passive)} both ways, or too weakly, expected "
            "all axes but roll and pitch, which the righting moment may hold"
        )
    if passive and not righting_moment > 0.0:
        raise LawError(
            f"thrusters.matrix does not drive {join_axes(passive)} both ways, or too weakly, and the righting moment "
            f"is {righting_moment:.3g} N m, expected more than 0: the center of buoyancy above the center of gravity"
        )
    return passive


def undriven_axes(matrix: Array, lower: Array, upper: Array) -> list[int]:
    """Return the axes that thrusters do not drive: the passive ones, or if that is not enough, the others."""
    (passive,) = passive_axes(matrix, lower[None], upper[None])
    if passive is None:
        return np.flatnonzero(~driven_both_ways(matrix, lower[None], upper[None], _PASSIVE_SETS[-1], _ZERO)[0]).tolist()
    return passive


def add_righting(matrix: Array, lower: Array, upper: Array, moment: float) -> tuple[Array, Array, Array]:
    """Return matrix and limits (k, m) with the righting moment [N m] as a further thruster for each passive axis."""
    passive = passive_axes(matrix, lower, upper)
    rights = moment * np.array([[axis in (axes or []) for axis in (ROLL, PITCH)] for axes in passive])
    return np.hstack([matrix, np.eye(6)[:, ROLL:YAW]]), np.hstack([lower, -rights]), np.hstack([upper, rights])


def join_axes(axes: list[int]) -> str:
    """Return the names of axes, such as roll and pitch."""
    *others, last = [AXES[axis] for axis in axes]
    return f"{', '.join(others)} and {last}" if others else last
