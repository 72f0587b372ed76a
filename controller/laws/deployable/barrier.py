"""Barriers: linear constraints on the thruster forces that keep every hard region."""

# The clearance less a margin is h, of relative degree two. Its rate is bounded by what braking can still stop,
#
#     dh/dt >= -phi(h),   phi(h) = sqrt(2 a h + (a / kappa)^2) - a / kappa   (h >= 0),   kappa h   (h < 0),
#
# with a the deceleration that is always available. psi = dh/dt + phi(h) >= 0 is kept by dpsi/dt >= -rate psi, which is
# linear in the thruster forces u:
#
#     n^T A u >= -rate (dh/dt + phi) - phi' dh/dt - n^T a_free - (dn/dt)^T v,
#
# with n the gradient of h over the pose, v the velocity relative to the region, A u the acceleration by the thrusters
# and a_free the acceleration without them. Along psi = 0 this requires a (1 - (a / kappa) / sqrt(2 a h + (a /
# kappa)^2)), which is less than a: never more than is available. A region's own motion enters through dh/dt. Where a
# region has several faces, those that lie ahead have barriers too: `faces.py`. Clearances of regions of position are in
# m and depend on position alone; those of attitude (camera view, heading) are in rad and depend on both.
# docs/deployable.md states the guarantees and their limits.

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import exponential, length3, square
from controller.laws.deployable.attitude import integrate_attitude
from controller.laws.deployable.attraction import approach_speed
from controller.laws.deployable.faces import FACES, face_ahead, has_faces
from controller.laws.deployable.gains import SPREADS, DeployableGains
from controller.linear_algebra import copy
from controller.quadratic_program import Workspace
from controller.regions.kinds import FIRST_OF_ATTITUDE, FLAT
from controller.regions.region_set import PackedRegions, evaluate_packed, position_clearance
from controller.stack_array import zeros

Array = NDArray[np.float64]

_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude
_IMPULSE = 0.5  # s, assumed duration of the desired acceleration in the search for faces ahead
_LN_10 = 2.302585092994046
_AHEAD = 1e-4  # s, step of the difference quotient of a gradient: relative error 1e-4, rounding included
_FIRM = (3.0, 3.0)  # decades by which slack costs more than missing the desired force: at weight 0; added at weight 1
_LEAP = 0.5  # cosine of a gradient's turn within `_AHEAD` below which the turn counts as a jump
_MARGIN_OF_ATTITUDE = 0.02  # rad, margin of regions of attitude
KEPT = 0.01  # m/s2, slack up to which a barrier counts as kept
_BOUND_LEAP = 0.05  # m, fall of the bound in a step that counts as a jump: more than the vehicle's motion can cause


class RegionObservation(NamedTuple):
    """Regions evaluated at the estimated pose, now and `_AHEAD` later."""

    values: Array  # (n,) g, above 0 where a region is violated
    gradients: Array  # (n, 3) derivative of g by the position, NED
    rotation_gradients: Array  # (n, 3) derivative of g by a rotation about the body axes
    clearances: Array  # (n,) m, or rad for regions of attitude
    later_shifts: Array  # (n, 3) m, NED: shifts of the regions `_AHEAD` later
    later_values: Array  # (n,) the same quantities `_AHEAD` later
    later_gradients: Array  # (n, 3)
    later_rotation_gradients: Array  # (n, 3)
    later_clearances: Array  # (n,)
    bound: Array  # (1,) m: lower bound of the clearances by `write_rows`, if no barrier yields
    asked: Array  # (n,) m/s2, rad/s2: last right side of the barrier of each region's nearest face


class Motion(NamedTuple):
    """Velocity and available acceleration; of six, the first three along world axes, the last three about body axes."""

    position: Array  # (3,) m, NED
    velocity: Array  # (6,) m/s over ground, rad/s
    free_acceleration: Array  # (6,) m/s2, rad/s2: acceleration without thrust
    thruster_acceleration: Array  # (6, m) m/s2, rad/s2: acceleration by one newton of each thruster
    mass: float  # kg, with added mass, mean over the axes
    inertia: float  # kg m2, with added inertia, mean over the axes
    braking: float  # m/s2, deceleration that is always available
    position_spread: float  # m, uncertainty of the position between two steps
    position_variance: Array  # (3,) m2, NED: variance of the estimated position
    attitude_deviation: float  # rad, standard deviation of the estimated attitude


def empty_observation(n: int) -> RegionObservation:
    """Return an observation of `n` regions, all zero."""
    return RegionObservation(
        np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros((n, 3)),
        np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(1), np.zeros(n),
    )  # fmt: skip


def predict_shifts(regions: PackedRegions, time: float, out: Array) -> None:
    """Write the shifts [m], NED, shape (n, 3), that the regions will have after a time [s]."""
    for i in range(regions.kinds.size):
        for axis in range(3):
            out[i, axis] = regions.shifts[i, axis] + time * regions.velocities[i, axis]


def observe_regions(
    observation: RegionObservation, regions: PackedRegions, position: Array, quaternion: Array, velocity: Array
) -> None:
    """Evaluate the regions at a pose [m, NED], and at the pose `_AHEAD` later by a velocity as in `Motion`, (6,)."""
    s = observation
    evaluate_packed(regions, position, quaternion, s.values, s.gradients, s.rotation_gradients, s.clearances)
    r, later_position, attitude = regions, zeros(3), zeros(4)
    for axis in range(3):
        later_position[axis] = position[axis] + _AHEAD * velocity[axis]
    predict_shifts(regions, _AHEAD, s.later_shifts)
    integrate_attitude(quaternion, velocity[3:], _AHEAD, attitude)
    later_regions = PackedRegions(
        r.kinds, r.signs, r.offsets, r.numbers, s.later_shifts, r.velocities, r.gains, r.hard, r.deviations,
        r.crossing_costs,
    )  # fmt: skip
    evaluate_packed(
        later_regions,
        later_position,
        attitude,
        s.later_values,
        s.later_gradients,
        s.later_rotation_gradients,
        s.later_clearances,
    )


def pose_gradient(gradients: Array, rotation_gradients: Array, i: int, of_attitude: bool, out: Array) -> bool:
    """Write the gradient of a clearance over the pose, shape (6,); return False where it vanishes."""
    # A distance has the direction of g's gradient and length 1, whatever the unit of g; an angle is -g itself.
    size = length3(gradients[i, 0], gradients[i, 1], gradients[i, 2])
    turning = length3(rotation_gradients[i, 0], rotation_gradients[i, 1], rotation_gradients[i, 2])
    if not size + turning > 0.0:
        return False
    scale = 1.0 if of_attitude else 1.0 / size
    for axis in range(3):
        out[axis] = -scale * gradients[i, axis]
        out[3 + axis] = -scale * rotation_gradients[i, axis]
    return True


def gradient_rate(kind: int, sign: float, n: Array, later: Array, velocity: Array) -> float:
    """Return (dn/dt)^T v from a gradient now and later, (6,) each; v [m/s, rad/s] is relative to the region."""
    # The gradient of a flat face is constant, and jumps where another face becomes the nearest. So with flat faces only
    # a gradient that turns away applies, as round an edge; with others, jumps towards the vehicle are ignored. Inside a
    # region to stay in (`sign` above 0) a gradient that turns away is a jump, too.
    turning, alike = 0.0, 0.0
    for axis in range(6):
        turning += (later[axis] - n[axis]) / _AHEAD * velocity[axis]
        alike += later[axis] * n[axis]
    if turning < 0.0 and kind < _ATTITUDE and (kind in FLAT or alike < _LEAP):
        return 0.0
    if turning > 0.0 and kind < _ATTITUDE and sign > 0.0:
        return 0.0
    return turning


def _margin(n: Array, motion: Motion, deviations: Array, of_attitude: bool, gains: DeployableGains) -> float:
    """Return the margin [m, or rad] of a clearance with slope n, from the uncertainty of vehicle and region."""
    # `deviations`, shape (3,) [m], are standard deviations of the region's position.
    variance, along, turned = 0.0, 0.0, 0.0
    for axis in range(3):
        variance += square(n[axis]) * (motion.position_variance[axis] + square(deviations[axis]))
        along += square(n[axis])
        turned += square(n[3 + axis])
    spread: float = SPREADS * np.sqrt(variance) + np.sqrt(along) * motion.position_spread
    if not of_attitude:
        return gains.margin + spread
    return _MARGIN_OF_ATTITUDE + spread + SPREADS * motion.attitude_deviation * float(np.sqrt(turned))


def _stopping_distance(
    relative: Array, wanted: Array, braking: float, gains: DeployableGains, path_velocity: Array
) -> float:
    """Write the expected velocity into `path_velocity`, and return the stopping distance [m] from it."""
    for axis in range(3):
        path_velocity[axis] = relative[axis] + _IMPULSE * wanted[axis]
    speed = length3(path_velocity[0], path_velocity[1], path_velocity[2])
    return speed * (speed / (2.0 * braking) + 1.0 / gains.barrier_slope + 1.0 / gains.barrier_rate)


def _desired_acceleration(motion: Motion, nominal: Array, out: Array) -> None:
    """Write the acceleration [m/s2] by desired thruster forces [N], shape (3,)."""
    for axis in range(3):
        out[axis] = motion.free_acceleration[axis]
        for j in range(nominal.size):
            out[axis] += motion.thruster_acceleration[axis, j] * nominal[j]


def write_rows(
    work: Workspace,
    observation: RegionObservation,
    regions: PackedRegions,
    weights: Array,
    motion: Motion,
    lower: Array,
    upper: Array,
    share: float,
    gains: DeployableGains,
) -> int:
    """Write the constraint of each hard region that the thrusters could violate; return the number of rows."""
    # with lower, upper [N]
    # Also write the lower bound of the clearances [m]: min(0, margin + h, psi / kappa). The `margin` covers an error of
    # the acceleration of rate kappa margin.
    rows, n, later_gradient, relative, path_velocity = 0, zeros(6), zeros(6), zeros(6), zeros(3)
    desired, bound = zeros(3), 0.0
    _desired_acceleration(motion, work.nominal, desired)
    for i in range(regions.kinds.size):
        of_attitude = regions.kinds[i] >= _ATTITUDE
        if not regions.hard[i] or not pose_gradient(
            observation.gradients, observation.rotation_gradients, i, of_attitude, n
        ):
            continue
        braking = gains.turning_deceleration if of_attitude else motion.braking
        margin = _margin(n, motion, regions.deviations[i], of_attitude, gains)
        scale = square(motion.mass)
        if of_attitude:  # weighted by the squared gradients over position [rad2/m2] and attitude [1]
            scale *= square(n[0]) + square(n[1]) + square(n[2])
            scale += square(motion.inertia) * (square(n[3]) + square(n[4]) + square(n[5]))
        price = exponential(_LN_10 * (-_FIRM[0] - _FIRM[1] * weights[i])) / max(scale, 1e-9)
        for axis in range(6):
            relative[axis] = motion.velocity[axis] - (regions.velocities[i, axis] if axis < 3 else 0.0)
        turning = 0.0
        if pose_gradient(
            observation.later_gradients, observation.later_rotation_gradients, i, of_attitude, later_gradient
        ):
            turning = gradient_rate(regions.kinds[i], regions.signs[i], n, later_gradient, relative)
        distance, reach, faces = observation.clearances[i], 0.0, 1
        if not of_attitude and has_faces(regions.kinds[i], regions.signs[i]):
            reach = margin + _stopping_distance(relative, desired, braking, gains, path_velocity)
            if 0.0 < distance < reach:
                faces = 1 + FACES
        for face in range(faces):  # the nearest face, and those ahead
            if face > 0:
                distance = face_ahead(regions, i, motion.position, n[:3], path_velocity, reach, later_gradient[:3])
                if not distance < np.inf:
                    break
                copy(later_gradient, n[:3])
                margin = _margin(n, motion, regions.deviations[i], of_attitude, gains)
                turning = 0.0  # the gradient of a flat face is constant

            # h, its rate, and its second derivative without thrust
            h, rate, drift_term = distance - margin, 0.0, 0.0
            for axis in range(6):
                rate += n[axis] * relative[axis]
                drift_term += n[axis] * motion.free_acceleration[axis]
            allowed = approach_speed(h, braking, gains.barrier_slope)
            if not of_attitude:
                bound = min(bound, gains.margin + h, (rate + allowed) / gains.barrier_slope)
            slope = gains.barrier_slope if h <= 0.0 else braking / (allowed + braking / gains.barrier_slope)  # phi'
            right = -gains.barrier_rate * (rate + allowed) - slope * rate - drift_term - turning
            if face == 0:
                if share < 1.0:
                    right = observation.asked[i] + share * (right - observation.asked[i])
                observation.asked[i] = right

            rows = add_row(work, rows, n, motion.thruster_acceleration, right, price, lower, upper)
    observation.bound[0] = bound
    return rows


def add_row(
    work: Workspace,
    rows: int,
    n: Array,
    thruster_acceleration: Array,
    right: float,
    price: float,
    lower: Array,
    upper: Array,
) -> int:
    """Add the constraint n^T A u >= right, unless no forces within the limits violate it; return the number of rows."""
    # with thruster_acceleration [m/s2, rad/s2], lower, upper [N]
    least = 0.0
    for j in range(lower.size):
        along = 0.0
        for axis in range(6):
            along += n[axis] * thruster_acceleration[axis, j]
        work.rows[rows, j] = along
        least += along * (lower[j] if along > 0.0 else upper[j])
    if not right > least:
        return rows
    work.right[rows], work.price[rows] = right, price
    return rows + 1


def vehicle_bound(regions: PackedRegions, position: Array, motion: Motion, gains: DeployableGains) -> float:
    """Return the lower bound [m] of the vehicle's own clearances now, at most 0: it follows the point with barriers."""
    # `regions` are at their present positions, and the vehicle at a `position`, shape (3,) [m, NED].
    bound, n = 0.0, zeros(6)
    for i in range(regions.kinds.size):
        if regions.hard[i] and regions.kinds[i] < _ATTITUDE:
            clearance = position_clearance(regions, i, position, n[:3])
            bound = min(bound, gains.margin + clearance - _margin(n, motion, regions.deviations[i], False, gains))
    return bound


def update_clearance_bound(guaranteed: Array, bound: float, slack: float) -> None:
    """Raise the guaranteed lower bound of the clearances, shape (2,) [m], to a higher bound of this step."""
    # A falling bound does not lower the guarantee, which would else follow any violation. The guarantee is reset if a
    # barrier yields by more than `KEPT`, or if the bound jumps, since then regions or estimate jumped.
    if slack > KEPT or not bound >= guaranteed[1] - _BOUND_LEAP:
        guaranteed[0] = bound
    guaranteed[0], guaranteed[1] = max(guaranteed[0], bound), bound
