"""Which thruster has failed, from what the vehicle measures.

Each thruster has a hypothesis: it gives nothing. If it holds, the moment that the model misses is -b_i f_i, and the
velocity falls behind its prediction by what -b_i f_i makes of it within the observer's loop. The log-likelihood ratio
against "all is well" is summed, never below zero (Page's test; the hypothesis starts anew whenever it is at zero, which is
the time at which the failure is supposed to have happened), and the thruster is given up when its sum passes the
threshold, ahead of every other. A single failure is the rule: a second alarm first takes back the earlier one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.compiled import compiled
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Dynamics, Thrusters
from controller.laws.deployable.observer import Estimate

Array = NDArray[np.float64]

_MOMENT_SPREAD = 2.0  # N m, of what the model misses of a moment
_LEAST_MOMENT = 1.5  # N m: a thruster that gives less has nothing to tell by its moment
_MOST_A_STEP = 3.0  # of the log-likelihood ratio, lest one odd measurement decided
_LEAD = 8.0  # by which the likeliest must be ahead of the next


class Suspicion(NamedTuple):
    """The hypotheses, one for each thruster."""

    ratio: Array  # (m,) summed log-likelihood ratio
    lag: Array  # (m, 3) m/s, how far velocity falls behind its prediction, NED
    count: NDArray[np.int64]  # (1,) thrusters given up so far


def suspicion_of(m: int) -> Suspicion:
    """Return the hypotheses about `m` thrusters, all at zero."""
    return Suspicion(np.zeros(m), np.zeros((m, 3)), np.zeros(1, dtype=np.int64))


@compiled
def suspect(
    suspicion: Suspicion,
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
    suspicion : Suspicion
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
        The threshold.
    period : float
        [s].
    measured : bool
        Whether there was a valid measurement of the velocity.

    Returns
    -------
    int
        From 0; -1 for none.
    """
    if gains.failure_threshold <= 0.0:
        return -1
    m = thrusters.health.size
    best, next_best, at = 0.0, 0.0, -1
    for i in range(m):
        if thrusters.health[i] == 0.0:
            continue
        force = thrusters.forces[i]
        step = 0.0
        # moment: |r|^2 - |r - r_i|^2, with r_i = -b_i f_i
        size = 0.0
        for j in range(3):
            size += (thrusters.whole[3 + j, i] * force) ** 2
        if size > _LEAST_MOMENT**2:
            for j in range(3):
                supposed = -thrusters.whole[3 + j, i] * force
                step += supposed * (2.0 * residual[j] - supposed) / (2.0 * _MOMENT_SPREAD**2)
        # velocity, through the observer's loop
        for axis in range(3):
            lag = 0.0
            for j in range(3):
                lag -= R[axis, j] * thrusters.whole[j, i] * force
            lag *= period / dynamics.translational_mass[0]
            suspicion.lag[i, axis] += lag
            if measured:
                supposed = suspicion.lag[i, axis]
                step += supposed * (2.0 * estimate.innovation[axis] - supposed) / (2.0 * estimate.spread[axis] ** 2)
                suspicion.lag[i, axis] *= 1.0 - estimate.gain[axis]
        suspicion.ratio[i] += min(max(step, -_MOST_A_STEP), _MOST_A_STEP)
        if suspicion.ratio[i] <= 0.0:
            suspicion.ratio[i] = 0.0
            suspicion.lag[i, :] = 0.0
        if suspicion.ratio[i] > best:
            best, next_best, at = suspicion.ratio[i], best, i
        elif suspicion.ratio[i] > next_best:
            next_best = suspicion.ratio[i]
    if best > gains.failure_threshold and best > next_best + _LEAD:
        return at
    return -1


@compiled
def give_up(suspicion: Suspicion, thrusters: Thrusters, failed: int) -> None:
    """Take a thruster out of `health`, and doubt whether the one that was taken out before deserved it."""
    if suspicion.count[0] == 1:
        thrusters.health[:] = 1.0
    else:
        suspicion.count[0] += 1
    thrusters.health[failed] = 0.0
    suspicion.ratio[:] = 0.0
    suspicion.lag[:, :] = 0.0
