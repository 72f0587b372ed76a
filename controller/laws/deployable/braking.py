"""The deceleration available in every direction, also with any one thruster lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.errors import LawError
from controller.force_limits import DIRECTIONS, max_forces
from controller.law import VehicleModel

Array = NDArray[np.float64]

_NEGLIGIBLE = 1e-6  # force that counts as zero, as a fraction of the greatest limit


def least_forces(vehicle: VehicleModel) -> Array:
    """Return the maximum force in the worst direction, with each thruster lost and with none, (m + 1,) [N]."""
    # Without any moment, over the 26 directions to faces, edges and corners of a cube in body axes: for the shipped
    # vehicles within 2 % of the least over all directions. If the remaining thrusters cannot push in every direction,
    # the force with none lost is returned instead.
    B, lower, upper = vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max
    works = ~np.eye(B.shape[1] + 1, B.shape[1], dtype=bool)
    forces: Array = np.nan_to_num(max_forces(B, lower * works, upper * works, DIRECTIONS).min(axis=1))
    negligible = _NEGLIGIBLE * np.abs(np.r_[lower, upper]).max()
    if not forces[-1] > negligible:
        raise LawError(
            f"{B.shape[1]} thrusters push {abs(forces[-1]):.3g} N in the worst direction without a moment, "
            "expected more than 0: the law needs forces in every direction to keep out of regions"
        )
    result: Array = np.where(forces > negligible, forces, forces[-1])
    return result
