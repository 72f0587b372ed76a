"""Barriers: what the thrusters must do so that no hard region is violated.

Clearance less a margin is h, of relative degree two. Far away its rate may be what braking can still stop,

    dh/dt >= -phi(h),   phi(h) = sqrt(2 a h + (a / kappa)^2) - a / kappa   (h >= 0),   kappa h   (h < 0),

with a the deceleration that may be relied on. psi = dh/dt + phi(h) >= 0 is kept by dpsi/dt >= -rate psi, which is linear
in the thruster forces u:

    n^T A u >= -rate (dh/dt + phi) - phi' dh/dt - n^T a_free - (dn/dt)^T v,

with n the slope of the clearance, A u what the thrusters add to the acceleration and a_free what there is without them.
Along psi = 0 it asks for a (1 - (a / kappa) / sqrt(2 a h + (a / kappa)^2)) < a: never for more than there is. A region's own
velocity enters through dh/dt.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.compiled import compiled
from controller.laws.deployable.attraction import approach_speed
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.quadratic_program import Workspace
from controller.regions import PackedRegions, evaluate_packed

Array = NDArray[np.float64]

_AHEAD = 0.1  # s, over which the turning of a slope is measured
_FIRM = (3.0, 3.0)  # decades: price of yielding against missing the wanted force, at weight 0, and added at weight 1


class Sight(NamedTuple):
    """Regions as seen from the estimate, now and a moment later."""

    values: Array  # (n,)
    gradients: Array  # (n, 3)
    turnings: Array  # (n, 3)
    clearances: Array  # (n,)
    later_values: Array  # (n,)
    later_gradients: Array  # (n, 3)
    later_turnings: Array  # (n, 3)
    later_clearances: Array  # (n,)
    row_of: NDArray[np.int64]  # (n,) row of the program, -1 where it has none


def sight_of(n: int) -> Sight:
    """Return room for `n` regions."""
    return Sight(
        np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n),
        np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(n, np.int64),
    )  # fmt: skip


@compiled
def look(sight: Sight, regions: PackedRegions, position: Array, quaternion: Array, velocity: Array) -> None:
    """Evaluate the regions at the estimated position [m] and where its velocity [m/s] leads, shape (3,) each."""
    s = sight
    evaluate_packed(regions, position, quaternion, s.values, s.gradients, s.turnings, s.clearances)
    later = position + _AHEAD * velocity
    evaluate_packed(regions, later, quaternion, s.later_values, s.later_gradients, s.later_turnings, s.later_clearances)


@compiled
def _slope(gradients: Array, i: int, out: Array) -> bool:
    """Write the slope of the clearance, of length 1; False where the gradient vanishes."""
    size = np.sqrt(gradients[i, 0] ** 2 + gradients[i, 1] ** 2 + gradients[i, 2] ** 2)
    if not size > 0.0:
        return False
    for axis in range(3):
        out[axis] = -gradients[i, axis] / size
    return True


@compiled
def write_rows(
    work: Workspace,
    sight: Sight,
    regions: PackedRegions,
    weights: Array,
    velocity: Array,
    free: Array,
    push: Array,
    lower: Array,
    upper: Array,
    mass: float,
    braking: float,
    margin: float,
    gains: DeployableGains,
) -> int:
    """Write a row for each hard region that the thrusters could violate, and return how many there are.

    Parameters
    ----------
    work : Workspace
        Receives rows, right sides and prices.
    sight : Sight
        From `look`; `row_of` is filled.
    regions : PackedRegions
        The n regions.
    weights : ndarray, shape (n,)
        Of the arbiter: a region of greater weight yields later.
    velocity : ndarray, shape (3,)
        Over ground [m/s], NED.
    free : ndarray, shape (3,)
        Acceleration without thrust [m/s2], NED.
    push : ndarray, shape (3, m)
        Acceleration of one newton of each thruster [m/s2], NED.
    lower, upper : ndarray, shape (m,)
        Limits [N].
    mass : float
        [kg]; puts prices on the scale of forces.
    braking : float
        Deceleration that may be relied on [m/s2].
    margin : float
        Clearance to be kept [m].
    gains : DeployableGains
        Slope and rate.

    Returns
    -------
    int
        Rows written.
    """
    rows, n, later_n = 0, np.empty(3), np.empty(3)
    m = lower.size
    for i in range(regions.kinds.size):
        sight.row_of[i] = -1
        if not regions.hard[i] or not _slope(sight.gradients, i, n):
            continue
        h = sight.clearances[i] - margin
        rate, turning, falling = 0.0, 0.0, 0.0
        turns = _slope(sight.later_gradients, i, later_n)
        for axis in range(3):
            relative = velocity[axis] - regions.velocities[i, axis]
            rate += n[axis] * relative
            falling += n[axis] * free[axis]
            if turns:
                turning += (later_n[axis] - n[axis]) / _AHEAD * relative
        allowed = approach_speed(h, braking, gains.barrier_slope)
        slope = gains.barrier_slope
        if h > 0.0:
            slope = braking / (allowed + braking / gains.barrier_slope)
        right = -gains.barrier_rate * (rate + allowed) - slope * rate - falling - turning
        least = 0.0
        for j in range(m):
            along = n[0] * push[0, j] + n[1] * push[1, j] + n[2] * push[2, j]
            work.rows[rows, j] = along
            least += along * (lower[j] if along > 0.0 else upper[j])
        if right <= least:  # whatever the thrusters do, it holds
            continue
        work.right[rows] = right
        work.price[rows] = 10.0 ** (-_FIRM[0] - _FIRM[1] * weights[i]) / mass**2
        sight.row_of[i] = rows
        rows += 1
    return rows
