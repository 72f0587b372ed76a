"""The bounded attraction: along the way at a speed that can be braked, and no faster accelerated than is asked for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import part
from controller.jit.stack_array import zeros
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.path_planner import Guide

Array = NDArray[np.float64]

_AHEAD = 0.4  # m along the way, of the point that is headed for
_SLOWEST_CORNER = 0.25  # of the full speed, at a corner that turns right back


@part
def approach_speed(distance: float, deceleration: float, slope: float) -> float:
    """Return the speed [m/s] from which a distance [m] still suffices to stop.

    sqrt(2 a d), rounded off near 0, so that it grows with `slope` [1/s] there; the deceleration along it is below a.
    """
    if distance <= 0.0:
        return slope * distance
    offset = deceleration / slope
    return float(np.sqrt(2.0 * deceleration * distance + offset * offset)) - offset


@part
def wanted_velocity(guide: Guide, position: Array, goal_velocity: Array, gains: DeployableGains, out: Array) -> None:
    """Write the velocity [m/s], world frame, shape (3,), that follows the way; `position` is where the vehicle is."""
    count, way = guide.points[0], guide.way
    speed, left, travelled, towards = gains.speed, 0.0, 0.0, zeros(3)
    to_go, before = _AHEAD, zeros(3)
    for leg in range(count):
        length, direction = 0.0, zeros(3)
        for axis in range(3):
            direction[axis] = way[leg, axis] - (position[axis] if leg == 0 else way[leg - 1, axis])
            length += direction[axis] ** 2
        length = np.sqrt(length)
        if length > 0.0:
            for axis in range(3):
                direction[axis] /= length
        if leg > 0:  # slower round a corner
            turn = before[0] * direction[0] + before[1] * direction[1] + before[2] * direction[2]
            at_corner = gains.speed * max(_SLOWEST_CORNER, 0.5 * (1.0 + turn))
            speed = min(speed, np.sqrt(at_corner**2 + 2.0 * gains.acceleration * travelled))
        part = min(to_go, length)
        for axis in range(3):
            towards[axis] += part * direction[axis]
        to_go -= part
        travelled += length
        copy(direction, before)
    left = travelled
    speed = min(speed, approach_speed(left, gains.acceleration, gains.position_bandwidth))
    size = np.sqrt(towards[0] ** 2 + towards[1] ** 2 + towards[2] ** 2)
    for axis in range(3):
        out[axis] = goal_velocity[axis] + (speed * towards[axis] / size if size > 1e-9 else 0.0)


@part
def wanted_acceleration(wanted: Array, velocity: Array, gains: DeployableGains, out: Array) -> None:
    """Write the acceleration [m/s2], world frame, that brings the velocity to the wanted one, bounded in length."""
    size = 0.0
    for axis in range(3):
        out[axis] = gains.velocity_bandwidth * (wanted[axis] - velocity[axis])
        size += out[axis] ** 2
    size = np.sqrt(size)
    if size > gains.acceleration:
        for axis in range(3):
            out[axis] *= gains.acceleration / size
