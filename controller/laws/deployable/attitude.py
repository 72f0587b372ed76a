"""Attitude: held by proportional and rate feedback, with the restoring moments adapted from the body rates.

The rates are measured well, so what the model misses of a moment shows within one period: I omega' = tau - D omega -
S(k) phi_{2..4} - nu_r x (M nu_r) + residual, where the fourth is what added mass makes of motion askew (Munk's moment).
The residual drives the three moments of phi (12), within their bounds.

The attitude that is held is the preferred one unless a region asks for another: where a region of attitude would have
less than some comfort there, the held attitude is turned until it has, no more tilted than is allowed, and drifts back
when it may.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import compiled, part
from controller.jit.stack_array import zeros
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy, product
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.quaternion import down_parts, error_parts
from controller.quaternion import rate as quaternion_rate
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, attitude_clearance

Array = NDArray[np.float64]

_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on depend on attitude
_RETURN = 0.2  # 1/s, at which the held attitude goes back to the preferred one
_TURN = 4.0  # 1/s, at which it turns to where a region has comfort


class Attitude(NamedTuple):
    """What is kept of the attitude loop."""

    preferred: Array  # (4,) attitude to be kept where no region asks for another, from body to world
    desired: Array  # (4,) attitude that is held
    moments: Array  # (3,) phi_2..phi_4 [N m]
    last_omega: Array  # (3,) rad/s
    carried: Array  # (3,) N m, Munk's moment, body axes
    residual: Array  # (3,) N m, moment that the model missed in the last period, within the bound
    known: Array  # (1,) 1 once last_omega is there


def attitude_of(preferred: Array) -> Attitude:
    """Return the loop's memory before the first step, for an attitude to be kept, shape (4,)."""
    return Attitude(preferred.copy(), preferred.copy(), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(1))


@part
def adapt(
    attitude: Attitude,
    dynamics: Dynamics,
    thrusters: Thrusters,
    quaternion: Array,
    omega: Array,
    gains: DeployableGains,
    period: float,
) -> None:
    """Compare the rates with what the last forces should have made of them, and learn the restoring moments.

    `omega` is in [rad/s], body axes, and the period in [s].
    """
    if attitude.known[0] > 0.0:
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
            missed = change - (wrench[3 + i] + attitude.carried[i] - damping - restoring)
            attitude.residual[i] = min(max(missed, -gains.moment_bound), gains.moment_bound)
        for i in range(3):  # phi' = -rate S(k)^T residual
            a, b = (i + 1) % 3, (i + 2) % 3
            drive = k[a] * attitude.residual[b] - k[b] * attitude.residual[a]  # S(k) r = -S(k)^T r
            phi[i] += gains.adaptation * period * drive
            phi[i] = min(max(phi[i], -gains.moment_bound), gains.moment_bound)
    copy(omega, attitude.last_omega)
    attitude.known[0] = 1.0


@part
def propagate(attitude: Attitude, dynamics: Dynamics, R: Array, velocity: Array, water: Array) -> None:
    """Bring Munk's moment up to date with the velocities [m/s] of vehicle and water, shape (3,) each, NED."""
    relative, momentum = zeros(3), zeros(3)
    for i in range(3):
        for axis in range(3):
            relative[i] += R[axis, i] * (velocity[axis] - water[axis])
    for i in range(3):
        for j in range(3):
            momentum[i] += dynamics.mass[i, j] * relative[j]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        attitude.carried[i] = relative[b] * momentum[a] - relative[a] * momentum[b]  # -nu_r x (M nu_r)


@part
def aim(attitude: Attitude, regions: PackedRegions, position: Array, gains: DeployableGains, period: float) -> None:
    """Turn the held attitude towards the preferred one, or to where regions of attitude have comfort.

    Parameters
    ----------
    attitude : Attitude
        `desired` is updated.
    regions : PackedRegions
        Those of attitude among them are heeded, hard or soft.
    position : ndarray, shape (3,)
        Where the vehicle is [m, NED].
    gains : DeployableGains
        Comfort, tilt, turning rate.
    period : float
        [s].
    """
    back, omega, slope, k = zeros(4), zeros(3), zeros(3), zeros(3)
    back[0], back[1], back[2], back[3] = error_parts(attitude.preferred, attitude.desired)
    for axis in range(3):  # desired = preferred * back
        omega[axis] = -2.0 * _RETURN * back[1 + axis]
    asked = False
    for i in range(regions.kinds.size):
        if regions.kinds[i] < _ATTITUDE:
            continue
        clearance = attitude_clearance(regions, i, position, attitude.desired, slope)
        size = np.sqrt(slope[0] ** 2 + slope[1] ** 2 + slope[2] ** 2)
        if clearance < gains.comfort:
            asked = True
            if size > 0.0:
                _add(_TURN * (gains.comfort - clearance) / size, slope, omega)
            elif clearance < 0.0:  # half a turn away, where every way round is as long: about the vertical
                k[0], k[1], k[2] = down_parts(attitude.desired)
                _add(_TURN * (gains.comfort - clearance), k, omega)
    if not asked and back[0] > 1.0 - 1e-15:
        return
    size = np.sqrt(omega[0] ** 2 + omega[1] ** 2 + omega[2] ** 2)
    if size > gains.turning_rate:
        for axis in range(3):
            omega[axis] *= gains.turning_rate / size
    turn(attitude.desired, omega, period, attitude.desired)
    # no more tilted than allowed: what is left of the turn is that about the vertical
    upright = down_parts(attitude.desired)[2]
    if upright < np.cos(gains.tilt) and upright < down_parts(attitude.preferred)[2]:
        for axis in range(3):
            omega[axis] = -omega[axis]
        turn(attitude.desired, omega, period, attitude.desired)
        k[0], k[1], k[2] = down_parts(attitude.desired)
        along = -(k[0] * omega[0] + k[1] * omega[1] + k[2] * omega[2])
        for axis in range(3):
            omega[axis] = along * k[axis]
        turn(attitude.desired, omega, period, attitude.desired)


@part
def _add(scale: float, values: Array, out: Array) -> None:
    """Add `scale` times the values, shape (3,), to `out`."""
    for axis in range(3):
        out[axis] += scale * values[axis]


@compiled
def turn(quaternion: Array, omega: Array, period: float, out: Array) -> None:
    """Write the attitude to which a body rate [rad/s] leads in a period [s] into `out`, which may be the first."""
    rate = quaternion_rate(quaternion, omega)
    for i in range(4):
        out[i] = quaternion[i] + period * rate[i]
    length = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    for i in range(4):
        out[i] /= length


@part
def free_turning(attitude: Attitude, dynamics: Dynamics, quaternion: Array, omega: Array, out: Array) -> None:
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
        moments[i] = attitude.carried[i] - damping - restoring - (omega[a] * momentum[b] - omega[b] * momentum[a])
    for i in range(3):
        out[i] = 0.0
        for j in range(3):
            out[i] += dynamics.inverse_mass[3 + i, 3 + j] * moments[j]


@part
def moment(
    attitude: Attitude, dynamics: Dynamics, quaternion: Array, omega: Array, gains: DeployableGains, out: Array
) -> None:
    """Write the wanted moment, shape (3,) [N m], body axes."""
    e, k = zeros(4), zeros(3)
    e[0], e[1], e[2], e[3] = error_parts(attitude.desired, quaternion)
    k[0], k[1], k[2] = down_parts(quaternion)
    w = gains.attitude_bandwidth
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        inertia = dynamics.mass[3 + i, 3 + i]
        restoring = k[a] * attitude.moments[b] - k[b] * attitude.moments[a]
        out[i] = restoring - attitude.carried[i] - 2.0 * inertia * w * w * e[1 + i] - 2.0 * inertia * w * omega[i]
