"""What an ArduSub makes of sticks: each thruster adds what they ask of it, and rates begin beyond dead zones."""

from __future__ import annotations

import math

import numpy as np

from cosim.simulation.signals import Array
from plant_fmu import Vehicle

# parts of a stick's way at a pilot gain of 1 that ask for nothing
YAW_DEAD_ZONE = 0.1  # 40 of 400 us
CLIMB_DEAD_ZONE = 0.2  # THR_DZ: 100 of 500
_MOSTLY = 0.6  # of the greatest part that a thruster has in an axis, from which on it works for that axis


class MotorMixer:
    """Adds what full sticks ask of each thruster, 1, 0 or -1 of its greatest force, and squares the sum.

    Parameters
    ----------
    vehicle : Vehicle
        Its thrusters, their limits, and as its table ``autopilot`` says whether their force goes with the square.

    Attributes
    ----------
    asked : ndarray, shape (n, 6)
        Of each thruster by a full stick of each axis.
    greatest : ndarray, shape (n,)
        Force of each thruster [N], the mean of both ways.
    is_quadratic : bool
        Whether it squares.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self._matrix, table = vehicle.thruster_matrix, vehicle.autopilot
        size = np.abs(self._matrix)
        self.asked: Array = np.where(size > _MOSTLY * size.max(axis=1, keepdims=True), np.sign(self._matrix), 0.0).T
        self.greatest: Array = 0.5 * (vehicle.thrust_max - vehicle.thrust_min)
        self.is_quadratic = table is not None and table.curve == "quadratic"

    def wrench(self, sticks: Array) -> Array:
        """Return the wrench, shape (6,) [N, N m], that sticks of X Y Z K M N give, as the gain has scaled them."""
        sums = np.clip(self.asked @ sticks, -1.0, 1.0)
        result: Array = self._matrix @ (self.greatest * (sums * np.abs(sums) if self.is_quadratic else sums))
        return result


def beyond_dead_zone(deflection: float, dead_zone: float) -> float:
    """Return the part of a full rate that a stick asks for.

    Parameters
    ----------
    deflection : float
        Of the stick, times the gain that scales it, -1 to 1.
    dead_zone : float
        Part of the way that asks for nothing, below 1.

    Returns
    -------
    float
        -1 to 1; 0 within the dead zone, and straight from its end on.

    Examples
    --------
    >>> from cosim.mavlink.vehicle.sticks import beyond_dead_zone, deflection_of
    >>> beyond_dead_zone(0.1, 0.2), round(beyond_dead_zone(deflection_of(-0.3, 0.2), 0.2), 6)
    (0.0, -0.3)
    """
    beyond = abs(deflection) - dead_zone
    return math.copysign(beyond / (1.0 - dead_zone), deflection) if beyond > 0.0 else 0.0


def deflection_of(part: float, dead_zone: float) -> float:
    """Return the deflection that asks for a part of a full rate: the inverse of `beyond_dead_zone`; 0 for 0."""
    return math.copysign(dead_zone + (1.0 - dead_zone) * abs(part), part) if part else 0.0
