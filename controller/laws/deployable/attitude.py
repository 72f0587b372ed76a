"""Attitude: held by proportional and rate feedback, with the restoring moments adapted from the body rates."""

# Rates are measured well, so that their change over a period gives the acting moment: I omega' = tau - D omega - S(k)
# phi_{2..4} - nu_r x (M nu_r), where the fourth is Munk's moment, which added mass causes in oblique motion. The
# observer estimates from it the three moments of phi (12).
#
# The desired attitude is the preferred one unless a region of attitude requires another: if its clearance would be less
# than `comfort`, the desired attitude turns until it has that much, within the allowed tilt, and returns afterwards.

from __future__ import annotations

from typing import Annotated

import numpy as np

from controller.arithmetic import cosine
from controller.laws.deployable.estimate import Estimate
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Dynamics, Loads, free_wrench
from controller.linear_algebra import cross, norm
from controller.quaternion import down_in_body, error, multiply, rate
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, attitude_clearance
from controller.stack_array import Array, Matrix3, Shape, Vector3, Vector4, Vector6, array, zeros
from controller.state import State

Moments2 = Annotated[Array, Shape(3, 2)]

_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude
_RETURN = 0.2  # 1/s, rate of return to the preferred attitude
_CURRENT_STEP = 0.01  # m/s, step of the current in a difference quotient
_TURN = 4.0  # 1/s, turning rate per radian by which the clearance of a region of attitude is below `comfort`


class Attitude(State):
    """State of the attitude loop."""

    preferred: Vector4  # from body to world: attitude where no region requires another
    target: Vector4  # from body to world: preferred attitude of a mission, which turns steadily; NaN: none
    desired: Vector4  # from body to world: setpoint of the loop
    last_omega: Vector3  # rad/s, body rates of the last step
    by_current: Moments2  # N s, derivative of the modeled moment by the current, north and east
    measured_moment: Vector3  # N m, body axes: moment of thrusters and weight over the last period
    started: float  # 1 if `last_omega` was measured in the last step, else 0


def empty_attitude(preferred: Array) -> Attitude:
    """Return the state before the first step, for a preferred attitude, shape (4,)."""
    return Attitude(preferred=preferred.copy(), desired=preferred.copy(), target=np.full(4, np.nan))


def measure_moment(
    attitude: Attitude, dynamics: Dynamics, R: Matrix3, omega: Vector3, estimate: Estimate, period: float
) -> bool:
    """Measure the moment of thrusters and weight by the change of the rates over the period [s]; omega [rad/s]."""
    started = bool(attitude.started > 0.0)
    mean, none = 0.5 * (attitude.last_omega + omega), zeros(3)
    loads = Loads(estimate.water_velocity, 0.0, none, 0.0, 0.0)  # weight and buoyancy are the unknowns
    wrench = free_wrench(dynamics, R, estimate.velocity, mean, loads)
    for axis in range(2):  # Munk's moment depends on the current
        water = estimate.water_velocity.copy()
        water[axis] += _CURRENT_STEP
        perturbed = free_wrench(dynamics, R, estimate.velocity, mean, loads._replace(water_velocity=water))
        attitude.by_current[:, axis] = (perturbed[3:] - wrench[3:]) / _CURRENT_STEP
    # nu_r' = R^T a - omega x nu_r
    nu_r = R.T @ (estimate.velocity - estimate.water_velocity)
    linear_rate = R.T @ estimate.acceleration - cross(mean, nu_r)
    rate = np.concatenate((linear_rate, (omega - attitude.last_omega) / period))
    attitude.measured_moment = dynamics.mass[3:] @ rate - wrench[3:]
    attitude.last_omega = omega
    attitude.started = 1.0
    return started


def update_desired(
    attitude: Attitude,
    regions: PackedRegions,
    position: Vector3,
    metric: Vector6,
    gains: DeployableGains,
    period: float,
) -> None:
    """Turn the desired attitude towards the preferred one, or until regions of attitude have their comfort."""
    # Units of arguments: position [m, NED]; period [s]. No turn about axes whose `metric`, as of `Thrusters`, is 0.
    if attitude.target[0] == attitude.target[0]:
        back = error(attitude.preferred, attitude.desired)
        if error(attitude.target, attitude.desired)[0] < back[0]:  # the preferred attitude would turn away: turn along
            turned = multiply(attitude.target, back)
            attitude.desired = turned / norm(turned)
        attitude.preferred = attitude.target
    e, gradient = error(attitude.preferred, attitude.desired), zeros(3)  # desired = preferred * back
    omega = -2.0 * _RETURN * e[1:]
    limited = False
    for i in range(regions.kinds.size):
        if regions.kinds[i] < _ATTITUDE:
            continue
        clearance = attitude_clearance(regions, i, position, attitude.desired, gradient)
        size = norm(gradient)
        if clearance < gains.comfort:
            limited = True
            if size > 0.0:
                omega += _TURN * (gains.comfort - clearance) / size * gradient
            elif clearance < 0.0:  # half a turn away all axes are equivalent: turn about the vertical
                omega += _TURN * (gains.comfort - clearance) * down_in_body(attitude.desired)
    if not limited and e[0] > 1.0 - 1e-15:
        return
    omega[:] = np.where(metric[3:] > 0.0, omega, 0.0)
    size = norm(omega)
    if size > gains.turning_rate:
        omega *= gains.turning_rate / size
    attitude.desired = integrate_attitude(attitude.desired, omega, period)
    # within the allowed tilt: only the turn about the vertical remains
    upright = down_in_body(attitude.desired)[2]
    if upright < cosine(gains.tilt) and upright < down_in_body(attitude.preferred)[2]:
        attitude.desired = integrate_attitude(attitude.desired, -omega, period)
        k = down_in_body(attitude.desired)
        attitude.desired = integrate_attitude(attitude.desired, (k @ omega) * k, period)


def integrate_attitude(quaternion: Vector4, omega: Vector3, period: float) -> Vector4:
    """Integrate a body rate [rad/s] over a period [s]."""
    e = quaternion + period * rate(quaternion, omega)
    return e / norm(e)


def compute_moment(
    attitude: Attitude,
    dynamics: Dynamics,
    quaternion: Vector4,
    omega: Vector3,
    free: Vector6,
    gains: DeployableGains,
) -> Vector3:
    """Return the desired moment [N m], body axes: it cancels the `free` wrench, except its damping."""
    e, w = error(attitude.desired, quaternion)[1:], gains.attitude_bandwidth
    inertia = array(dynamics.mass[3, 3], dynamics.mass[4, 4], dynamics.mass[5, 5])
    damping = (dynamics.linear_damping[3:] + dynamics.quadratic_damping[3:] * abs(omega)) * omega
    return -free[3:] - damping - 2.0 * inertia * w * (w * e + omega)
