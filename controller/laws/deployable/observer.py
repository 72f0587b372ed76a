"""Observer: one Kalman filter of the motion and of all unknown parameters that affect it."""

# The states: position (3), velocity over ground (3), current (2), W - B, the restoring moments phi_2..phi_4 of (12), a
# moment about the body's z axis, height of the center of gravity below the origin, drag relative to the vehicle's, lag
# of the thrusters, effectiveness and ceiling (`thrust_limit`) of each. The prediction is the model (11) with its
# coupled mass matrix, under the commanded forces within their estimated limits behind the lag, so that a saturated
# thruster causes no wind-up. The states are corrected by the moment from measured rates, and by measured position and
# velocity. A joint filter attributes each effect to the right state; `fault_detection` tests its hypotheses by the
# innovations of the same filter. Current, W - B and moments also stand for other disturbances, such as gusts or errors
# of the model. Projection keeps all but position, velocity and height in bounds.

from __future__ import annotations

import numpy as np

from controller.arithmetic import exponential, square
from controller.laws.deployable.attitude import Moments2
from controller.laws.deployable.estimate import (
    CURRENT,
    DRAG,
    EFFECTIVENESS,
    HEIGHT,
    LAG,
    MOMENTS,
    NET_WEIGHT,
    VELOCITY,
    YAW_MOMENT,
    Estimate,
    freeze,
    project,
    publish,
)
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Dynamics, Loads, Thrusters, drag_acceleration, free_acceleration
from controller.linear_algebra import cross
from controller.quaternion import down_in_body
from controller.stack_array import Columns6, Matrix3, Vector3, Vector4

_UNMODELED = 0.03  # m/s2/sqrt(Hz), acceleration noise of the model
_SLOWEST = 0.15  # m/s against the water, least speed at which drag is linearized
_GATE = 6.0  # number of standard deviations beyond which a measurement is rejected
_ANGULAR = 0.019  # rad/s2/sqrt(Hz), angular acceleration noise of the model
_BIAS_SHARE = 0.06  # weight of one innovation in the low-passed ones: 0.3 s at 50 Hz
_USUAL_BIAS = 0.02  # mean square of the low-passed innovations of a model that fits
_MISFIT_MEMORY = 3.0  # s, time constant of the misfit
_MAX_MISFIT = 8.0  # limit of what is averaged, so that a failure is detected before it counts as a misfit
_FORGOTTEN = 1.5  # s without a correction after which an innovation no longer counts as biased
_GAP_MEMORY = 1.0  # s, time constant at which the longest gap decays
_RIPPLE = 0.05  # standard deviation of a thruster's force in one period, relative to it
_WEAR = 0.01  # 1/sqrt(s), drift of an effectiveness
_SAG = 0.01  # 1/sqrt(s), drift of a ceiling
_DRIFT_RATE = 0.3  # 1/s, rate at which disturbances are let drift faster while innovations are biased
_DRAG_DRIFT = 0.01  # 1/sqrt(s), drift of the drag
_LAG_DRIFT = 0.003  # s/sqrt(s), drift of the lag
_CURVED = 0.9  # s, correlation time of the error of the lag's secant, which scales it as noise
_OUTLIER = 3.0  # standard deviations to which an innovation is limited, by increasing its variance


def predict(
    estimate: Estimate,
    dynamics: Dynamics,
    thrusters: Thrusters,
    thruster_acceleration: Columns6,
    R: Matrix3,
    omega_body: Vector3,
    gains: DeployableGains,
    period: float,
) -> None:
    """Predict the estimate over a period [s] under the forces that acted in it."""
    # `thruster_acceleration` is the acceleration by one newton of each thruster.
    x, P, F, drift = estimate.state, estimate.covariance, estimate.transition, estimate.drift
    T, m, A = period, thrusters.acting.size, thruster_acceleration[:3]
    effectiveness = x[EFFECTIVENESS : EFFECTIVENESS + m]
    loads = Loads(estimate.water_velocity, estimate.net_weight, estimate.moments, estimate.yaw_moment, estimate.drag)
    free = free_acceleration(dynamics, R, estimate.velocity, omega_body, loads)
    acceleration = free[:3] + A @ (thrusters.acting * effectiveness)
    curvature = T * (A @ (estimate.curvature * effectiveness))
    _update_misfit(estimate, gains, T)
    # derivatives of the next velocity; drag is that of the mean axis, linearized
    linear, quadratic = np.sum(dynamics.linear_damping[:3]) / 3.0, np.sum(dynamics.quadratic_damping[:3]) / 3.0
    speed = np.maximum(abs(estimate.velocity - estimate.water_velocity), _SLOWEST)
    slope = estimate.drag * (linear + 2.0 * quadratic * speed) / dynamics.translational_mass
    F[:, :] = 0.0
    for axis in range(3):
        F[axis, VELOCITY + axis] = 1.0 - slope[axis] * T
    F[0, CURRENT], F[1, CURRENT + 1] = slope[0] * T, slope[1] * T
    F[2, NET_WEIGHT] = T / dynamics.translational_mass
    F[:, DRAG] = T * drag_acceleration(dynamics, R, estimate.velocity - estimate.water_velocity)
    F[:, LAG] = T * (A @ (estimate.by_lag * effectiveness))
    F[:, EFFECTIVENESS : EFFECTIVENESS + m] = T * A * thrusters.acting
    F[:, EFFECTIVENESS + m : EFFECTIVENESS + m + m] = T * A * estimate.by_ceiling[0] * effectiveness
    # the state and its covariance
    estimate.acceleration = acceleration
    x[:3] += T * (estimate.velocity + 0.5 * T * acceleration)
    x[VELOCITY:CURRENT] += T * acceleration
    _propagate_covariance(estimate, T)
    for axis in range(3):
        P[VELOCITY + axis, VELOCITY + axis] += square(_UNMODELED) * T + _CURVED / T * square(curvature[axis])
        # the moments adapt at the rate `adaptation`; phi_2..phi_4 act about x and y of a level vehicle
        P[MOMENTS + axis, MOMENTS + axis] += max(drift[3], drift[4]) * _moment_drift(dynamics, axis, gains) * T
    P[YAW_MOMENT, YAW_MOMENT] += drift[5] * _moment_drift(dynamics, 2, gains) * T
    for axis in range(2):
        P[CURRENT + axis, CURRENT + axis] += drift[axis] * square(gains.current_drift) * T
    P[NET_WEIGHT, NET_WEIGHT] += drift[2] * square(gains.restoring_drift * estimate.mass_scale) * T
    P[DRAG, DRAG] += square(_DRAG_DRIFT) * T
    P[LAG, LAG] += square(_LAG_DRIFT) * T
    thrusters.effectiveness, thrusters.ceiling[0] = effectiveness, x[EFFECTIVENESS + m : EFFECTIVENESS + m + m]
    for j in range(EFFECTIVENESS, EFFECTIVENESS + m):
        thrusters.ceiling[1, j - EFFECTIVENESS] = np.sqrt(P[j + m, j + m])
        if P[j, j] > 0.0:
            P[j, j] += square(_WEAR) * T
        P[j + m, j + m] += square(_SAG) * T
    freeze(estimate, gains)
    _propagate_deviations(estimate, thrusters, thruster_acceleration, T)
    estimate.evidence[:, :] = 0.0
    estimate.time_since_measurement += period
    estimate.time_since_valid += period
    estimate.longest_gap *= 1.0 - period / _GAP_MEMORY
    publish(estimate)


def _moment_drift(dynamics: Dynamics, axis: int, gains: DeployableGains) -> float:
    """Return the variance of the drift of a moment about a body axis [(N m)2/s]."""
    return square(gains.adaptation * _ANGULAR * dynamics.mass[3 + axis, 3 + axis])


def _update_misfit(estimate: Estimate, gains: DeployableGains, period: float) -> None:
    """Update misfit and drifts over a period [s]: innovations of a model that fits are white."""
    for group in range(2):  # of position and velocity
        if estimate.time_since_valid[group] > _FORGOTTEN:
            estimate.bias[3 + 3 * group : 6 + 3 * group] = 0.0
    # While an innovation is biased, what disturbs the vehicle along its axis is let drift faster, until it is white.
    for axis in range(6):
        bias = estimate.bias[6 + axis] if axis < 3 else estimate.bias[axis - 3]  # of a velocity, or of a moment
        biased = min(square(bias) / _USUAL_BIAS, _MAX_MISFIT)
        drift = estimate.drift[axis] * exponential(_DRIFT_RATE * period * (biased - 1.0))
        estimate.drift[axis] = min(max(drift, 1.0), gains.max_drift)
    mean = float(estimate.bias @ estimate.bias) / estimate.bias.size
    relative = min(mean / _USUAL_BIAS, _MAX_MISFIT)
    estimate.misfit += period / (period + _MISFIT_MEMORY) * (relative - estimate.misfit)


def _propagate_covariance(estimate: Estimate, period: float) -> None:
    """Propagate the covariance over a period [s]: first the positions, then the velocities by `transition`."""
    P, F, W = estimate.covariance, estimate.transition, estimate.product
    P[:3] += period * P[VELOCITY:CURRENT]
    P[:, :3] += period * P[:, VELOCITY:CURRENT]
    W[:] = F[:, VELOCITY:] @ P[VELOCITY:]
    P[VELOCITY:CURRENT], P[:, VELOCITY:CURRENT] = W, W.T
    P[VELOCITY:CURRENT, VELOCITY:CURRENT] = W[:, VELOCITY:] @ F[:, VELOCITY:].T


def _propagate_deviations(
    estimate: Estimate, thrusters: Thrusters, thruster_acceleration: Columns6, period: float
) -> None:
    """Propagate the deviations of all hypotheses over a period [s], with the missing force of stuck thrusters."""
    F, m = estimate.transition, thrusters.acting.size
    estimate.missing = estimate.supposed[0] * (estimate.supposed[1] - thrusters.acting)
    for j in range(2 * m):
        d = estimate.deviation[j]
        d[:3] += period * d[VELOCITY:CURRENT]
        d[VELOCITY:CURRENT] = F[:, VELOCITY:] @ d[VELOCITY:]
        if j >= m:
            d[VELOCITY:CURRENT] += period * thruster_acceleration[:3, j - m] * estimate.missing[j - m]


def correct_by_moment(
    estimate: Estimate,
    moment: Vector3,
    by_current: Moments2,
    rate_deviation: Vector3,
    dynamics: Dynamics,
    thrusters: Thrusters,
    R: Matrix3,
    quaternion: Vector4,
    omega_body: Vector3,
    gains: DeployableGains,
    period: float,
) -> None:
    """Correct by the moment [N m] of thrusters and weight, measured by the rates over a period [s]."""
    # `by_current` is the derivative of the modeled moment by the current [N s]; `rate_deviation` the standard deviation
    # [rad/s] of the rates.
    row, x, m = estimate.row, estimate.state, thrusters.acting.size
    effectiveness = x[EFFECTIVENESS : EFFECTIVENESS + m]
    k = down_in_body(quaternion)
    middle = k + 0.5 * period * cross(omega_body, k)  # at the middle of the period
    body = R.T @ estimate.acceleration
    for i in range(3):
        a, b, B = (i + 1) % 3, (i + 2) % 3, thrusters.matrix[3 + i]
        row[:] = 0.0
        row[MOMENTS + b] = -middle[a]  # moment = B (f e) - S(k) phi - m z e3 x a
        row[MOMENTS + a] = middle[b]
        if i == 0:
            row[HEIGHT] = dynamics.rigid_mass * body[1]
        elif i == 1:
            row[HEIGHT] = -dynamics.rigid_mass * body[0]
        else:
            row[YAW_MOMENT] = 1.0
        row[EFFECTIVENESS : EFFECTIVENESS + m] = B * thrusters.acting
        expected = row @ x
        row[CURRENT:NET_WEIGHT] = by_current[i]
        row[EFFECTIVENESS + m : EFFECTIVENESS + m + m] = B * estimate.by_ceiling[0] * effectiveness
        row[LAG] = B @ (estimate.by_lag * effectiveness)
        estimate.direct[m : m + m] = B * estimate.missing
        inertia = dynamics.mass[3 + i, 3 + i]
        variance = square(_ANGULAR * inertia) / period
        variance += 2.0 * square(rate_deviation[i] * inertia / period)  # of the difference of two rates
        variance += np.sum((_RIPPLE * B * thrusters.acting) ** 2)
        variance += _CURVED / period * np.sum((B * estimate.curvature) ** 2)
        _correct(estimate, moment[i] - expected, variance, 1.0, i, CURRENT, row.size)
    estimate.direct[:] = 0.0
    project(estimate, gains)


def correct(estimate: Estimate, first: int, measured: Vector3, noise: float, gains: DeployableGains) -> bool:
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
            _correct(estimate, measured[axis] - x[at], square(noise), estimate.weight, 3 + at, at, at + 1)
    project(estimate, gains)
    return True


def _correct(
    estimate: Estimate, innovation: float, noise: float, weight: float, channel: int, begin: int, end: int
) -> None:
    """Correct by one number; add weighted evidence of each hypothesis, and propagate its deviation."""
    # Before the call, set the `row` of the number; it must be 0 outside `begin` to `end` (exclusive).
    P, x, row, gain = estimate.covariance, estimate.state, estimate.row, estimate.gain
    gain[:] = 0.0
    for k in range(begin, end):
        if row[k] != 0.0:
            gain += P[k] * row[k]
    variance = max(noise + float(gain[begin:end] @ row[begin:end]), square(innovation / _OUTLIER))
    estimate.bias[channel] += _BIAS_SHARE * (innovation / np.sqrt(variance) - estimate.bias[channel])
    for i in range(x.size):
        fraction = gain[i] / variance
        x[i] += fraction * innovation
        P[i] -= fraction * gain
    gain /= variance
    for j in range(estimate.direct.size):
        expected = estimate.direct[j] + row[begin:end] @ estimate.deviation[j, begin:end]
        estimate.evidence[0, j] += weight * expected * innovation / variance
        estimate.evidence[1, j] += weight * square(expected) / variance
        estimate.deviation[j] -= expected * gain
