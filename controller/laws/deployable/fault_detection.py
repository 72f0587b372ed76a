"""Detection of a failed thruster from measured rates and velocity.

The hypothesis about each thruster is that it gives no force. Then the moment that the model lacks is -b_i f_i, less the
part that the restoring moments have adapted to since; and the velocity lags its prediction by the effect of -b_i f_i
within the observer's loop. The log-likelihood ratio against "all work" is summed, never below zero: Page's test, whose
hypothesis starts anew whenever the sum is at zero, the supposed time of the failure. The thruster is isolated when its
sum passes the threshold, well ahead of every other.

A moment counts only where the thruster's part of it exceeds the model's own uncertainty: an angular acceleration; more
of it in roll and pitch while the vehicle accelerates, for the height of the centre of gravity is unknown; and a tenth
of the force that each thruster is assumed to give. So a thruster that fails at low thrust is found when it is used.

A single failure is assumed: isolating a thruster restores the one that was isolated before, but never one that was
reported as failed. A thruster that was isolated wrongly is only idle; the one that has failed is found afterwards, and
takes its place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import norm
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.laws.deployable.observer import Estimate
from controller.stack_array import zeros

Array = NDArray[np.float64]

_UNMODELLED = 0.06  # rad/s2, standard deviation of the angular acceleration that the model lacks
_BELOW = 0.02  # m, standard deviation of how far the centre of gravity lies above or below the origin
_EFFECTIVENESS = 0.1  # standard deviation of a working thruster's force, as part of the assumed one
_STANDS_OUT = 2.0  # standard deviations that a thruster's moment must exceed to count
_CORRELATED = 0.1  # s, correlation time of the moment that the model lacks
_MOST_A_STEP = 3.0  # of the log-likelihood ratio of either kind, so that no single outlier decides
_LEAD = 8.0  # of the likeliest thruster before the next


class FaultState(NamedTuple):
    """The hypotheses, one for each thruster."""

    ratio: Array  # (m,) summed log-likelihood ratio
    lag: Array  # (m, 3) m/s, lag of the velocity behind its prediction, NED
    adapted: Array  # (m, 3) N m, body axes: part of the failure that the restoring moments have adapted to
    isolated: NDArray[np.int64]  # (1,) the isolated thruster, -1 for none


def empty_fault_state(m: int) -> FaultState:
    """Return the state for `m` thrusters, all sums at zero."""
    return FaultState(np.zeros(m), np.zeros((m, 3)), np.zeros((m, 3)), np.full(1, -1))


def detect_fault(
    fault_state: FaultState,
    estimate: Estimate,
    residual: Array,
    dynamics: Dynamics,
    thrusters: Thrusters,
    R: Array,
    gains: DeployableGains,
    period: float,
    measured: bool,
) -> int:
    """Test the last period, and return the thruster that has failed, or -1.

    Parameters
    ----------
    fault_state : FaultState
        Updated in place.
    estimate : Estimate
        With the innovation of the last correction.
    residual : ndarray, shape (3,)
        Moment that the model lacked [N m].
    dynamics, thrusters : Dynamics, Thrusters
        Of the vehicle.
    R : ndarray, shape (3, 3)
        From body to world.
    gains : DeployableGains
        The threshold, and the rate of adaptation.
    period : float
        [s].
    measured : bool
        Whether there was a valid measurement; without one, only the lags are propagated.

    Returns
    -------
    int
        From 0; -1 for none.
    """
    if gains.failure_threshold <= 0.0:
        return -1
    m, variance = thrusters.health.size, zeros(3)
    for axis in range(3):
        variance[axis] = (
            0.0 if axis == 2 else square(_BELOW * dynamics.translational_mass[0] * norm(estimate.acceleration))
        )
        variance[axis] += square(_UNMODELLED * dynamics.mass[3 + axis, 3 + axis])
        for i in range(m):
            variance[axis] += square(_EFFECTIVENESS * thrusters.matrix[3 + axis, i] * thrusters.forces[i])
    mass, weight = dynamics.translational_mass[0], min(period / _CORRELATED, 1.0)
    best, next_best, at = 0.0, 0.0, -1
    for i in range(m):
        if thrusters.health[i] == 0.0:
            continue
        effect, force = thrusters.nominal_matrix[:, i], thrusters.forces[i]
        step = _by_velocity(
            fault_state.lag[i],
            effect,
            force * period / mass,
            R,
            estimate.innovation,
            estimate.innovation_deviation,
            estimate.gain,
            measured,
        )
        if measured:
            step += weight * _by_moment(
                fault_state.adapted[i], effect, force, residual, variance, R, gains.adaptation * period
            )
        fault_state.ratio[i] += step
        if not fault_state.ratio[i] > 0.0:
            fault_state.ratio[i], fault_state.lag[i, :], fault_state.adapted[i, :] = 0.0, 0.0, 0.0
        if fault_state.ratio[i] > best:
            best, next_best, at = fault_state.ratio[i], best, i
        elif fault_state.ratio[i] > next_best:
            next_best = fault_state.ratio[i]
    if best > gains.failure_threshold and best > next_best + _LEAD:
        return at
    return -1


def _by_velocity(
    lag: Array,
    effect: Array,
    impulse: float,
    R: Array,
    innovation: Array,
    innovation_deviation: Array,
    gain: Array,
    measured: bool,
) -> float:
    """Return the log-likelihood ratio of the last innovation, and propagate a thruster's lag over the period.

    Takes arrays, not named tuples, which would cost more to pass than the work itself.
    """
    step = 0.0
    for axis in range(3):
        lag[axis] -= (R[axis, 0] * effect[0] + R[axis, 1] * effect[1] + R[axis, 2] * effect[2]) * impulse
        if measured:
            step += lag[axis] * (2.0 * innovation[axis] - lag[axis]) / (2.0 * square(innovation_deviation[axis]))
            lag[axis] *= 1.0 - gain[axis]
    return min(max(step, -_MOST_A_STEP), _MOST_A_STEP)


def _by_moment(
    adapted: Array, effect: Array, force: float, residual: Array, variance: Array, R: Array, adaptation: float
) -> float:
    """Return the log-likelihood ratio of the last residual, and propagate the adapted part over the period.

    The adaptation moves S(k) phi_hat towards the residual at its rate, in all directions but k: S(k) S(k) = k k^T - I.
    """
    step, size, along = 0.0, 0.0, 0.0
    for j in range(3):
        missing = adapted[j] - effect[3 + j] * force
        along += R[2, j] * missing  # k = R^T e3
        size += square(missing) / variance[j]
        step += missing * (2.0 * residual[j] - missing) / (2.0 * variance[j])
    for j in range(3):
        adapted[j] -= adaptation * (adapted[j] - effect[3 + j] * force - along * R[2, j])
    if not size > square(_STANDS_OUT):
        return 0.0
    return min(max(step, -_MOST_A_STEP), _MOST_A_STEP)


def isolate_thruster(fault_state: FaultState, thrusters: Thrusters, failed: int) -> None:
    """Mark a thruster as failed in `health`, and restore the one that was isolated before it.

    Parameters
    ----------
    fault_state : FaultState
        Reset.
    thrusters : Thrusters
        Whose `health` changes; the caller calls `model.reallocate`.
    failed : int
        From 0.
    """
    if fault_state.isolated[0] >= 0:
        thrusters.health[fault_state.isolated[0]] = 1.0
    fault_state.isolated[0] = failed
    thrusters.health[failed] = 0.0
    fault_state.ratio[:] = 0.0
    fault_state.lag[:, :] = 0.0
    fault_state.adapted[:, :] = 0.0
