"""Observer of position, velocity, current and W - B: a Kalman filter for each world axis.

Each filter has three states: position, velocity over ground, and an unknown input: the current north and east, W - B
downwards. The prediction couples them by the translational part of the model (11), see `model.free_acceleration`; the
covariances are propagated axis by axis. Projection keeps current and W - B within their bounds. The prediction uses the
commanded forces within their limits, so that a saturated thruster causes no wind-up.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.model import Dynamics, Thrusters, free_acceleration, thrust_acceleration
from controller.stack_array import zeros

Array = NDArray[np.float64]

_UNMODELLED = 0.03  # m/s2/sqrt(Hz), acceleration noise of the model
_SLOWEST = 0.15  # m/s against the water, least speed at which drag is linearized
_GATE = 6.0  # standard deviations beyond which a measurement is rejected
_FIRST_CURRENT, _FIRST_RESTORING = 0.3, 15.0  # m/s, N: standard deviations at the start


class Estimate(NamedTuple):
    """State and covariance of the three filters."""

    position: Array  # (3,) m, NED
    velocity: Array  # (3,) m/s over ground, NED
    water_velocity: Array  # (3,) m/s, NED; its down component is 0
    net_weight: Array  # (1,) N, W - B
    covariance: Array  # (3, 3, 3) of each axis: position, velocity, unknown
    acceleration: Array  # (3,) m/s2 over ground, NED, predicted for the last period
    innovation: Array  # (3,) m/s, measured less predicted velocity, NED
    innovation_deviation: Array  # (3,) m/s, standard deviation of the innovation
    gain: Array  # (3,) Kalman gain of the velocity for its innovation
    time_since_measurement: Array  # (1,) s since the last valid measurement; negative before the first
    last_measured: Array  # (6,) position and velocity, as last measured


def empty_estimate() -> Estimate:
    """Return the estimate before the first measurement."""
    return Estimate(
        position=np.zeros(3),
        velocity=np.zeros(3),
        water_velocity=np.zeros(3),
        net_weight=np.zeros(1),
        covariance=np.zeros((3, 3, 3)),
        acceleration=np.zeros(3),
        innovation=np.zeros(3),
        innovation_deviation=np.ones(3),
        gain=np.zeros(3),
        time_since_measurement=np.array([-1.0]),
        last_measured=np.full(6, np.nan),
    )


def initialize(estimate: Estimate, position: Array, velocity: Array, gains: DeployableGains) -> None:
    """Initialize from a measurement [m, m/s, NED]: the first one, or one after a loss.

    Current and W - B keep their estimates.
    """
    copy(position, estimate.position)
    copy(velocity, estimate.velocity)
    first = estimate.time_since_measurement[0] < 0.0
    for axis in range(3):
        P = estimate.covariance[axis]
        unknown = P[2, 2]
        if first:
            unknown = square(_FIRST_RESTORING) if axis == 2 else square(_FIRST_CURRENT)
        P[:, :] = 0.0
        P[0, 0], P[1, 1], P[2, 2] = square(gains.position_noise), square(gains.velocity_noise), unknown
    estimate.innovation[:] = 0.0
    estimate.time_since_measurement[0] = 0.0


def predict(
    estimate: Estimate,
    dynamics: Dynamics,
    thrusters: Thrusters,
    R: Array,
    omega_body: Array,
    gains: DeployableGains,
    period: float,
) -> None:
    """Predict the estimate over a control period [s] under the last commanded forces."""
    free, by_thrusters = zeros(3), zeros(6)
    free_acceleration(dynamics, R, estimate.velocity, omega_body, estimate.water_velocity, estimate.net_weight[0], free)
    thrust_acceleration(dynamics, thrusters, R, thrusters.forces, by_thrusters)
    mass = dynamics.translational_mass[0]
    linear = (dynamics.linear_damping[0] + dynamics.linear_damping[1] + dynamics.linear_damping[2]) / 3.0
    quadratic = (dynamics.quadratic_damping[0] + dynamics.quadratic_damping[1] + dynamics.quadratic_damping[2]) / 3.0
    for axis in range(3):
        relative = abs(estimate.velocity[axis] - estimate.water_velocity[axis])
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
        P[1, 0], P[1, 1], P[1, 2] = p01, p11 + square(_UNMODELLED) * T, p12
        P[2, 0], P[2, 1], P[2, 2] = p02, p12, P[2, 2] + square(drift) * T
        acceleration = free[axis] + by_thrusters[axis]
        estimate.acceleration[axis] = acceleration
        estimate.position[axis] += T * (estimate.velocity[axis] + 0.5 * T * acceleration)
        estimate.velocity[axis] += T * acceleration
    estimate.time_since_measurement[0] += period


def correct(estimate: Estimate, position: Array, velocity: Array, gains: DeployableGains) -> bool:
    """Correct by a measurement of position [m] and velocity [m/s], shape (3,) each, NED; return False if rejected."""
    for axis in range(3):
        P = estimate.covariance[axis]
        off = abs(position[axis] - estimate.position[axis])
        fast = abs(velocity[axis] - estimate.velocity[axis])
        if not off <= _GATE * np.sqrt(P[0, 0] + square(gains.position_noise)) + 0.05:
            return False
        if not fast <= _GATE * np.sqrt(P[1, 1] + square(gains.velocity_noise)) + 0.05:
            return False
    for axis in range(3):
        P = estimate.covariance[axis]
        estimate.innovation[axis] = velocity[axis] - estimate.velocity[axis]
        estimate.innovation_deviation[axis] = np.sqrt(P[1, 1] + square(gains.velocity_noise))
        estimate.gain[axis] = P[1, 1] / (P[1, 1] + square(gains.velocity_noise))
        unknown = estimate.net_weight[0] if axis == 2 else estimate.water_velocity[axis]
        for row in range(2):  # first by the position, then by the velocity
            measured = (
                position[axis] - estimate.position[axis] if row == 0 else velocity[axis] - estimate.velocity[axis]
            )
            noise = gains.position_noise if row == 0 else gains.velocity_noise
            total = P[row, row] + square(noise)
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
            estimate.net_weight[0] = min(max(unknown, -gains.restoring_bound), gains.restoring_bound)
        else:
            estimate.water_velocity[axis] = min(max(unknown, -gains.current_bound), gains.current_bound)
    estimate.time_since_measurement[0] = 0.0
    return True


def inflate_covariance(estimate: Estimate, variance: float) -> None:
    """Add variance to velocity [m2/s2] and unknowns, after the assumed health of a thruster has changed."""
    for axis in range(3):
        estimate.covariance[axis, 1, 1] += variance
        estimate.covariance[axis, 2, 2] += 25.0 if axis == 2 else 0.04


def position_spread(estimate: Estimate) -> float:
    """Return the greatest standard deviation [m] of the position among the axes."""
    worst = 0.0
    for axis in range(3):
        worst = max(worst, estimate.covariance[axis, 0, 0])
    return float(np.sqrt(worst))
