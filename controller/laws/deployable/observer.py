"""Observer: one Kalman filter of the motion and of all unknown parameters that affect it."""

# The states: position (3), velocity over ground (3), current (2), W - B, the restoring moments phi_2..phi_4 of (12),
# height of the center of gravity below the origin, lag of the thrusters, effectiveness and ceiling (`thrust_limit`) of
# each. The prediction is the model (11) with its coupled mass matrix, under the commanded forces within their estimated
# limits behind the lag, so that a saturated thruster causes no wind-up. The states are corrected by the moment from
# measured rates, and by measured position and velocity. A joint filter attributes each effect to the right state;
# `fault_detection` tests its hypotheses by the innovations of the same filter. Projection keeps all but position,
# velocity and height in bounds.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.laws.deployable.estimate import (
    CURRENT,
    EFFECTIVENESS,
    HEIGHT,
    LAG,
    MOMENTS,
    NET_WEIGHT,
    VELOCITY,
    Estimate,
    freeze,
    project,
    publish,
)
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Dynamics, Loads, Thrusters, free_acceleration
from controller.quaternion import down_parts
from controller.stack_array import zeros

Array = NDArray[np.float64]


_UNMODELED = 0.03  # m/s2/sqrt(Hz), acceleration noise of the model
_SLOWEST = 0.15  # m/s against the water, least speed at which drag is linearized
_GATE = 6.0  # number of standard deviations beyond which a measurement is rejected
_ANGULAR = 0.019  # rad/s2/sqrt(Hz), angular acceleration noise of the model
_BIAS_SHARE = 0.06  # weight of one innovation in the low-passed ones: 0.3 s at 50 Hz
_USUAL_BIAS = 0.02  # mean square of the low-passed innovations of a model that fits
_MISFIT_MEMORY = 3.0  # s, time constant of the misfit
_GREATEST_MISFIT = 8.0  # limit of what is averaged, so that a failure is detected before it counts as a misfit
_GAP_MEMORY = 1.0  # s, time constant at which the longest gap decays
_RIPPLE = 0.05  # standard deviation of a thruster's force in one period, relative to it
_WEAR = 0.01  # 1/sqrt(s), drift of an effectiveness
_SAG = 0.01  # 1/sqrt(s), drift of a ceiling
_LAG_DRIFT = 0.003  # s/sqrt(s), drift of the lag
_CURVED = 0.9  # s, correlation time of the error of the lag's secant, which scales it as noise
_OUTLIER = 3.0  # standard deviations to which an innovation is limited, by increasing its variance


def predict(
    estimate: Estimate,
    dynamics: Dynamics,
    thrusters: Thrusters,
    thruster_acceleration: Array,
    R: Array,
    omega_body: Array,
    gains: DeployableGains,
    period: float,
) -> None:
    """Predict the estimate over a period [s] under the forces that acted in it."""
    # `thruster_acceleration`, shape (6, m), is the acceleration by one newton of each thruster.
    x, P, F = estimate.state, estimate.covariance, estimate.transition
    mass, T, m = dynamics.translational_mass[0], period, thrusters.acting.size
    free, curvature = zeros(6), zeros(3)
    loads = Loads(estimate.water_velocity, estimate.net_weight, estimate.moments)
    free_acceleration(dynamics, R, estimate.velocity, omega_body, loads, free)
    linear = (dynamics.linear_damping[0] + dynamics.linear_damping[1] + dynamics.linear_damping[2]) / 3.0
    quadratic = (dynamics.quadratic_damping[0] + dynamics.quadratic_damping[1] + dynamics.quadratic_damping[2]) / 3.0
    _update_misfit(estimate, T)
    F[:, :] = 0.0
    for axis in range(3):
        relative = abs(estimate.velocity[axis] - estimate.water_velocity[axis])
        slope = (linear + 2.0 * quadratic * max(relative, _SLOWEST)) / mass
        F[axis, VELOCITY + axis] = 1.0 - slope * T
        if axis < 2:
            F[axis, CURRENT + axis] = slope * T
        else:
            F[axis, NET_WEIGHT] = T / mass
        acceleration = free[axis]
        for j in range(m):
            effectiveness, by_force = x[EFFECTIVENESS + j], thruster_acceleration[axis, j]
            acceleration += by_force * thrusters.acting[j] * effectiveness
            F[axis, EFFECTIVENESS + j] = T * by_force * thrusters.acting[j]
            F[axis, EFFECTIVENESS + m + j] = T * by_force * estimate.by_ceiling[0, j] * effectiveness
            F[axis, LAG] += T * by_force * estimate.by_lag[j] * effectiveness
            curvature[axis] += T * by_force * estimate.curvature[j] * effectiveness
        estimate.acceleration[axis] = acceleration
        x[axis] += T * (estimate.velocity[axis] + 0.5 * T * acceleration)
        x[VELOCITY + axis] += T * acceleration
    _propagate_covariance(estimate, T)
    for axis in range(3):
        P[VELOCITY + axis, VELOCITY + axis] += square(_UNMODELED) * T + _CURVED / T * square(curvature[axis])
        # the moments adapt at the rate `adaptation`
        P[MOMENTS + axis, MOMENTS + axis] += square(gains.adaptation * _ANGULAR * dynamics.mass[3 + axis, 3 + axis]) * T
    for axis in range(2):
        P[CURRENT + axis, CURRENT + axis] += square(gains.current_drift) * T
    P[NET_WEIGHT, NET_WEIGHT] += square(gains.restoring_drift * estimate.mass_scale[0]) * T
    P[LAG, LAG] += square(_LAG_DRIFT) * T
    for j in range(m):
        k = EFFECTIVENESS + m + j
        thrusters.effectiveness[j], thrusters.ceiling[0, j] = x[EFFECTIVENESS + j], x[k]
        thrusters.ceiling[1, j] = np.sqrt(P[k, k])
        if P[EFFECTIVENESS + j, EFFECTIVENESS + j] > 0.0:
            P[EFFECTIVENESS + j, EFFECTIVENESS + j] += square(_WEAR) * T
        P[k, k] += square(_SAG) * T
    freeze(estimate, gains)
    _propagate_deviations(estimate, thrusters, thruster_acceleration, T)
    estimate.evidence[:, :] = 0.0
    estimate.time_since_measurement[0] += period
    for group in range(2):
        estimate.time_since_valid[group] += period
    estimate.longest_gap[0] *= 1.0 - period / _GAP_MEMORY
    publish(estimate)


def _update_misfit(estimate: Estimate, period: float) -> None:
    """Update the misfit of the model over a period [s]: innovations of a model that fits are white."""
    mean = 0.0
    for i in range(estimate.bias.size):
        mean += square(estimate.bias[i]) / estimate.bias.size
    relative = min(mean / _USUAL_BIAS, _GREATEST_MISFIT)
    estimate.misfit[0] += period / (period + _MISFIT_MEMORY) * (relative - estimate.misfit[0])


def _propagate_covariance(estimate: Estimate, period: float) -> None:
    """Propagate the covariance over a period [s]: first the positions, then the velocities by `transition`."""
    P, F, W = estimate.covariance, estimate.transition, estimate.product
    n = estimate.state.size
    for axis in range(3):
        for k in range(n):
            P[axis, k] += period * P[VELOCITY + axis, k]
        for k in range(n):
            P[k, axis] += period * P[k, VELOCITY + axis]
    for i in range(3):
        W[i, :] = 0.0
        for q in range(VELOCITY, n):
            share = F[i, q]
            if share != 0.0:
                for k in range(n):
                    W[i, k] += share * P[q, k]
    for i in range(3):
        for k in range(n):
            P[VELOCITY + i, k] = P[k, VELOCITY + i] = W[i, k]
    for i in range(3):
        for k in range(3):
            total = 0.0
            for q in range(VELOCITY, n):
                total += W[i, q] * F[k, q]
            P[VELOCITY + i, VELOCITY + k] = total


def _propagate_deviations(
    estimate: Estimate, thrusters: Thrusters, thruster_acceleration: Array, period: float
) -> None:
    """Propagate the deviations of all hypotheses over a period [s], with the missing force of stuck thrusters."""
    F, deviation, m = estimate.transition, estimate.deviation, thrusters.acting.size
    for j in range(2 * m):
        for axis in range(3):
            deviation[j, axis] += period * deviation[j, VELOCITY + axis]
            estimate.gain[axis] = 0.0
            for q in range(VELOCITY, estimate.state.size):
                estimate.gain[axis] += F[axis, q] * deviation[j, q]
        for axis in range(3):
            deviation[j, VELOCITY + axis] = estimate.gain[axis]
    for j in range(m):
        estimate.missing[j] = estimate.supposed[0, j] * (estimate.supposed[1, j] - thrusters.acting[j])
        for axis in range(3):
            deviation[m + j, VELOCITY + axis] += period * thruster_acceleration[axis, j] * estimate.missing[j]


def correct_by_moment(
    estimate: Estimate,
    moment: Array,
    by_current: Array,
    rate_deviation: Array,
    dynamics: Dynamics,
    thrusters: Thrusters,
    R: Array,
    quaternion: Array,
    omega_body: Array,
    gains: DeployableGains,
    period: float,
) -> None:
    """Correct by the moment [N m] of thrusters and weight, measured by the rates over a period [s], shape (3,)."""
    # `by_current`, shape (3, 2), is the derivative of the modeled moment by the current [N s]; `rate_deviation`, shape
    # (3,), the standard deviation [rad/s] of the rates.
    row, x = estimate.row, estimate.state
    k, middle, body = zeros(3), zeros(3), zeros(3)
    k[0], k[1], k[2] = down_parts(quaternion)
    for i in range(3):  # at the middle of the period
        a, b = (i + 1) % 3, (i + 2) % 3
        middle[i] = k[i] + 0.5 * period * (omega_body[a] * k[b] - omega_body[b] * k[a])
        for axis in range(3):
            body[i] += R[axis, i] * estimate.acceleration[axis]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        row[:] = 0.0
        row[MOMENTS + b] = -middle[a]  # moment = B (f e) - S(k) phi - m z e3 x a
        row[MOMENTS + a] = middle[b]
        if i == 0:
            row[HEIGHT] = dynamics.rigid_mass[0] * body[1]
        elif i == 1:
            row[HEIGHT] = -dynamics.rigid_mass[0] * body[0]
        expected = row[MOMENTS + a] * x[MOMENTS + a] + row[MOMENTS + b] * x[MOMENTS + b] + row[HEIGHT] * x[HEIGHT]
        row[CURRENT], row[CURRENT + 1] = by_current[i, 0], by_current[i, 1]
        variance = square(_ANGULAR * dynamics.mass[3 + i, 3 + i]) / period
        # of the difference of two rates
        variance += 2.0 * square(rate_deviation[i] * dynamics.mass[3 + i, 3 + i] / period)
        m = thrusters.acting.size
        for j in range(m):
            estimate.direct[m + j] = thrusters.matrix[3 + i, j] * estimate.missing[j]
            given = thrusters.matrix[3 + i, j] * thrusters.acting[j]
            row[EFFECTIVENESS + j] = given
            by_ceiling = thrusters.matrix[3 + i, j] * estimate.by_ceiling[0, j]
            row[EFFECTIVENESS + m + j] = by_ceiling * x[EFFECTIVENESS + j]
            expected += given * x[EFFECTIVENESS + j]
            row[LAG] += thrusters.matrix[3 + i, j] * estimate.by_lag[j] * x[EFFECTIVENESS + j]
            variance += square(_RIPPLE * given)
            variance += _CURVED / period * square(thrusters.matrix[3 + i, j] * estimate.curvature[j])
        _correct(estimate, moment[i] - expected, variance, 1.0, i, 0, row.size)
    estimate.direct[:] = 0.0
    project(estimate, gains)


def correct(estimate: Estimate, first: int, measured: Array, noise: float, gains: DeployableGains) -> bool:
    """Correct by a measured position or velocity; components that are NaN are skipped; measured (3,) [m]."""
    P, x, known = estimate.covariance, estimate.state, False
    for axis in range(3):
        if np.isnan(measured[axis]):
            continue
        known = True
        spread = np.sqrt(P[first + axis, first + axis] + square(noise))
        if not abs(measured[axis] - x[first + axis]) <= _GATE * spread + 0.05:
            return False
    if not known:
        return False
    for axis in range(3):
        if not np.isnan(measured[axis]):
            estimate.row[:] = 0.0
            estimate.row[first + axis] = 1.0
            at = first + axis
            _correct(estimate, measured[axis] - x[at], square(noise), estimate.weight[0], 3 + at, at, at + 1)
    project(estimate, gains)
    return True


def _correct(
    estimate: Estimate, innovation: float, noise: float, weight: float, channel: int, begin: int, end: int
) -> None:
    """Correct by one number; add weighted evidence of each hypothesis, and propagate its deviation."""
    # Before the call, set the `row` of the number; it must be 0 outside `begin` to `end` (exclusive).
    P, row, gain = estimate.covariance, estimate.row, estimate.gain
    n, variance = row.size, noise
    gain[:] = 0.0
    for k in range(begin, end):
        if row[k] != 0.0:
            for i in range(n):
                gain[i] += P[k, i] * row[k]
    for i in range(begin, end):
        variance += gain[i] * row[i]
    variance = max(variance, square(innovation / _OUTLIER))
    estimate.bias[channel] += _BIAS_SHARE * (innovation / np.sqrt(variance) - estimate.bias[channel])
    for i in range(n):
        share = gain[i] / variance
        estimate.state[i] += share * innovation
        for k in range(n):
            P[i, k] -= share * gain[k]
    for k in range(n):
        gain[k] /= variance
    for j in range(estimate.direct.size):
        expected = estimate.direct[j]
        for k in range(begin, end):
            expected += row[k] * estimate.deviation[j, k]
        estimate.evidence[0, j] += weight * expected * innovation / variance
        estimate.evidence[1, j] += weight * square(expected) / variance
        for k in range(n):
            estimate.deviation[j, k] -= gain[k] * expected
