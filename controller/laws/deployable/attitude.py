"""Attitude: held by proportional and rate feedback, with the restoring moments adapted from the body rates."""

# Rates are measured well, so that their change over a period gives the acting moment: I omega' = tau - D omega - S(k)
# phi_{2..4} - nu_r x (M nu_r), where the fourth is Munk's moment, which added mass causes in oblique motion. The
# observer estimates from it the three moments of phi (12).
#
# The desired attitude is the preferred one unless a region of attitude requires another: if its clearance would be less
# than `comfort`, the desired attitude turns until it has that much, within the allowed tilt, and returns afterwards.

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import cosine, length3, square
from controller.laws.deployable.estimate import Estimate
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Dynamics, Loads, free_wrench
from controller.linear_algebra import copy
from controller.quaternion import down_parts, error_parts, rate_parts
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, attitude_clearance
from controller.stack_array import zeros

Array = NDArray[np.float64]

_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude
_RETURN = 0.2  # 1/s, rate of return to the preferred attitude
_CURRENT_STEP = 0.01  # m/s, step of the current in a difference quotient
_TURN = 4.0  # 1/s, turning rate per radian by which the clearance of a region of attitude is below `comfort`


class Attitude(NamedTuple):
    """State of the attitude loop."""

    preferred: Array  # (4,) from body to world: attitude where no region requires another
    desired: Array  # (4,) from body to world: setpoint of the loop
    last_omega: Array  # (3,) rad/s, body rates of the last step
    by_current: Array  # (3, 2) N s, derivative of the modeled moment by the current, north and east
    measured_moment: Array  # (3,) N m, body axes: moment of thrusters and weight over the last period
    started: Array  # (1,) 1 if `last_omega` was measured in the last step, else 0


def empty_attitude(preferred: Array) -> Attitude:
    """Return the state before the first step, for a preferred attitude, shape (4,)."""
    return Attitude(preferred.copy(), preferred.copy(), np.zeros(3), np.zeros((3, 2)), np.zeros(3), np.zeros(1))


def measure_moment(
    attitude: Attitude,
    dynamics: Dynamics,
    R: Array,
    omega: Array,
    estimate: Estimate,
    period: float,
) -> bool:
    """Measure the moment of thrusters and weight by the change of the rates over the period [s]; omega [rad/s]."""
    started = bool(attitude.started[0] > 0.0)
    mean, water, wrench, perturbed_wrench, rate = zeros(3), zeros(3), zeros(6), zeros(6), zeros(6)
    loads = Loads(water, zeros(1), zeros(3))  # only the current: weight and buoyancy are the unknowns
    copy(estimate.water_velocity, water)
    for i in range(3):
        mean[i] = 0.5 * (attitude.last_omega[i] + omega[i])
    free_wrench(dynamics, R, estimate.velocity, mean, loads, wrench)
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        rate[3 + i] = (omega[i] - attitude.last_omega[i]) / period
        for k in range(3):  # nu_r' = R^T a - omega x nu_r
            turning = R[k, a] * mean[b] - R[k, b] * mean[a]
            rate[i] += R[k, i] * estimate.acceleration[k] + turning * (
                estimate.velocity[k] - estimate.water_velocity[k]
            )
    for axis in range(2):  # Munk's moment depends on the current
        copy(estimate.water_velocity, water)
        water[axis] += _CURRENT_STEP
        free_wrench(dynamics, R, estimate.velocity, mean, loads, perturbed_wrench)
        for i in range(3):
            attitude.by_current[i, axis] = (perturbed_wrench[3 + i] - wrench[3 + i]) / _CURRENT_STEP
    for i in range(3):
        attitude.measured_moment[i] = -wrench[3 + i]
        for j in range(6):
            attitude.measured_moment[i] += dynamics.mass[3 + i, j] * rate[j]
    copy(omega, attitude.last_omega)
    attitude.started[0] = 1.0
    return started


def update_desired(
    attitude: Attitude, regions: PackedRegions, position: Array, gains: DeployableGains, period: float
) -> None:
    """Turn the desired attitude towards the preferred one, or until regions of attitude have their comfort."""
    # with position [m, NED], period [s]
    error, omega, gradient, k = zeros(4), zeros(3), zeros(3), zeros(3)
    error[0], error[1], error[2], error[3] = error_parts(attitude.preferred, attitude.desired)
    for axis in range(3):  # desired = preferred * back
        omega[axis] = -2.0 * _RETURN * error[1 + axis]
    limited = False
    for i in range(regions.kinds.size):
        if regions.kinds[i] < _ATTITUDE:
            continue
        clearance = attitude_clearance(regions, i, position, attitude.desired, gradient)
        size = length3(gradient[0], gradient[1], gradient[2])
        if clearance < gains.comfort:
            limited = True
            if size > 0.0:
                _add_scaled(_TURN * (gains.comfort - clearance) / size, gradient, omega)
            elif clearance < 0.0:  # half a turn away all axes are equivalent: turn about the vertical
                k[0], k[1], k[2] = down_parts(attitude.desired)
                _add_scaled(_TURN * (gains.comfort - clearance), k, omega)
    if not limited and error[0] > 1.0 - 1e-15:
        return
    size = length3(omega[0], omega[1], omega[2])
    if size > gains.turning_rate:
        for axis in range(3):
            omega[axis] *= gains.turning_rate / size
    integrate_attitude(attitude.desired, omega, period, attitude.desired)
    # within the allowed tilt: only the turn about the vertical remains
    upright = down_parts(attitude.desired)[2]
    if upright < cosine(gains.tilt) and upright < down_parts(attitude.preferred)[2]:
        for axis in range(3):
            omega[axis] = -omega[axis]
        integrate_attitude(attitude.desired, omega, period, attitude.desired)
        k[0], k[1], k[2] = down_parts(attitude.desired)
        along = -(k[0] * omega[0] + k[1] * omega[1] + k[2] * omega[2])
        for axis in range(3):
            omega[axis] = along * k[axis]
        integrate_attitude(attitude.desired, omega, period, attitude.desired)


def _add_scaled(scale: float, values: Array, out: Array) -> None:
    """Add `scale` times the values, shape (3,), to `out`."""
    for axis in range(3):
        out[axis] += scale * values[axis]


def integrate_attitude(quaternion: Array, omega: Array, period: float, out: Array) -> None:
    """Integrate a body rate [rad/s] over a period [s] into `out`, shape (4,), which may be `quaternion` itself."""
    rate = rate_parts(quaternion, omega)
    for i in range(4):
        out[i] = quaternion[i] + period * rate[i]
    length = np.sqrt(square(out[0]) + square(out[1]) + square(out[2]) + square(out[3]))
    for i in range(4):
        out[i] /= length


def compute_moment(
    attitude: Attitude,
    dynamics: Dynamics,
    quaternion: Array,
    omega: Array,
    free: Array,
    gains: DeployableGains,
    out: Array,
) -> None:
    """Write the desired moment, shape (3,) [N m], body axes: cancels the `free` wrench, except its damping."""
    e = zeros(4)
    e[0], e[1], e[2], e[3] = error_parts(attitude.desired, quaternion)
    w = gains.attitude_bandwidth
    for i in range(3):
        damping = (dynamics.linear_damping[3 + i] + dynamics.quadratic_damping[3 + i] * abs(omega[i])) * omega[i]
        inertia = dynamics.mass[3 + i, 3 + i]
        out[i] = -free[3 + i] - damping - 2.0 * inertia * w * (w * e[1 + i] + omega[i])
