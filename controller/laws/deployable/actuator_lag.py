"""Forces and state behind the lag of the thrusters, which the observer estimates."""

# Forces f follow commands u by tau f' = u - f. They are propagated for the estimated lag, and for a standard deviation
# less and more: the secant between these is the sensitivity of the forces to the lag, and its error at the estimated
# lag is their curvature. When the estimate changes, the forces are interpolated to the new lag, as if it had always
# been that.
#
# Let a be the acceleration without thrust, and G f that of the thrusters. Then p + tau v has the rate v + tau (a + G
# f), and this has the rate a + G u + tau a'. So the point ahead answers to commands at once, and the vehicle follows
# it: its position is a mean of where that point was. The law controls the point ahead, and its commands act at the
# attitude there: G turns with the body while forces follow. Without a lag the point is the vehicle.

from __future__ import annotations

import numpy as np

from controller.arithmetic import exponential
from controller.laws.deployable.attitude import integrate_attitude
from controller.laws.deployable.estimate import EFFECTIVENESS, LAG, Estimate
from controller.laws.deployable.model import Thrusters
from controller.laws.deployable.thrust_limit import limited_force
from controller.linear_algebra import norm
from controller.stack_array import Array, Vector3, Vector4, Vector6
from controller.state import State

_GREATEST_TURN = 0.5  # rad, greatest turn of the predicted attitude


def update_forces(estimate: Estimate, thrusters: Thrusters, period: float) -> None:
    """Propagate the acting forces over the last period [s], for the estimated lag and for its bracket."""
    lag, spread = estimate.state[LAG], np.sqrt(estimate.covariance[LAG, LAG])
    lags, bracket, now = estimate.lags, estimate.bracket, thrusters.acting_now
    min_lag, max_lag = max(lag - spread, 0.0), lag + spread
    remains, average = _of_lag(lag, period)
    remains_min, average_min = _of_lag(min_lag, period)
    remains_max, average_max = _of_lag(max_lag, period)
    m, by_ceiling = thrusters.forces.size, estimate.by_ceiling
    for j in range(m):
        commanded, slope, k = thrusters.stuck[j], 0.0, EFFECTIVENESS + m + j
        if np.isnan(commanded):
            limit = thrusters.nominal_upper[j] if thrusters.forces[j] > 0.0 else thrusters.nominal_lower[j]
            spread = np.sqrt(estimate.covariance[k, k])
            commanded, slope = limited_force(thrusters.forces[j], limit, estimate.state[k], spread)
        change = by_ceiling[1, j] * (estimate.state[k] - by_ceiling[2, j])
        by_ceiling[2, j] = estimate.state[k]
        now[j] += change
        bracket[0, j] += change
        bracket[1, j] += change
        by_ceiling[0, j] = slope + average * (by_ceiling[1, j] - slope)
        by_ceiling[1, j] = slope + remains * (by_ceiling[1, j] - slope)
        # deviation from the command, if the lag had always been the present estimate
        behind = _between(bracket[0, j], now[j], bracket[1, j], lags, lag) - commanded
        behind_min = _between(bracket[0, j], now[j], bracket[1, j], lags, min_lag) - commanded
        behind_max = _between(bracket[0, j], now[j], bracket[1, j], lags, max_lag) - commanded
        thrusters.acting[j] = commanded + average * behind
        now[j] = commanded + remains * behind
        bracket[0, j] = commanded + remains_min * behind_min
        bracket[1, j] = commanded + remains_max * behind_max
        estimate.by_lag[j] = (average_max * behind_max - average_min * behind_min) / (max_lag - min_lag)
        by_secant = average_min * behind_min + estimate.by_lag[j] * (lag - min_lag)
        estimate.curvature[j] = average * behind - by_secant
    lags[0], lags[1], lags[2] = min_lag, lag, max_lag


def _between(least: float, middle: float, most: float, lags: Array, lag: float) -> float:
    """Interpolate the force behind a lag from those behind three `lags`; beyond them, return the nearest."""
    first, low, high = 1, middle, most
    if lag < lags[1]:
        first, low, high = 0, least, middle
    fraction = (lag - lags[first]) / (lags[first + 1] - lags[first])
    between: float = low + min(max(fraction, 0.0), 1.0) * (high - low)
    return between


def _of_lag(lag: float, period: float) -> tuple[float, float]:
    """Return the fraction of a force that remains after a period [s] with a lag [s], and its mean over the period."""
    if lag < 0.03 * period:  # exp(-33) is negligible
        return 0.0, lag / period
    remains = exponential(-period / lag)
    return remains, lag / period * (1.0 - remains)


class PredictedState(State):
    """The predicted state, ahead by the lag."""

    position: Vector3  # m, NED
    velocity: Vector6  # m/s over ground, NED, and rad/s, body axes
    quaternion: Vector4  # from body to world


def predict_state(
    predicted: PredictedState,
    position: Vector3,
    velocity: Vector3,
    quaternion: Vector4,
    omega: Vector3,
    acceleration: Vector6,
    lag: float,
) -> None:
    """Predict the state ahead; position, velocity [m], omega [rad/s], acceleration [m/s2], lag [s]."""
    predicted.position = position + lag * velocity
    predicted.velocity = np.concatenate((velocity, omega)) + lag * acceleration
    angle = lag * norm(omega)
    limited_lag = lag if angle < _GREATEST_TURN else lag * _GREATEST_TURN / angle
    predicted.quaternion = integrate_attitude(quaternion, omega, limited_lag)
