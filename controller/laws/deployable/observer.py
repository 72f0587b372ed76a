"""Where the vehicle is, how it moves, and what pushes it: a Kalman filter for each world axis.

Each has three states: position, velocity over ground, and what the law is not told of that axis: the current north and
east, W - B downwards. They are coupled through the prediction, which uses the translational part of the model (11), see
`model.free_acceleration`; the covariances are carried axis by axis. Projection keeps current and W - B within their
bounds, and since the prediction uses the forces that were commanded within the limits, a saturated thruster winds
nothing up.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import part
from controller.jit.stack_array import zeros
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.model import Dynamics, Thrusters, free_acceleration, thrust_acceleration

Array = NDArray[np.float64]

_UNMODELLED = 0.03  # m/s2/sqrt(Hz), acceleration that the model does not know
_SLOWEST = 0.15  # m/s against the water, at which the drag's slope is taken at least
_GATE = 6.0  # standard deviations beyond which a measurement is not believed
_FIRST_CURRENT, _FIRST_RESTORING = 0.3, 15.0  # m/s, N: standard deviations at the start


class Estimate(NamedTuple):
    """State and covariance of the three filters."""

    position: Array  # (3,) m, NED
    velocity: Array  # (3,) m/s over ground, NED
    water: Array  # (3,) m/s, velocity of the water, NED; down is taken to be 0
    restoring: Array  # (1,) N, W - B
    covariance: Array  # (3, 3, 3) of each axis: position, velocity, unknown
    acceleration: Array  # (3,) m/s2 over ground, NED, predicted for the last period
    innovation: Array  # (3,) m/s, measured less predicted velocity, NED
    spread: Array  # (3,) m/s, standard deviation of the innovation
    gain: Array  # (3,) how much of the innovation the velocity takes
    silence: Array  # (1,) s since the last valid measurement; negative before the first
    last_measured: Array  # (6,) position and velocity as last measured, bit for bit


def estimate_of_nothing() -> Estimate:
    """Return the estimate before the first measurement."""
    return Estimate(
        position=np.zeros(3),
        velocity=np.zeros(3),
        water=np.zeros(3),
        restoring=np.zeros(1),
        covariance=np.zeros((3, 3, 3)),
        acceleration=np.zeros(3),
        innovation=np.zeros(3),
        spread=np.ones(3),
        gain=np.zeros(3),
        silence=np.array([-1.0]),
        last_measured=np.full(6, np.nan),
    )


@part
def begin(estimate: Estimate, position: Array, velocity: Array, gains: DeployableGains) -> None:
    """Start from a first measurement [m, m/s, NED], or anew after losing the vehicle.

    What is known of water and weight stays.
    """
    copy(position, estimate.position)
    copy(velocity, estimate.velocity)
    first = estimate.silence[0] < 0.0
    for axis in range(3):
        P = estimate.covariance[axis]
        unknown = P[2, 2]
        if first:
            unknown = _FIRST_RESTORING**2 if axis == 2 else _FIRST_CURRENT**2
        P[:, :] = 0.0
        P[0, 0], P[1, 1], P[2, 2] = gains.position_noise**2, gains.velocity_noise**2, unknown
    estimate.innovation[:] = 0.0
    estimate.silence[0] = 0.0


@part
def predict(
    estimate: Estimate,
    dynamics: Dynamics,
    thrusters: Thrusters,
    R: Array,
    omega_body: Array,
    gains: DeployableGains,
    period: float,
) -> None:
    """Carry the estimate over a control period [s] in which the last commanded forces acted."""
    free, pushed = zeros(3), zeros(6)
    free_acceleration(dynamics, R, estimate.velocity, omega_body, estimate.water, estimate.restoring[0], free)
    thrust_acceleration(dynamics, thrusters, R, thrusters.forces, pushed)
    mass = dynamics.translational_mass[0]
    linear = (dynamics.linear_damping[0] + dynamics.linear_damping[1] + dynamics.linear_damping[2]) / 3.0
    quadratic = (dynamics.quadratic_damping[0] + dynamics.quadratic_damping[1] + dynamics.quadratic_damping[2]) / 3.0
    for axis in range(3):
        relative = abs(estimate.velocity[axis] - estimate.water[axis])
        slope = (linear + 2.0 * quadratic * max(relative, _SLOWEST)) / mass
        by_unknown = slope if axis < 2 else 1.0 / mass
        # F = [1 T 0; 0 1 - slope T, by_unknown T; 0 0 1]
        T, P = period, estimate.covariance[axis]
        f11, f12 = 1.0 - slope * T, by_unknown * T
        p00 = P[0, 0] + 2.0 * T * P[0, 1] + T * T * P[1, 1]
        p01 = f11 * (P[0, 1] + T * P[1, 1]) + f12 * (P[0, 2] + T * P[1, 2])
        p02 = P[0, 2] + T * P[1, 2]
        p11 = f11 * f11 * P[1, 1] + 2.0 * f11 * f12 * P[1, 2] + f12 * f12 * P[2, 2]
        p12 = f11 * P[1, 2] + f12 * P[2, 2]
        drift = gains.restoring_drift if axis == 2 else gains.current_drift
        P[0, 0], P[0, 1], P[0, 2] = p00, p01, p02
        P[1, 0], P[1, 1], P[1, 2] = p01, p11 + _UNMODELLED**2 * T, p12
        P[2, 0], P[2, 1], P[2, 2] = p02, p12, P[2, 2] + drift**2 * T
        acceleration = free[axis] + pushed[axis]
        estimate.acceleration[axis] = acceleration
        estimate.position[axis] += T * (estimate.velocity[axis] + 0.5 * T * acceleration)
        estimate.velocity[axis] += T * acceleration
    estimate.silence[0] += period


@part
def correct(estimate: Estimate, position: Array, velocity: Array, gains: DeployableGains) -> bool:
    """Take in a measurement of position [m] and velocity [m/s], shape (3,) each, NED; False if it is not believed."""
    for axis in range(3):
        P = estimate.covariance[axis]
        off = abs(position[axis] - estimate.position[axis])
        fast = abs(velocity[axis] - estimate.velocity[axis])
        if not off <= _GATE * np.sqrt(P[0, 0] + gains.position_noise**2) + 0.05:
            return False
        if not fast <= _GATE * np.sqrt(P[1, 1] + gains.velocity_noise**2) + 0.05:
            return False
    for axis in range(3):
        P = estimate.covariance[axis]
        estimate.innovation[axis] = velocity[axis] - estimate.velocity[axis]
        estimate.spread[axis] = np.sqrt(P[1, 1] + gains.velocity_noise**2)
        estimate.gain[axis] = P[1, 1] / (P[1, 1] + gains.velocity_noise**2)
        unknown = estimate.restoring[0] if axis == 2 else estimate.water[axis]
        for row in range(2):  # first by the position, then by the velocity
            measured = (
                position[axis] - estimate.position[axis] if row == 0 else velocity[axis] - estimate.velocity[axis]
            )
            noise = gains.position_noise if row == 0 else gains.velocity_noise
            total = P[row, row] + noise**2
            k0, k1, k2 = P[0, row] / total, P[1, row] / total, P[2, row] / total
            estimate.position[axis] += k0 * measured
            estimate.velocity[axis] += k1 * measured
            unknown += k2 * measured
            r0, r1, r2 = P[row, 0], P[row, 1], P[row, 2]
            for column, r in enumerate((r0, r1, r2)):
                P[0, column] -= k0 * r
                P[1, column] -= k1 * r
                P[2, column] -= k2 * r
        if axis == 2:
            estimate.restoring[0] = min(max(unknown, -gains.restoring_bound), gains.restoring_bound)
        else:
            estimate.water[axis] = min(max(unknown, -gains.current_bound), gains.current_bound)
    estimate.silence[0] = 0.0
    return True


@part
def inflate_covariance(estimate: Estimate, variance: float) -> None:
    """Let velocity and unknowns be found anew: after the thrusters turned out to be other than believed."""
    for axis in range(3):
        estimate.covariance[axis, 1, 1] += variance
        estimate.covariance[axis, 2, 2] += 25.0 if axis == 2 else 0.04


@part
def position_spread(estimate: Estimate) -> float:
    """Return the standard deviation of the position [m] along the axis that is known worst."""
    worst = 0.0
    for axis in range(3):
        worst = max(worst, estimate.covariance[axis, 0, 0])
    return float(np.sqrt(worst))
