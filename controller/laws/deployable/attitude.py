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

from controller.compiled import compiled
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import product
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.quaternion import down_in_body, error
from controller.quaternion import rate as quaternion_rate
from controller.regions import Orientation, PackedRegions, attitude_clearance

Array = NDArray[np.float64]

_ATTITUDE = Orientation.kind  # shapes from it on depend on attitude
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


@compiled
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
        wrench = np.empty(6)
        product(thrusters.matrix, thrusters.forces, wrench)
        k = down_in_body(quaternion)
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
    attitude.last_omega[:] = omega
    attitude.known[0] = 1.0


@compiled
def carry(attitude: Attitude, dynamics: Dynamics, R: Array, velocity: Array, water: Array) -> None:
    """Bring Munk's moment up to date with the velocities [m/s] of vehicle and water, shape (3,) each, NED."""
    relative, momentum = np.zeros(3), np.zeros(3)
    for i in range(3):
        for axis in range(3):
            relative[i] += R[axis, i] * (velocity[axis] - water[axis])
    for i in range(3):
        for j in range(3):
            momentum[i] += dynamics.mass[i, j] * relative[j]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        attitude.carried[i] = relative[b] * momentum[a] - relative[a] * momentum[b]  # -nu_r x (M nu_r)


@compiled
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
    back = error(attitude.preferred, attitude.desired)  # desired = preferred * back
    turn = -2.0 * _RETURN * back[1:]
    asked = False
    for i in range(regions.kinds.size):
        if regions.kinds[i] < _ATTITUDE:
            continue
        clearance, slope = attitude_clearance(regions, i, position, attitude.desired)
        size = np.sqrt(slope[0] ** 2 + slope[1] ** 2 + slope[2] ** 2)
        if clearance < gains.comfort:
            asked = True
            if size > 0.0:
                turn += _TURN * (gains.comfort - clearance) / size * slope
            elif clearance < 0.0:  # half a turn away, where every way round is as long: about the vertical
                turn += _TURN * (gains.comfort - clearance) * down_in_body(attitude.desired)
    if not asked and back[0] > 1.0 - 1e-15:
        return
    size = np.sqrt(turn[0] ** 2 + turn[1] ** 2 + turn[2] ** 2)
    if size > gains.turning_rate:
        turn *= gains.turning_rate / size
    _turned(attitude.desired, turn, period)
    # no more tilted than allowed: what is left of the turn is that about the vertical
    k = down_in_body(attitude.desired)
    if k[2] < np.cos(gains.tilt) and k[2] < down_in_body(attitude.preferred)[2]:
        _turned(attitude.desired, -turn, period)
        k = down_in_body(attitude.desired)
        _turned(attitude.desired, (k[0] * turn[0] + k[1] * turn[1] + k[2] * turn[2]) * k, period)


@compiled
def _turned(quaternion: Array, omega: Array, period: float) -> None:
    """Turn an attitude at a body rate [rad/s] for a period [s], in place."""
    turned = quaternion + period * quaternion_rate(quaternion, omega)
    quaternion[:] = turned / np.sqrt(turned[0] ** 2 + turned[1] ** 2 + turned[2] ** 2 + turned[3] ** 2)


@compiled
def free_turning(attitude: Attitude, dynamics: Dynamics, quaternion: Array, omega: Array, out: Array) -> None:
    """Write the angular acceleration without thrust, shape (3,) [rad/s2], body axes."""
    k, moments, momentum = down_in_body(quaternion), np.zeros(3), np.zeros(3)
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


@compiled
def moment(
    attitude: Attitude, dynamics: Dynamics, quaternion: Array, omega: Array, gains: DeployableGains, out: Array
) -> None:
    """Write the wanted moment, shape (3,) [N m], body axes."""
    e = error(attitude.desired, quaternion)
    k = down_in_body(quaternion)
    w = gains.attitude_bandwidth
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        inertia = dynamics.mass[3 + i, 3 + i]
        restoring = k[a] * attitude.moments[b] - k[b] * attitude.moments[a]
        out[i] = restoring - attitude.carried[i] - 2.0 * inertia * w * w * e[1 + i] - 2.0 * inertia * w * omega[i]
