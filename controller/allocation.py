"""Allocate a body wrench to thruster forces within their limits."""

from __future__ import annotations

from typing import Literal

import numpy as np

from controller.arithmetic import square
from controller.driven_axes import passive_axes
from controller.errors import LawError
from controller.stack_array import Array, Vector6

_ROUNDING = 1e-12  # force that counts as 0, as a fraction of the maximum force


def _greatest(forces: Array) -> float:
    """Return the maximum magnitude [N]; NaN if a force is NaN."""
    greatest = 0.0
    for i in range(forces.size):
        if not abs(forces[i]) <= greatest:
            greatest = abs(forces[i])
            if np.isnan(greatest):
                break
    return greatest


def clip_each(forces: Array, lower: Array, upper: Array) -> bool:
    """Clip thruster forces [N], shape (n,), in place, each at its own limits; return True if any was beyond them."""
    # The direction of the wrench may change.
    cut, negligible = False, _ROUNDING * _greatest(forces)
    for i in range(forces.size):
        within = min(max(forces[i], lower[i]), upper[i])
        cut = cut or abs(within - forces[i]) > negligible
        forces[i] = within
    return cut


def keep_direction(forces: Array, lower: Array, upper: Array) -> bool:
    """Scale thruster forces [N], shape (n,), in place until all are within limits; return True if any was beyond."""
    # The wrench keeps its direction.
    scale, negligible = 1.0, _ROUNDING * _greatest(forces)
    for i in range(forces.size):
        if forces[i] > upper[i] and forces[i] > negligible:
            scale = min(scale, upper[i] / forces[i])
        elif forces[i] < lower[i] and forces[i] < -negligible:
            scale = min(scale, lower[i] / forces[i])
    forces *= scale
    clip_each(forces, lower, upper)  # for rounding in the last bit
    return scale < 1.0


def allocate(inverse: Array, lower: Array, upper: Array, direction: bool, tau: Vector6, forces: Array) -> bool:
    """Write the least-squares thruster forces for a wrench, within limits, into `forces`; lower, upper [N]."""
    # Units of arguments: tau [N, N m]; forces [N]
    forces[:] = inverse @ tau
    return keep_direction(forces, lower, upper) if direction else clip_each(forces, lower, upper)


def invert_curve(forces: Array, lower: Array, upper: Array, dead_band: Array, curve: Array) -> None:
    """Replace the forces of thrusters [N], shape (n,), by the commands [N] that give them; lower, upper [N]."""
    # A command of the fraction d + (1 - d) s of its limit gives the fraction s (1 - c + c s), with the vehicle's dead
    # band d and curve c. A force of 0 needs no command.
    for i in range(forces.size):
        limit = lower[i] if forces[i] < 0.0 else upper[i]
        if forces[i] == 0.0 or limit == 0.0 or (dead_band[i] == 0.0 and curve[i] == 0.0):
            continue
        fraction, linear = forces[i] / limit, 1.0 - curve[i]
        live = 2.0 * fraction / (linear + np.sqrt(square(linear) + 4.0 * curve[i] * fraction))
        forces[i] = limit * (dead_band[i] + (1.0 - dead_band[i]) * live)


class Allocation:
    """Thruster allocation by the pseudo-inverse, the least forces that give a wrench; lower, upper [N]."""

    # Thrusters whose limits are both 0 are left out. Forces of the pseudo-inverse are cut to the limits, and not
    # reallocated, so that one-sided thrusters (a limit of 0) stop every wrench that needs their other side. With
    # `rights` the vehicle rights itself: moments that thrusters cannot give alone are left out.

    def __init__(
        self,
        matrix: Array,
        lower: Array,
        upper: Array,
        limits: Literal["direction", "per-thruster"] = "direction",
        rights: bool = False,
    ) -> None:
        n = matrix.shape[1]
        if matrix.shape != (6, n) or lower.shape != (n,) or upper.shape != (n,):
            raise LawError(
                f"thruster matrix is {matrix.shape}, limits {lower.shape} and {upper.shape}: expected 6 by n, n"
            )
        if not (np.all(lower <= 0.0) and np.all(upper >= 0.0)):
            raise LawError("thruster limits leave out 0 N, expected lower <= 0 <= upper")
        if limits not in ("direction", "per-thruster"):
            raise LawError(f"limits is {limits!r}, expected 'direction' or 'per-thruster'")
        alive = (lower != 0.0) | (upper != 0.0)
        working = np.where(alive, matrix, 0.0)
        if rights:
            working[passive_axes(matrix, lower[None], upper[None])[0] or []] = 0.0
        inverse = np.ascontiguousarray(np.linalg.pinv(working))
        self.arguments = inverse, np.array(lower, dtype=float), np.array(upper, dtype=float), limits == "direction"

    def __call__(self, tau: Array, forces: Array) -> bool:
        """Write the thruster forces for a wrench into `forces`; tau (6,) [N, N m], forces (n,) [N]."""
        return bool(allocate(*self.arguments, tau, forces))
