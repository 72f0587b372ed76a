"""Which thruster has failed, from what the vehicle measures.

Each thruster has a hypothesis: it gives nothing. If it holds, the moment that the model misses is -b_i f_i, less what
the restoring moments have since been adapted to explain of it; and the velocity falls behind its prediction by what
-b_i f_i makes of it within the observer's loop. The log-likelihood ratio against "all is well" is summed, never below
zero (Page's test; the hypothesis starts anew whenever it is at zero, which is the time at which the failure is supposed
to have happened), and the thruster is given up when its sum passes the threshold, well ahead of every other.

A moment tells only where the thruster's part of it stands out from what the model may miss anyway: an angular
acceleration, more of it in roll and pitch while the vehicle speeds up, for the height of its centre of gravity is not
told, and a tenth of what each thruster is believed to give. So a thruster that fails while it pushes little is found
when it is used.

A single failure is the rule: a suspicion takes back the one before, never what was told. A thruster that was given up
wrongly is only left idle; the one that has in truth failed goes on being missed, is found, and takes its place.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import part
from controller.jit.stack_array import zeros
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import norm
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.laws.deployable.observer import Estimate

Array = NDArray[np.float64]

_UNMODELLED = 0.06  # rad/s2, standard deviation of the angular acceleration that the model misses
_BELOW = 0.02  # m, standard deviation of how far the centre of gravity lies above or below the origin
_EFFECTIVENESS = 0.1  # standard deviation of what a working thruster gives, as part of what it is believed to give
_STANDS_OUT = 2.0  # standard deviations that a thruster's moment must have to tell anything
_CORRELATED = 0.1  # s, for which what the model misses of a moment stays about the same
_MOST_A_STEP = 3.0  # of the log-likelihood ratio of either kind, lest one odd measurement decided
_LEAD = 8.0  # by which the likeliest must be ahead of the next


class FaultState(NamedTuple):
    """The hypotheses, one for each thruster."""

    ratio: Array  # (m,) summed log-likelihood ratio
    lag: Array  # (m, 3) m/s, how far velocity falls behind its prediction, NED
    adapted: Array  # (m, 3) N m, body axes: what the restoring moments explain of the failure by now
    suspected: NDArray[np.int64]  # (1,) the thruster that is given up on suspicion, -1 for none


def suspicion_of(m: int) -> FaultState:
    """Return the hypotheses about `m` thrusters, all at zero."""
    return FaultState(np.zeros(m), np.zeros((m, 3)), np.zeros((m, 3)), np.full(1, -1))


@part
def detect_fault(
    suspicion: FaultState,
    estimate: Estimate,
    residual: Array,
    dynamics: Dynamics,
    thrusters: Thrusters,
    R: Array,
    gains: DeployableGains,
    period: float,
    measured: bool,
) -> int:
    """Weigh the last period, and return the thruster that has failed, or -1.

    Parameters
    ----------
    suspicion : FaultState
        Updated in place.
    estimate : Estimate
        With the innovation of the last correction.
    residual : ndarray, shape (3,)
        Moment that the model missed [N m].
    dynamics, thrusters : Dynamics, Thrusters
        Of the vehicle.
    R : ndarray, shape (3, 3)
        From body to world.
    gains : DeployableGains
        The threshold, and the rate of adaptation.
    period : float
        [s].
    measured : bool
        Whether there was a valid measurement; without, nothing is learnt.

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
            0.0 if axis == 2 else (_BELOW * dynamics.translational_mass[0] * norm(estimate.acceleration)) ** 2
        )
        variance[axis] += (_UNMODELLED * dynamics.mass[3 + axis, 3 + axis]) ** 2
        for i in range(m):
            variance[axis] += (_EFFECTIVENESS * thrusters.matrix[3 + axis, i] * thrusters.forces[i]) ** 2
    mass, weight = dynamics.translational_mass[0], min(period / _CORRELATED, 1.0)
    best, next_best, at = 0.0, 0.0, -1
    for i in range(m):
        if thrusters.health[i] == 0.0:
            continue
        push, force = thrusters.whole[:, i], thrusters.forces[i]
        step = _by_velocity(
            suspicion.lag[i],
            push,
            force * period / mass,
            R,
            estimate.innovation,
            estimate.spread,
            estimate.gain,
            measured,
        )
        if measured:
            step += weight * _by_moment(
                suspicion.adapted[i], push, force, residual, variance, R, gains.adaptation * period
            )
        suspicion.ratio[i] += step
        if not suspicion.ratio[i] > 0.0:
            suspicion.ratio[i], suspicion.lag[i, :], suspicion.adapted[i, :] = 0.0, 0.0, 0.0
        if suspicion.ratio[i] > best:
            best, next_best, at = suspicion.ratio[i], best, i
        elif suspicion.ratio[i] > next_best:
            next_best = suspicion.ratio[i]
    if best > gains.failure_threshold and best > next_best + _LEAD:
        return at
    return -1


@part
def _by_velocity(
    lag: Array, push: Array, impulse: float, R: Array, innovation: Array, spread: Array, gain: Array, measured: bool
) -> float:
    """Return the log-likelihood ratio of the last innovation, and carry a thruster's lag over the period.

    Single arrays are passed: a call that passes named tuples costs more than the work.
    """
    step = 0.0
    for axis in range(3):
        lag[axis] -= (R[axis, 0] * push[0] + R[axis, 1] * push[1] + R[axis, 2] * push[2]) * impulse
        if measured:
            step += lag[axis] * (2.0 * innovation[axis] - lag[axis]) / (2.0 * spread[axis] ** 2)
            lag[axis] *= 1.0 - gain[axis]
    return min(max(step, -_MOST_A_STEP), _MOST_A_STEP)


@part
def _by_moment(
    adapted: Array, push: Array, force: float, residual: Array, variance: Array, R: Array, adaptation: float
) -> float:
    """Return the log-likelihood ratio of the last residual, and carry what is adapted over the period.

    The adaptation takes S(k) phi-hat after the residual at its rate, in all directions but k: S(k) S(k) = k k^T - I.
    """
    step, size, along = 0.0, 0.0, 0.0
    for j in range(3):
        missing = adapted[j] - push[3 + j] * force
        along += R[2, j] * missing  # k = R^T e3
        size += missing**2 / variance[j]
        step += missing * (2.0 * residual[j] - missing) / (2.0 * variance[j])
    for j in range(3):
        adapted[j] -= adaptation * (adapted[j] - push[3 + j] * force - along * R[2, j])
    if not size > _STANDS_OUT**2:
        return 0.0
    return min(max(step, -_MOST_A_STEP), _MOST_A_STEP)


@part
def give_up(suspicion: FaultState, thrusters: Thrusters, failed: int) -> None:
    """Take a suspected thruster out of `health`, and take back the one that was suspected before it.

    Parameters
    ----------
    suspicion : FaultState
        Starts anew.
    thrusters : Thrusters
        Whose `health` changes; `model.reallocate` is for the caller to do.
    failed : int
        From 0.
    """
    if suspicion.suspected[0] >= 0:
        thrusters.health[suspicion.suspected[0]] = 1.0
    suspicion.suspected[0] = failed
    thrusters.health[failed] = 0.0
    suspicion.ratio[:] = 0.0
    suspicion.lag[:, :] = 0.0
    suspicion.adapted[:, :] = 0.0
