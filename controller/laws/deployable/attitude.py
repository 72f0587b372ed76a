"""Attitude: held by proportional and rate feedback, with the restoring moments adapted from the body rates.

The rates are measured well, so what the model misses of a moment shows within one period: M omega' = tau - D omega -
S(k) phi_{2..4} + residual. The residual drives the three moments of phi (12), within their bounds.
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

Array = NDArray[np.float64]


class Attitude(NamedTuple):
    """What is kept of the attitude loop."""

    desired: Array  # (4,) attitude to be kept, from body to world
    moments: Array  # (3,) phi_2..phi_4 [N m]
    last_omega: Array  # (3,) rad/s
    residual: Array  # (3,) N m, moment that the model missed in the last period
    known: Array  # (1,) 1 once last_omega is there


def attitude_of(desired: Array) -> Attitude:
    """Return the loop's memory before the first step, for an attitude to be kept."""
    return Attitude(desired.copy(), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(1))


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
    """Compare the rates with what the last forces should have made of them, and learn the restoring moments."""
    if attitude.known[0] > 0.0:
        wrench = np.empty(6)
        product(thrusters.matrix, thrusters.forces, wrench)
        k = down_in_body(quaternion)
        phi, last, I = attitude.moments, attitude.last_omega, dynamics.mass
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            damping = (dynamics.linear_damping[3 + i] + dynamics.quadratic_damping[3 + i] * abs(last[i])) * last[i]
            restoring = k[a] * phi[b] - k[b] * phi[a]  # S(k) phi: (12)
            change = 0.0
            for j in range(3):
                change += I[3 + i, 3 + j] * (omega[j] - last[j]) / period
            attitude.residual[i] = change - (wrench[3 + i] - damping - restoring)
        for i in range(3):  # phi' = -rate S(k)^T residual
            a, b = (i + 1) % 3, (i + 2) % 3
            drive = k[a] * attitude.residual[b] - k[b] * attitude.residual[a]  # S(k) r = -S(k)^T r
            phi[i] += gains.adaptation * period * drive
            phi[i] = min(max(phi[i], -gains.moment_bound), gains.moment_bound)
    attitude.last_omega[:] = omega
    attitude.known[0] = 1.0


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
        out[i] = restoring - 2.0 * inertia * w * w * e[1 + i] - 2.0 * inertia * w * omega[i]
