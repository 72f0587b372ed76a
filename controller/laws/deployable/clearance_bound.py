"""The lower bound of the clearances of hard regions from now on, `law.bound`, and the errors that it rests on."""

# docs/theory.md has the proof. Each step predicts the point with barriers at the next one. What it then differs by
# corrects errors of model and estimate; the sums of such corrections, which are forgotten at `barrier_rate`, are what
# errors have added to psi.

from __future__ import annotations

import numpy as np

from controller.laws.deployable.barrier import Motion, margin_of
from controller.laws.deployable.estimate import VELOCITY, Estimate
from controller.laws.deployable.gains import SPREADS, DeployableGains
from controller.linear_algebra import norm
from controller.quadratic_program import Workspace
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, position_clearance
from controller.stack_array import Array, Vector3, zeros
from controller.state import State

KEPT = 0.01  # m/s2, slack up to which a barrier counts as kept
_LEAP = 0.05  # m, fall of the bound in a step that counts as a jump: more than the vehicle's motion can cause
_MEMORY = 10.0  # s, time constant at which the maximum error is forgotten
_FIRST_ERROR = 0.1  # m/s, assumed before anything is known: an error of the acceleration of 0.4 m/s2


class ClearanceBound(State):
    """The bound, and the errors of the predictions of the point with barriers."""

    position: Vector3  # m, NED: prediction for the next step
    velocity: Vector3  # m/s, NED: the same
    predicts: bool  # True if there is a prediction
    by_position: Vector3  # m, NED: sum of the position's corrections, forgotten at `barrier_rate`
    by_velocity: Vector3  # m/s, NED: that of the velocity's
    error: float = _FIRST_ERROR  # m/s, maximum effect of both on psi of late
    last: float = np.nan  # m, bound by h and psi of the last step; NaN without one
    bound: float = np.nan  # m, of the clearances from now on; NaN without one


def withdraw_bound(b: ClearanceBound) -> None:
    """Withdraw the bound, and forget the errors: there is no estimate."""
    b.bound = b.last = np.nan
    b.predicts, b.error, b.by_position[:], b.by_velocity[:] = False, _FIRST_ERROR, 0.0, 0.0


def measure_error(b: ClearanceBound, motion: Motion, gains: DeployableGains, period: float) -> bool:
    """Compare the point with its prediction a period [s] ago; return True if the maximum error rises."""
    if not b.predicts:
        return False
    kept = max(1.0 - gains.barrier_rate * period, 0.0)
    b.by_velocity = kept * b.by_velocity + (motion.velocity[:3] - b.velocity)
    b.by_position = kept * b.by_position + (motion.position - b.position)
    error = norm(b.by_velocity) + gains.barrier_slope * norm(b.by_position)
    rises = bool(error > b.error)
    b.error = max(error, b.error * (1.0 - period / _MEMORY))
    return rises


def predict_point(b: ClearanceBound, motion: Motion, forces: Array, period: float) -> None:
    """Predict the point at the next step under the forces of the thrusters [N]; period [s]."""
    acceleration = motion.free_acceleration[:3] + motion.thruster_acceleration[:3] @ forces
    b.position = motion.position + period * (motion.velocity[:3] + 0.5 * period * acceleration)
    b.velocity = motion.velocity[:3] + period * acceleration
    b.predicts = True


def max_slack(work: Workspace, rows: int, forces: Array) -> float:
    """Return the maximum slack [m/s2] of the first rows of the program under the forces [N]."""
    slack = 0.0
    for i in range(rows):
        slack = max(slack, work.rhs[i] - work.rows[i] @ forces)
    return slack


def vehicle_bound(regions: PackedRegions, position: Vector3, motion: Motion, gains: DeployableGains) -> float:
    """Return the lower bound [m] of the vehicle's own clearances now, at most 0: it follows the point with barriers."""
    # `regions` are at their present positions, and the vehicle at a `position` [m, NED].
    bound, n = 0.0, zeros(6)
    for i in range(regions.kinds.size):
        if regions.hard[i] and regions.kinds[i] < FIRST_OF_ATTITUDE:
            clearance = position_clearance(regions, i, position, n[:3])
            bound = min(bound, gains.margin + clearance - margin_of(n, motion, regions.deviations[i], False, gains))
    return bound


def error_loss(b: ClearanceBound, estimate: Estimate, slack: float, lag: float, gains: DeployableGains) -> float:
    """Return the clearance [m] that errors and slack [m/s2] may cost beyond the margin; lag [s]."""
    variance = 0.0  # m2/s2, of the velocity
    for axis in range(VELOCITY, VELOCITY + 3):
        variance = max(variance, estimate.covariance[axis, axis])
    rate = (2.0 + gains.barrier_rate * lag) * b.error + SPREADS * np.sqrt(variance)
    rate += max(slack, KEPT) / gains.barrier_rate
    return float(max(rate / gains.barrier_slope - gains.margin, 0.0))


def update_bound(b: ClearanceBound, now: float, loss: float, restarts: bool) -> None:
    """Raise the bound to that by h and psi of this step, `now`, less the loss by errors; or restart there [m]."""
    # A falling `now` does not lower the bound, which would else follow any violation.
    if restarts or not now >= b.last - _LEAP:
        b.bound = now - loss
    b.bound, b.last = max(b.bound, now - loss), now
