"""Barriers: what the thrusters must do so that no hard region is violated.

The clearance less a margin is h, of relative degree two. Its rate may be what braking can still stop,

    dh/dt >= -phi(h),   phi(h) = sqrt(2 a h + (a / kappa)^2) - a / kappa   (h >= 0),   kappa h   (h < 0),

with a the deceleration that may be relied on. psi = dh/dt + phi(h) >= 0 is kept by dpsi/dt >= -rate psi, which is
linear in the thruster forces u:

    n^T A u >= -rate (dh/dt + phi) - phi' dh/dt - n^T a_free - (dn/dt)^T v,

with n the slope of h over the pose, v the velocity against the region, A u what the thrusters add to the acceleration
and a_free what there is without them. Along psi = 0 this asks for a (1 - (a / kappa) / sqrt(2 a h + (a / kappa)^2)),
which is less than a: never for more than there is. A region's own motion enters through dh/dt. Where a region has
several faces, those that lie ahead have barriers too: `faces.py`. Clearances of places are in m and look at position
alone; those of attitude (what the camera sees, which way the vehicle is turned) are in rad and look at both.
docs/deployable.md says what this promises and what not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import part
from controller.jit.stack_array import zeros
from controller.laws.deployable.attitude import turn
from controller.laws.deployable.attraction import approach_speed
from controller.laws.deployable.faces import FACES, face_ahead, has_faces
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy
from controller.laws.deployable.quadratic_program import Workspace
from controller.regions import Box, DepthBand, HalfSpace, Prism
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, evaluate_packed

Array = NDArray[np.float64]

_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on depend on attitude
_FLAT = (Box.kind, Prism.kind, DepthBand.kind, HalfSpace.kind)
_AHEAD = 0.1  # s, over which the turning of a slope is measured
_FIRM = (3.0, 3.0)  # decades: price of yielding against missing the wanted force, at weight 0, and added at weight 1
_LEAP = 0.5  # cosine of the turn of a slope within that time, beyond which it is a leap
_MARGIN_OF_ATTITUDE = 0.02  # rad


class Sight(NamedTuple):
    """Regions as seen from the estimate, now and a moment later."""

    values: Array  # (n,)
    gradients: Array  # (n, 3)
    rotation_gradients: Array  # (n, 3)
    clearances: Array  # (n,)
    later_shifts: Array  # (n, 3) m, of the regions
    later_values: Array  # (n,)
    later_gradients: Array  # (n, 3)
    later_rotation_gradients: Array  # (n, 3)
    later_clearances: Array  # (n,)


class Motion(NamedTuple):
    """How the vehicle moves and could move; first three of six along world axes, last three about body axes."""

    position: Array  # (3,) m, NED
    velocity: Array  # (6,) m/s over ground, rad/s
    free: Array  # (6,) m/s2, rad/s2: acceleration without thrust
    push: Array  # (6, m) m/s2, rad/s2: acceleration of one newton of each thruster
    mass: float  # kg
    inertia: float  # kg m2, mean
    braking: float  # m/s2 that may be relied on
    spread: float  # m, by which the position may be off: of the estimate, and between two steps


def sight_of(n: int) -> Sight:
    """Return room for `n` regions."""
    return Sight(
        np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros((n, 3)),
        np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n),
    )  # fmt: skip


@part
def look(sight: Sight, regions: PackedRegions, position: Array, quaternion: Array, velocity: Array) -> None:
    """Evaluate the regions at a pose [m, NED], and at the one to which a velocity leads, shape (6,) as in `Motion`."""
    s = sight
    evaluate_packed(regions, position, quaternion, s.values, s.gradients, s.rotation_gradients, s.clearances)
    r, place, attitude = regions, zeros(3), zeros(4)
    for axis in range(3):
        place[axis] = position[axis] + _AHEAD * velocity[axis]
        for i in range(r.kinds.size):
            s.later_shifts[i, axis] = r.shifts[i, axis] + _AHEAD * r.velocities[i, axis]
    turn(quaternion, velocity[3:], _AHEAD, attitude)
    moved = PackedRegions(
        r.kinds, r.signs, r.offsets, r.numbers, s.later_shifts, r.velocities, r.gains, r.hard, r.place, r.pose
    )
    evaluate_packed(
        moved, place, attitude, s.later_values, s.later_gradients, s.later_rotation_gradients, s.later_clearances
    )


@part
def slope_of(gradients: Array, rotation_gradients: Array, i: int, of_attitude: bool, out: Array) -> bool:
    """Write the slope of a clearance over the pose, shape (6,); False where there is none.

    A distance follows the gradient's direction with slope 1, whatever the unit of g; an angle is -g itself.
    """
    size = np.sqrt(gradients[i, 0] ** 2 + gradients[i, 1] ** 2 + gradients[i, 2] ** 2)
    turning = np.sqrt(rotation_gradients[i, 0] ** 2 + rotation_gradients[i, 1] ** 2 + rotation_gradients[i, 2] ** 2)
    if not size + turning > 0.0:
        return False
    scale = 1.0 if of_attitude else 1.0 / size
    for axis in range(3):
        out[axis] = -scale * gradients[i, axis]
        out[3 + axis] = -scale * rotation_gradients[i, axis]
    return True


@part
def turning_of(kind: int, n: Array, later: Array, velocity: Array) -> float:
    """Return (dn/dt)^T v, from a slope now and later, (6,) each, along a velocity [m/s, rad/s] against the region.

    The slope of a flat face does not turn, it leaps where another face is as near, which is nothing that the vehicle
    could follow: with flat faces only turning away counts, as round an edge; with others, no leap back.
    """
    turning, alike = 0.0, 0.0
    for axis in range(6):
        turning += (later[axis] - n[axis]) / _AHEAD * velocity[axis]
        alike += later[axis] * n[axis]
    if turning < 0.0 and kind < _ATTITUDE and (kind in _FLAT or alike < _LEAP):
        return 0.0
    return turning


@part
def write_rows(
    work: Workspace,
    sight: Sight,
    regions: PackedRegions,
    weights: Array,
    motion: Motion,
    lower: Array,
    upper: Array,
    gains: DeployableGains,
) -> int:
    """Write a row for each hard region that the thrusters could violate, and return how many there are.

    Parameters
    ----------
    work : Workspace
        Receives rows, right sides and prices.
    sight : Sight
        From `look`.
    regions : PackedRegions
        The n regions.
    weights : ndarray, shape (n,)
        Of the arbiter: a region of greater weight yields later.
    motion : Motion
        Of the vehicle.
    lower, upper : ndarray, shape (m,)
        Limits [N].
    gains : DeployableGains
        Margin, slope and rate.

    Returns
    -------
    int
        Rows written, (1 + FACES) n at most.
    """
    rows, n, later_n, relative, along_way = 0, zeros(6), zeros(6), zeros(6), zeros(3)
    for i in range(regions.kinds.size):
        of_attitude = regions.kinds[i] >= _ATTITUDE
        if not regions.hard[i] or not slope_of(sight.gradients, sight.rotation_gradients, i, of_attitude, n):
            continue
        braking, margin, scale = motion.braking, gains.margin + motion.spread, motion.mass**2
        if of_attitude:
            along, turned = n[0] ** 2 + n[1] ** 2 + n[2] ** 2, n[3] ** 2 + n[4] ** 2 + n[5] ** 2  # rad2/m2, 1
            braking, margin = gains.turning_deceleration, _MARGIN_OF_ATTITUDE + np.sqrt(along) * motion.spread
            scale = motion.mass**2 * along + motion.inertia**2 * turned
        price = 10.0 ** (-_FIRM[0] - _FIRM[1] * weights[i]) / max(scale, 1e-9)
        for axis in range(6):
            relative[axis] = motion.velocity[axis] - (regions.velocities[i, axis] if axis < 3 else 0.0)
        turning = 0.0
        if slope_of(sight.later_gradients, sight.later_rotation_gradients, i, of_attitude, later_n):
            turning = turning_of(regions.kinds[i], n, later_n, relative)
        distance, reach, faces = sight.clearances[i], 0.0, 1
        if not of_attitude and has_faces(regions.kinds[i]):
            copy(relative, along_way)
            speed = np.sqrt(along_way[0] ** 2 + along_way[1] ** 2 + along_way[2] ** 2)
            reach = margin + speed * (speed / (2.0 * braking) + 1.0 / gains.barrier_slope + 1.0 / gains.barrier_rate)
            if 0.0 < distance < reach:
                faces = 1 + FACES
        for face in range(faces):  # the nearest, and those ahead
            if face > 0:
                distance = face_ahead(regions, i, motion.position, n[:3], along_way, reach, later_n[:3])
                if not distance < np.inf:
                    break
                copy(later_n, n[:3])
                turning = 0.0  # flat, as far as is known

            # h, its rate, and what its second derivative is without thrust
            h, rate, falling = distance - margin, 0.0, 0.0
            for axis in range(6):
                rate += n[axis] * relative[axis]
                falling += n[axis] * motion.free[axis]
            allowed = approach_speed(h, braking, gains.barrier_slope)
            slope = gains.barrier_slope if h <= 0.0 else braking / (allowed + braking / gains.barrier_slope)  # phi'
            right = -gains.barrier_rate * (rate + allowed) - slope * rate - falling - turning

            # its row, unless it holds whatever the thrusters do
            least = 0.0
            for j in range(lower.size):
                along = 0.0
                for axis in range(6):
                    along += n[axis] * motion.push[axis, j]
                work.rows[rows, j] = along
                least += along * (lower[j] if along > 0.0 else upper[j])
            if right > least:
                work.right[rows], work.price[rows] = right, price
                rows += 1
    return rows
