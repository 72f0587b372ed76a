"""The bounded attraction: along the path, at a speed from which it can stop, with a bounded acceleration."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import length3, square
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planning.planner import PathPlan
from controller.linear_algebra import copy
from controller.stack_array import zeros

Array = NDArray[np.float64]

_AHEAD = 0.4  # m, lookahead distance along the path
_SLOWEST_CORNER = 0.25  # speed at corners of 120 degrees and more, as a fraction of the full speed


def approach_speed(distance: float, deceleration: float, slope: float) -> float:
    """Return the maximum speed [m/s] from which the vehicle can stop within a distance [m]."""
    # It is sqrt(2 a d), smoothed near 0, where it grows with `slope` [1/s]; the deceleration along it is below a.
    if distance <= 0.0:
        return slope * distance
    offset = deceleration / slope
    return float(np.sqrt(2.0 * deceleration * distance + offset * offset)) - offset


def desired_velocity(plan: PathPlan, position: Array, goal_velocity: Array, gains: DeployableGains, out: Array) -> None:
    """Write the velocity [m/s], NED, shape (3,), that follows the path from a position [m, NED], shape (3,)."""
    waits, path = plan.waits[0], plan.path
    count = 1 if waits else plan.counts[0]
    speed, remaining, traveled, heading = gains.speed, 0.0, 0.0, zeros(3)
    to_go, before = _AHEAD, zeros(3)
    for leg in range(count):
        length, direction = 0.0, zeros(3)
        for axis in range(3):
            direction[axis] = path[leg, axis] - (position[axis] if leg == 0 else path[leg - 1, axis])
            length += square(direction[axis])
        length = np.sqrt(length)
        if length > 0.0:
            for axis in range(3):
                direction[axis] /= length
        if leg > 0:  # slower round a corner
            turn = before[0] * direction[0] + before[1] * direction[1] + before[2] * direction[2]
            at_corner = gains.speed * max(_SLOWEST_CORNER, 0.5 * (1.0 + turn))
            speed = min(speed, np.sqrt(square(at_corner) + 2.0 * gains.acceleration * traveled))
        part = min(to_go, length)
        for axis in range(3):
            heading[axis] += part * direction[axis]
        to_go -= part
        traveled += length
        copy(direction, before)
    remaining = traveled
    speed = min(speed, approach_speed(remaining, gains.acceleration, gains.position_bandwidth))
    size = length3(heading[0], heading[1], heading[2])
    for axis in range(3):
        out[axis] = 0.0 if waits else goal_velocity[axis]
        if size > 1e-9:
            out[axis] += speed * heading[axis] / size


def desired_acceleration(desired: Array, velocity: Array, gains: DeployableGains, out: Array) -> None:
    """Write the acceleration [m/s2], NED, that brings the velocity to the desired one, bounded in length."""
    size = 0.0
    for axis in range(3):
        out[axis] = gains.velocity_bandwidth * (desired[axis] - velocity[axis])
        size += square(out[axis])
    size = np.sqrt(size)
    if size > gains.acceleration:
        for axis in range(3):
            out[axis] *= gains.acceleration / size
