"""Axes that thrusters drive, and those that are left to the righting moment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.errors import LawError
from controller.force_limits import max_forces

Array = NDArray[np.float64]

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
ROLL, PITCH, YAW = 3, 4, 5
_LEFT: tuple[list[int], ...] = ([], [PITCH], [ROLL], [ROLL, PITCH])  # what may be left, the fewest axes first
_WEAK, _NOTHING = 1e-2, 1e-6  # force or moment that is too weak, and 0, as a fraction of the greatest of a thruster
_WAYS: Array = np.repeat(np.eye(3), 2, axis=0) * np.array([[1.0], [-1.0]] * 3)  # both ways along each of three axes


def driven_both_ways(matrix: Array, lower: Array, upper: Array, left: list[int], least: float) -> NDArray[np.bool_]:
    """Return True for each axis that is left, or driven both ways without any other; limits (k, m), returns (k, 6)."""
    # A force, or a moment, is compared with the greatest one of a thruster.
    B = matrix.copy()
    B[left] = 0.0
    ends = np.concatenate([max_forces(rows, lower, upper, _WAYS) for rows in (B, np.roll(B, 3, axis=0))], axis=-1)
    limit = np.abs([lower, upper]).max()
    sizes = limit * np.repeat([np.linalg.norm(part, axis=0).max() for part in (matrix[:3], matrix[3:])], 3)
    driven: NDArray[np.bool_] = np.nan_to_num(ends).reshape(*lower.shape[:-1], 6, 2).min(axis=-1) > least * sizes
    driven[..., left] = True
    return driven


def left_axes(matrix: Array, lower: Array, upper: Array) -> list[list[int] | None]:
    """Return the axes to leave to the righting moment for each row of limits (k, m); None: that is not enough."""
    result: list[list[int] | None] = [None] * len(lower)
    for least in (_WEAK, _NOTHING):
        for left in _LEFT:
            if None not in result:
                break
            enough = [bool(driven.all()) for driven in driven_both_ways(matrix, lower, upper, left, least)]
            result = [left if axes is None and ok else axes for axes, ok in zip(result, enough, strict=True)]
    return result


def require_driven(matrix: Array, lower: Array, upper: Array, righting_moment: float) -> list[int]:
    """Return the axes left to the righting moment [N m]; raise `LawError` if there are others, or none of it."""
    left = undriven_axes(matrix, lower, upper)
    if not {ROLL, PITCH} >= set(left):
        raise LawError(
            f"thrusters.matrix with its limits does not drive {join_axes(left)} both ways, expected all axes but "
            "roll and pitch, which the righting moment may hold"
        )
    if left and not righting_moment > 0.0:
        raise LawError(
            f"thrusters.matrix does not drive {join_axes(left)} both ways, and the righting moment is "
            f"{righting_moment:.3g} N m, expected more than 0: the center of buoyancy above the center of gravity"
        )
    return left


def undriven_axes(matrix: Array, lower: Array, upper: Array) -> list[int]:
    """Return the axes that thrusters do not drive: those to leave, or if that is not enough, the others."""
    (left,) = left_axes(matrix, lower[None], upper[None])
    if left is None:
        return np.flatnonzero(~driven_both_ways(matrix, lower[None], upper[None], _LEFT[-1], _NOTHING)[0]).tolist()
    return left


def add_righting(matrix: Array, lower: Array, upper: Array, moment: float) -> tuple[Array, Array, Array]:
    """Return matrix and limits (k, m) with a moment [N m] of righting as two further thrusters, where axes are left."""
    left = left_axes(matrix, lower, upper)
    rights = moment * np.array([[axis in (axes or []) for axis in (ROLL, PITCH)] for axes in left])
    return np.hstack([matrix, np.eye(6)[:, ROLL:YAW]]), np.hstack([lower, -rights]), np.hstack([upper, rights])


def join_axes(axes: list[int]) -> str:
    """Return the names of axes, such as roll and pitch."""
    *others, last = [AXES[axis] for axis in axes]
    return f"{', '.join(others)} and {last}" if others else last
