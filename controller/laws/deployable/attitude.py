"""Attitude: held by proportional and rate feedback, with the restoring moments adapted from the body rates.

Rates are measured well, and a moment that the model lacks shows within a period: I omega' = tau - D omega -
S(k) phi_{2..4} - nu_r x (M nu_r) + residual, where the fourth is Munk's moment, which added mass causes in oblique
motion. The residual drives the three moments of phi (12), within their bounds.

The desired attitude is the preferred one unless a region of attitude asks for another: where its clearance would be
less than `comfort`, the desired attitude turns until it has that much, within the allowed tilt, and returns afterwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import cosine, length3, square
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy, product
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.quaternion import down_parts, error_parts, rate_parts
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, attitude_clearance
from controller.stack_array import zeros

Array = NDArray[np.float64]

_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on depend on attitude
_RETURN = 0.2  # 1/s, rate of return to the preferred attitude
_TURN = 4.0  # 1/s, rate of turning to where a region has its comfort


class Attitude(NamedTuple):
    """State of the attitude loop."""

    preferred: Array  # (4,) attitude where no region asks for another, from body to world
    desired: Array  # (4,) setpoint of the loop
    moments: Array  # (3,) phi_2..phi_4 [N m]
    last_omega: Array  # (3,) rad/s
    munk_moment: Array  # (3,) N m, Munk's moment, body axes
    residual: Array  # (3,) N m, moment that the model lacked in the last period, within the bound
    started: Array  # (1,) 1 once last_omega is there


def empty_attitude(preferred: Array) -> Attitude:
    """Return the state before the first step, for a preferred attitude, shape (4,)."""
    return Attitude(preferred.copy(), preferred.copy(), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(1))


def adapt(
    attitude: Attitude,
    dynamics: Dynamics,
    thrusters: Thrusters,
    quaternion: Array,
    omega: Array,
    gains: DeployableGains,
    period: float,
) -> None:
    """Adapt the restoring moments to the difference between measured and predicted rates.

    `omega` is in [rad/s], body axes, and the period in [s].
    """
    if attitude.started[0] > 0.0:
        wrench, k = zeros(6), zeros(3)
        product(thrusters.matrix, thrusters.forces, wrench)
        k[0], k[1], k[2] = down_parts(quaternion)
        phi, last, mass = attitude.moments, attitude.last_omega, dynamics.mass
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            damping = (dynamics.linear_damping[3 + i] + dynamics.quadratic_damping[3 + i] * abs(last[i])) * last[i]
            restoring = k[a] * phi[b] - k[b] * phi[a]  # S(k) phi: (12)
            change = 0.0
            for j in range(3):
                change += mass[3 + i, 3 + j] * (omega[j] - last[j]) / period
            missed = change - (wrench[3 + i] + attitude.munk_moment[i] - damping - restoring)
            attitude.residual[i] = min(max(missed, -gains.moment_bound), gains.moment_bound)
        for i in range(3):  # phi' = -rate S(k)^T residual
            a, b = (i + 1) % 3, (i + 2) % 3
            drive = k[a] * attitude.residual[b] - k[b] * attitude.residual[a]  # S(k) r = -S(k)^T r
            phi[i] += gains.adaptation * period * drive
            phi[i] = min(max(phi[i], -gains.moment_bound), gains.moment_bound)
    copy(omega, attitude.last_omega)
    attitude.started[0] = 1.0


def update_munk_moment(
    attitude: Attitude, dynamics: Dynamics, R: Array, velocity: Array, water_velocity: Array
) -> None:
    """Update Munk's moment from the velocities [m/s] of vehicle and water, shape (3,) each, NED."""
    relative, momentum = zeros(3), zeros(3)
    for i in range(3):
        for axis in range(3):
            relative[i] += R[axis, i] * (velocity[axis] - water_velocity[axis])
    for i in range(3):
        for j in range(3):
            momentum[i] += dynamics.mass[i, j] * relative[j]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        attitude.munk_moment[i] = relative[b] * momentum[a] - relative[a] * momentum[b]  # -nu_r x (M nu_r)


def update_desired(
    attitude: Attitude, regions: PackedRegions, position: Array, gains: DeployableGains, period: float
) -> None:
    """Turn the desired attitude towards the preferred one, or to where regions of attitude have their comfort.

    Parameters
    ----------
    attitude : Attitude
        `desired` is updated.
    regions : PackedRegions
        Those of attitude among them count, hard or soft.
    position : ndarray, shape (3,)
        Where the vehicle is [m, NED].
    gains : DeployableGains
        Comfort, tilt, turning rate.
    period : float
        [s].
    """
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
            elif clearance < 0.0:  # half a turn away, where all axes are as short: about the vertical
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


def free_angular_acceleration(
    attitude: Attitude, dynamics: Dynamics, quaternion: Array, omega: Array, out: Array
) -> None:
    """Write the angular acceleration without thrust, shape (3,) [rad/s2], body axes."""
    k, moments, momentum = zeros(3), zeros(3), zeros(3)
    k[0], k[1], k[2] = down_parts(quaternion)
    for i in range(3):
        for j in range(3):
            momentum[i] += dynamics.mass[3 + i, 3 + j] * omega[j]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        damping = (dynamics.linear_damping[3 + i] + dynamics.quadratic_damping[3 + i] * abs(omega[i])) * omega[i]
        restoring = k[a] * attitude.moments[b] - k[b] * attitude.moments[a]
        moments[i] = attitude.munk_moment[i] - damping - restoring - (omega[a] * momentum[b] - omega[b] * momentum[a])
    for i in range(3):
        out[i] = 0.0
        for j in range(3):
            out[i] += dynamics.inverse_mass[3 + i, 3 + j] * moments[j]


def compute_moment(
    attitude: Attitude, dynamics: Dynamics, quaternion: Array, omega: Array, gains: DeployableGains, out: Array
) -> None:
    """Write the desired moment, shape (3,) [N m], body axes."""
    e, k = zeros(4), zeros(3)
    e[0], e[1], e[2], e[3] = error_parts(attitude.desired, quaternion)
    k[0], k[1], k[2] = down_parts(quaternion)
    w = gains.attitude_bandwidth
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        inertia = dynamics.mass[3 + i, 3 + i]
        restoring = k[a] * attitude.moments[b] - k[b] * attitude.moments[a]
        out[i] = restoring - attitude.munk_moment[i] - 2.0 * inertia * w * w * e[1 + i] - 2.0 * inertia * w * omega[i]
