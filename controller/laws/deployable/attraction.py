"""The bounded attraction: along the path, at a speed from which it can stop, with a bounded acceleration."""

from __future__ import annotations

import numpy as np

from controller.arithmetic import square
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planning.planner import PathPlan
from controller.linear_algebra import norm
from controller.stack_array import Vector3, zeros

_LOOKAHEAD = 0.4  # m, lookahead distance along the path
_SLOW_SPEED = 0.3  # m/s, desired speed below which the velocity's error is integrated
_DECAY_TIME = 5.0  # s, time constant at which the integral decays above that speed
_MAX_INTEGRAL = 0.5  # maximum integral, as a fraction of `acceleration`
_SLOWEST_CORNER = 0.25  # speed at corners of 120 degrees and more, as a fraction of the full speed


def approach_speed(distance: float, deceleration: float, slope: float) -> float:
    """Return the maximum speed [m/s] from which the vehicle can stop within a distance [m]."""
    # It is sqrt(2 a d), smoothed near 0, where it grows with `slope` [1/s]; the deceleration along it is below a.
    if distance <= 0.0:
        return slope * distance
    offset = deceleration / slope
    return float(np.sqrt(2.0 * deceleration * distance + offset * offset)) - offset


def desired_velocity(plan: PathPlan, position: Vector3, goal_velocity: Vector3, gains: DeployableGains) -> Vector3:
    """Return the velocity [m/s], NED, that follows the path from a position [m, NED]."""
    waits, path = plan.waits, plan.path
    count = 1 if waits else plan.points
    speed, traveled, to_go = gains.speed, 0.0, _LOOKAHEAD
    heading, before = zeros(3), zeros(3)
    for leg in range(count):
        direction = path[leg] - (position if leg == 0 else path[leg - 1])
        length = norm(direction)
        if length > 0.0:
            direction /= length
        if leg > 0:  # slower round a corner
            at_corner = gains.speed * max(_SLOWEST_CORNER, 0.5 * (1.0 + before @ direction))
            speed = min(speed, np.sqrt(square(at_corner) + 2.0 * gains.acceleration * traveled))
        part = min(to_go, length)
        heading += part * direction
        to_go -= part
        traveled += length
        before[:] = direction
    speed = min(speed, approach_speed(traveled, gains.acceleration, gains.position_bandwidth))
    size = norm(heading)
    along = speed * heading / size if size > 1e-9 else zeros(3)
    return along if waits else goal_velocity + along


def desired_acceleration(desired: Vector3, velocity: Vector3, gains: DeployableGains) -> Vector3:
    """Return the acceleration [m/s2], NED, that brings the velocity to the desired one, bounded in length."""
    acceleration = gains.velocity_bandwidth * (desired - velocity)
    size = norm(acceleration)
    return gains.acceleration / size * acceleration if size > gains.acceleration else acceleration


def integrate_error(
    integral: Vector3, desired: Vector3, velocity: Vector3, gains: DeployableGains, period: float
) -> None:
    """Integrate the velocity's error at low speed into an acceleration [m/s2], NED, against an unknown force."""
    if norm(desired) < _SLOW_SPEED:
        integral += period * gains.integral * (desired - velocity)
    else:
        integral *= 1.0 - min(period / _DECAY_TIME, 1.0)
    size, max_size = norm(integral), _MAX_INTEGRAL * gains.acceleration
    if size > max_size:
        integral *= max_size / size
