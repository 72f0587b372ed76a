"""The deceleration available in every direction, also with any one thruster lost, and the speed that keeps upright."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.driven_axes import PITCH, add_righting, passive_axes, require_driven
from controller.errors import LawError
from controller.force_limits import DIRECTIONS, max_forces
from controller.law import VehicleModel

Array = NDArray[np.float64]

UNLIMITED = 1e3  # m/s, a speed that no vehicle reaches
_NEGLIGIBLE = 1e-6  # force that counts as zero, as a fraction of the greatest limit
_FRACTION = 0.5  # fraction of the righting moment at the greatest tilt for thrusters, and for Munk's moment


def min_forces(vehicle: VehicleModel, tilt: float) -> Array:
    """Return the maximum force in the worst direction, with each thruster lost and with none, (m + 1,) [N]."""
    # Without any moment, but for axes that are left to the righting moment: there up to what tilts the vehicle by
    # `tilt` [rad]. Over the 26 directions to faces, edges and corners of a cube in body axes: for the shipped vehicles
    # within 2 % of the least over all directions. If the remaining thrusters cannot push in every direction, the force
    # with none lost is returned instead.
    B, lower, upper = vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max
    works = ~np.eye(B.shape[1] + 1, B.shape[1], dtype=bool)
    lower, upper = lower * works, upper * works
    require_driven(B, vehicle.thrust_min, vehicle.thrust_max, vehicle.righting_moment)
    if vehicle.righting_moment > 0.0:
        B, lower, upper = add_righting(B, lower, upper, _tilting_moment(vehicle, tilt))
    forces: Array = np.nan_to_num(max_forces(B, lower, upper, DIRECTIONS).min(axis=1))
    negligible = _NEGLIGIBLE * np.abs([vehicle.thrust_min, vehicle.thrust_max]).max()
    if not forces[-1] > negligible:
        raise LawError(
            f"{works.shape[1]} thrusters push {abs(forces[-1]):.3g} N in the worst direction, with law.gains.tilt "
            f"{tilt:.3g} rad, expected more than 0: the law needs forces in every direction to keep out of regions"
        )
    result: Array = np.where(forces > negligible, forces, forces[-1])
    return result


def max_upright_speed(vehicle: VehicleModel, tilt: float) -> float:
    """Return the maximum speed [m/s] through water at which a vehicle that rights itself stays within `tilt` [rad]."""
    # Munk's moment about pitch is (Z_w' - X_u') u w of the added masses, at most half their difference times the
    # squared speed; so is it about roll with Y_v'. It counts for axes that are left, with any one thruster lost.
    if not vehicle.righting_moment > 0.0:
        return UNLIMITED
    B, A = vehicle.thruster_matrix, np.diag(vehicle.added_mass)
    works = ~np.eye(B.shape[1] + 1, B.shape[1], dtype=bool)
    left = passive_axes(B, vehicle.thrust_min * works, vehicle.thrust_max * works)
    difference = max((abs(A[PITCH - axis] - A[2]) for axes in left for axis in axes or []), default=0.0)
    return float(np.sqrt(2.0 * _tilting_moment(vehicle, tilt) / difference)) if difference > 0.0 else UNLIMITED


def _tilting_moment(vehicle: VehicleModel, tilt: float) -> float:
    """Return the moment [N m] against the righting moment that each of thrusters and water may have."""
    return float(_FRACTION * np.sin(min(tilt, np.pi / 2.0)) * vehicle.righting_moment)
