"""Detection of failed thrusters, by the innovations of the observer."""

# There are two hypotheses about each thruster: it loses its force, or it is stuck at its present force. If one holds,
# the true state deviates from the estimate: at first by the lost effectiveness, or by the force that no longer changes;
# then as the filter propagates any error of its state (Willsky and Jones, 1976). So the deviation includes the filter's
# false adaptation of other states. The log-likelihood ratio of a hypothesis against "no failure" is summed, never below
# zero: Page's test. At zero the hypothesis restarts; that is the supposed time of the failure.
#
# A moment or a velocity that can have other causes has little weight, since the covariance of the innovation includes
# them: an uncertain effectiveness or lag, unknown restoring moments, W - B, current, the height of the center of
# gravity. So a thruster that fails at low thrust is detected when it is used.
#
# A small missing force cannot be told from a lasting error of the model: while it would be less than `_EXCITED`,
# evidence raises the sum to at most half the threshold. So a thruster that gives little is isolated once it is used.
#
# While the innovations are biased, the model does not fit, and evidence counts less: by the square of their misfit. A
# thruster that saturates does not count as failed, since its true limit is estimated (`thrust_limit`).
#
# A thruster has failed if its sum exceeds the threshold, and that of every other thruster by a lead. By the likeliest
# loss it is kept with its remaining effectiveness, or isolated. The deviation is added to the state. A thruster
# isolated by a narrow lead is tried again, once, when another one is isolated. If several are isolated, one of them may
# be a false alarm: each is tried again after a while, in turn, while no barrier is active; a failed one is soon
# isolated again. A thruster that is reported as failed is never tried.

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.laws.deployable.estimate import (
    EFFECTIVENESS,
    Estimate,
    Evidence,
    Hypotheses,
    inflate_effectiveness,
    set_effectiveness,
)
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import Thrusters
from controller.stack_array import Shape
from controller.state import State

Array = NDArray[np.float64]
Counts = Annotated[NDArray[np.int64], Shape("m")]

_MOST_A_STEP = 3.0  # limit of the log-likelihood ratio per step, so that no single outlier decides
_LOSS = 0.6  # fraction of force that the hypothesis of a loss assumes lost: close enough to both a half and all
_EXCITED = 0.1  # missing force, as a fraction of a thruster's limit, that stands out from errors of the model
_USEFUL = 0.15  # effectiveness below which a thruster is isolated
_FITTING = 0.5  # mean effectiveness below which that is less in proportion: then the model does not fit
_SPREADS = 3.0  # number of standard deviations by which an estimate must be below that
_LEAD = 8.0  # least lead of the log-likelihood ratio of the likeliest thruster over the next
_STUCK_SPREAD = 0.5  # standard deviation of a stuck thruster's force, as a fraction of that force
_CERTAIN = 40.0  # lead from which an isolation is not tentative
_TRIAL = 5.0  # s from the last isolation or trial to a thruster's first trial
_RARER = 8  # factor by which that time grows with each trial


class FaultState(State):
    """The hypotheses, two for each thruster."""

    ratio: Hypotheses  # summed log-likelihood ratio: thruster j is lost; m + j: is stuck
    sums: Evidence  # sums of `Estimate.evidence` since the supposed time of the failure
    # isolations of each thruster, one by a wide lead counted twice: at 1, it is used again if another is isolated
    tentative: Counts
    trials: Counts  # number of trials of each thruster after an isolation
    waited: float  # s since the last isolation or trial


def detect_fault(fault_state: FaultState, estimate: Estimate, thrusters: Thrusters, gains: DeployableGains) -> int:
    """Test the last measurements, isolate a thruster that has failed, and return it, or -1."""
    if gains.failure_threshold <= 0.0:
        return -1
    m, ratio, x = thrusters.health.size, fault_state.ratio, estimate.state
    best, next_best, suspect = 0.0, 0.0, -1
    for j in range(m):
        if thrusters.health[j] == 0.0:
            ratio[j] = ratio[m + j] = 0.0
            continue
        for kind in range(2):
            _add_evidence(fault_state, estimate, thrusters, j, kind * m + j, gains)
        likelihood = max(ratio[j], ratio[m + j])
        if likelihood > best:
            best, next_best, suspect = likelihood, best, j
        elif likelihood > next_best:
            next_best = likelihood
    if best > gains.failure_threshold and best > next_best + _LEAD:
        hypothesis = _likelier(fault_state, suspect, m)
        fault_state.tentative[suspect] += 1 if best < next_best + _CERTAIN else 2
        loss = 1.0
        if hypothesis == suspect:
            loss = fault_state.sums[0, suspect] / fault_state.sums[1, suspect]
        remaining = x[EFFECTIVENESS + suspect] * (1.0 - loss)
        for i in range(x.size):
            x[i] += loss * estimate.deviation[hypothesis, i]
        force = np.nan
        if hypothesis > suspect:
            force = estimate.supposed[0, suspect] * estimate.supposed[1, suspect]
        elif remaining > _USEFUL:  # kept with the remaining effectiveness
            fault_state.tentative[suspect] = 0
            inflate_effectiveness(estimate, suspect)
            _start_all_anew(fault_state, estimate, thrusters)
            return -1
        _isolate(fault_state, estimate, thrusters, suspect, force)
        return suspect
    usual = 0.0  # mean effectiveness
    for j in range(m):
        usual += x[EFFECTIVENESS + j] / m
    useful = _USEFUL * min(usual / _FITTING, 1.0)
    for j in range(m):
        spread = max(estimate.misfit, 1.0) * np.sqrt(estimate.covariance[EFFECTIVENESS + j, EFFECTIVENESS + j])
        if thrusters.health[j] > 0.0 and x[EFFECTIVENESS + j] + _SPREADS * spread < useful:
            fault_state.tentative[j] += 1
            _isolate(fault_state, estimate, thrusters, j, np.nan)
            return j
    return -1


def try_again(
    fault_state: FaultState, estimate: Estimate, thrusters: Thrusters, reported: Array, quiet: bool, period: float
) -> int:
    """Try one of several isolated thrusters again after a while, and return it, or -1; reported (m,), period [s]."""
    fault_state.waited += period
    isolated, candidate = 0, -1
    for j in range(thrusters.health.size):
        if thrusters.health[j] == 0.0 and reported[j] > 0.0:
            isolated += 1
            if candidate < 0 or fault_state.trials[j] < fault_state.trials[candidate]:
                candidate = j
    if isolated < 2 or not quiet or fault_state.waited < _TRIAL * _RARER ** fault_state.trials[candidate]:
        return -1
    fault_state.waited = 0.0
    fault_state.trials[candidate] += 1
    fault_state.tentative[candidate] = 0
    thrusters.health[candidate], thrusters.stuck[candidate] = 1.0, np.nan
    set_effectiveness(estimate, candidate, 1.0)
    _start_all_anew(fault_state, estimate, thrusters)
    return candidate


def _likelier(fault_state: FaultState, j: int, m: int) -> int:
    """Return the index of the likelier hypothesis about thruster j: j if it lost force, m + j if it is stuck."""
    sums = fault_state.sums
    lost = 0.5 * square(sums[0, j]) / sums[1, j] if sums[0, j] > 0.0 else 0.0
    stuck = sums[0, m + j] - 0.5 * sums[1, m + j]
    return j if lost > stuck else m + j


def _add_evidence(
    fault_state: FaultState, estimate: Estimate, thrusters: Thrusters, j: int, hypothesis: int, gains: DeployableGains
) -> None:
    """Add the evidence of the last measurements for a hypothesis about thruster j."""
    weight = 1.0 / square(max(estimate.misfit, 1.0))
    innovations, squares = weight * estimate.evidence[0, hypothesis], weight * estimate.evidence[1, hypothesis]
    loss = _LOSS if hypothesis == j else 1.0
    step = loss * innovations - 0.5 * square(loss) * squares
    # the force that would be missing now
    missing = estimate.state[EFFECTIVENESS + j] * thrusters.acting[j] if hypothesis == j else estimate.missing[j]
    counted = 1.0  # fraction of the evidence
    if step > 0.0 and abs(missing) < _EXCITED * max(-thrusters.nominal_lower[j], thrusters.nominal_upper[j]):
        counted = min(max(0.5 * gains.failure_threshold - fault_state.ratio[hypothesis], 0.0) / step, 1.0)
    fault_state.ratio[hypothesis] += min(max(counted * step, -_MOST_A_STEP), _MOST_A_STEP)
    fault_state.sums[0, hypothesis] += counted * innovations
    fault_state.sums[1, hypothesis] += counted * squares
    if not fault_state.ratio[hypothesis] > 0.0:
        _start_anew(fault_state, estimate, thrusters, j, hypothesis)


def _start_anew(fault_state: FaultState, estimate: Estimate, thrusters: Thrusters, j: int, hypothesis: int) -> None:
    """Restart a hypothesis: the supposed failure of thruster j is now."""
    fault_state.ratio[hypothesis] = fault_state.sums[0, hypothesis] = fault_state.sums[1, hypothesis] = 0.0
    estimate.deviation[hypothesis, :] = 0.0
    if hypothesis == j:
        estimate.deviation[j, EFFECTIVENESS + j] = -estimate.state[EFFECTIVENESS + j]
    else:
        estimate.supposed[0, j], estimate.supposed[1, j] = estimate.state[EFFECTIVENESS + j], thrusters.acting_now[j]


def _start_all_anew(fault_state: FaultState, estimate: Estimate, thrusters: Thrusters) -> None:
    """Restart all hypotheses: the supposed failure of each thruster is now."""
    m = thrusters.health.size
    for j in range(m):
        _start_anew(fault_state, estimate, thrusters, j, j)
        _start_anew(fault_state, estimate, thrusters, j, m + j)


def _isolate(fault_state: FaultState, estimate: Estimate, thrusters: Thrusters, failed: int, force: float) -> None:
    """Mark a thruster as failed, stuck at a force [N] or NaN; restore those that were isolated by a narrow lead."""
    for j in range(thrusters.health.size):
        if thrusters.health[j] == 0.0 and fault_state.tentative[j] == 1:
            thrusters.health[j], thrusters.stuck[j] = 1.0, np.nan
            set_effectiveness(estimate, j, 1.0)
    fault_state.waited = 0.0
    estimate.bias[:] = 0.0
    estimate.misfit = 1.0
    thrusters.health[failed], thrusters.stuck[failed] = 0.0, force
    set_effectiveness(estimate, failed, 0.0 if np.isnan(force) else 1.0)
    if not np.isnan(force):  # the force is uncertain, and may be zero
        estimate.covariance[EFFECTIVENESS + failed, EFFECTIVENESS + failed] = square(_STUCK_SPREAD)
    _start_all_anew(fault_state, estimate, thrusters)
