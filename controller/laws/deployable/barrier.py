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

from controller.arithmetic import QUARTER_TURN, exponential, sine, square
from controller.laws.deployable.attitude import integrate_attitude
from controller.laws.deployable.attraction import approach_speed
from controller.laws.deployable.faces import FACES, face_ahead, has_faces
from controller.laws.deployable.gains import SPREADS, DeployableGains
from controller.linear_algebra import cross, norm
from controller.quadratic_program import Workspace
from controller.regions.kinds import FIRST_OF_ATTITUDE, FLAT
from controller.regions.region_set import PackedRegions, evaluate_packed
from controller.stack_array import Array, Columns6, Rows3, Vector3, Vector4, Vector6, VectorN, zeros
from controller.state import State

_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude
_IMPULSE = 0.5  # s, assumed duration of the desired acceleration in the search for faces ahead
_LN_10 = 2.302585092994046
_FD_STEP = 1e-4  # s, step of the difference quotient of a gradient: relative error 1e-4, rounding included
_FIRM = (3.0, 3.0)  # decades by which slack costs more than missing the desired force: at weight 0; added at weight 1
_LEAP = 0.5  # cosine of a gradient's turn within `_FD_STEP` below which the turn counts as a jump
_MARGIN_OF_ATTITUDE = 0.02  # rad, margin of regions of attitude
_TILT_PRICE = 1e-5  # price of a violated bound on tilt, times the squared inertia: below those of hard regions


class RegionObservation(State):
    """Regions evaluated at the estimated pose, now and `_FD_STEP` later."""

    values: VectorN  # g, above 0 where a region is violated
    gradients: Rows3  # derivative of g by the position, NED
    rotation_gradients: Rows3  # derivative of g by a rotation about the body axes
    clearances: VectorN  # m, or rad for regions of attitude
    later_shifts: Rows3  # m, NED: shifts of the regions `_FD_STEP` later
    later_values: VectorN  # the same quantities `_FD_STEP` later
    later_gradients: Rows3
    later_rotation_gradients: Rows3
    later_clearances: VectorN
    previous_rhs: VectorN  # m/s2, rad/s2: last right side of the barrier of each region's nearest face
    bound: float  # m: lower bound of the clearances by h and psi of this step, if nothing errs and no barrier yields


class Motion(NamedTuple):
    """Velocity and available acceleration; of six, the first three along world axes, the last three about body axes."""

    position: Vector3  # m, NED
    velocity: Vector6  # m/s over ground, rad/s
    free_acceleration: Vector6  # m/s2, rad/s2: acceleration without thrust
    thruster_acceleration: Columns6  # m/s2, rad/s2: acceleration by one newton of each thruster
    mass: float  # kg, with added mass, mean over the axes
    inertia: float  # kg m2, with added inertia, mean over the axes
    braking: float  # m/s2, deceleration that is always available
    position_spread: float  # m, uncertainty of the position between two steps
    position_variance: Vector3  # m2, NED: variance of the estimated position
    attitude_deviation: float  # rad, standard deviation of the estimated attitude


def predict_shifts(regions: PackedRegions, time: float, out: Rows3) -> None:
    """Write the shifts [m], NED, that the regions will have after a time [s]."""
    out[:] = regions.shifts + time * regions.velocities


def observe_regions(
    observation: RegionObservation, regions: PackedRegions, position: Vector3, quaternion: Vector4, velocity: Vector6
) -> None:
    """Evaluate the regions at a pose [m, NED], and at the pose `_FD_STEP` later by a velocity as in `Motion`."""
    s = observation
    evaluate_packed(regions, position, quaternion, s.values, s.gradients, s.rotation_gradients, s.clearances)
    predict_shifts(regions, _FD_STEP, s.later_shifts)
    evaluate_packed(
        regions._replace(shifts=s.later_shifts),
        position + _FD_STEP * velocity[:3],
        integrate_attitude(quaternion, velocity[3:], _FD_STEP),
        s.later_values,
        s.later_gradients,
        s.later_rotation_gradients,
        s.later_clearances,
    )


def pose_gradient(gradients: Rows3, rotation_gradients: Rows3, i: int, of_attitude: bool, out: Vector6) -> bool:
    """Write the gradient of a clearance over the pose; return False where it vanishes."""
    # A distance has the direction of g's gradient and length 1, whatever the unit of g; an angle is -g itself.
    size = norm(gradients[i])
    if not size + norm(rotation_gradients[i]) > 0.0:
        return False
    scale = 1.0 if of_attitude else 1.0 / size
    out[:3], out[3:] = -scale * gradients[i], -scale * rotation_gradients[i]
    return True


def gradient_rate(kind: int, sign: float, n: Vector6, later: Vector6, velocity: Vector6) -> float:
    """Return (dn/dt)^T v from a gradient now and later; v [m/s, rad/s] is relative to the region."""
    # The gradient of a flat face is constant, and jumps where another face becomes the nearest. So with flat faces only
    # a gradient that turns away applies, as round an edge; with others, jumps towards the vehicle are ignored. Inside a
    # region to stay in (`sign` above 0) a gradient that turns away is a jump, too.
    turning = float(((later - n) / _FD_STEP) @ velocity)
    if turning < 0.0 and kind < _ATTITUDE and (kind in FLAT or later @ n < _LEAP):
        return 0.0
    if turning > 0.0 and kind < _ATTITUDE and sign > 0.0:
        return 0.0
    return turning


def observe_gradient(
    o: RegionObservation, regions: PackedRegions, i: int, velocity: Vector6, n: Vector6, relative: Vector6
) -> tuple[bool, float]:
    """Write a region's gradient n over the pose, and the velocity relative to it; return False where n vanishes."""
    # Return (dn/dt)^T v, too: v [m/s, rad/s] is relative to the region.
    of_attitude, later, turning = regions.kinds[i] >= _ATTITUDE, zeros(6), 0.0
    exists = pose_gradient(o.gradients, o.rotation_gradients, i, of_attitude, n)
    relative[:] = velocity
    relative[:3] -= regions.velocities[i]
    if exists and pose_gradient(o.later_gradients, o.later_rotation_gradients, i, of_attitude, later):
        turning = gradient_rate(regions.kinds[i], regions.signs[i], n, later, relative)
    return exists, turning


def margin_of(n: Vector6, motion: Motion, deviations: Vector3, of_attitude: bool, gains: DeployableGains) -> float:
    """Return the margin [m, or rad] of a clearance with slope n, from the uncertainty of vehicle and region."""
    # `deviations` [m] are standard deviations of the region's position.
    variance = float(n[:3] ** 2 @ (motion.position_variance + deviations**2))
    spread: float = SPREADS * np.sqrt(variance) + norm(n[:3]) * motion.position_spread
    if not of_attitude:
        return gains.margin + spread
    return _MARGIN_OF_ATTITUDE + spread + SPREADS * motion.attitude_deviation * norm(n[3:])


def write_rows(
    work: Workspace,
    observation: RegionObservation,
    regions: PackedRegions,
    weights: Array,
    motion: Motion,
    lower: Array,
    upper: Array,
    fraction: float,
    gains: DeployableGains,
) -> int:
    """Write the constraint of each hard region that the thrusters could violate; return the number of rows."""
    # Units of arguments: lower, upper [N]
    # Also write the lower bound of the clearances [m]: min(0, margin + h, psi / kappa). The `margin` covers an error of
    # the acceleration of rate kappa margin.
    rows, bound, n, relative = 0, 0.0, zeros(6), zeros(6)
    face_normal, desired = zeros(3), motion.free_acceleration[:3] + motion.thruster_acceleration[:3] @ work.nominal
    for i in range(regions.kinds.size):
        of_attitude = regions.kinds[i] >= _ATTITUDE
        if not regions.hard[i]:
            continue
        exists, turning = observe_gradient(observation, regions, i, motion.velocity, n, relative)
        if not exists:
            continue
        braking = gains.turning_deceleration if of_attitude else motion.braking
        margin = margin_of(n, motion, regions.deviations[i], of_attitude, gains)
        scale = square(motion.mass)
        if of_attitude:  # weighted by the squared gradients over position [rad2/m2] and attitude [1]
            scale = scale * float(n[:3] @ n[:3]) + square(motion.inertia) * float(n[3:] @ n[3:])
        price = exponential(_LN_10 * (-_FIRM[0] - _FIRM[1] * weights[i])) / max(scale, 1e-9)
        distance, reach, faces = observation.clearances[i], 0.0, 1
        path_velocity = relative[:3] + _IMPULSE * desired
        if not of_attitude and has_faces(regions.kinds[i], regions.signs[i]):
            speed = norm(path_velocity)  # [m/s], from which the vehicle stops within `reach` [m]
            stopping = speed * (speed / (2.0 * braking) + 1.0 / gains.barrier_slope + 1.0 / gains.barrier_rate)
            reach = margin + stopping
            if 0.0 < distance < reach:
                faces = 1 + FACES
        for face in range(faces):  # the nearest face, and those ahead
            if face > 0:
                distance = face_ahead(regions, i, motion.position, n[:3], path_velocity, reach, face_normal)
                if not distance < np.inf:
                    break
                n[:3] = face_normal
                margin = margin_of(n, motion, regions.deviations[i], of_attitude, gains)
                turning = 0.0  # the gradient of a flat face is constant

            # h, its rate, and its second derivative without thrust
            h, rate, drift_term = distance - margin, float(n @ relative), float(n @ motion.free_acceleration)
            allowed = approach_speed(h, braking, gains.barrier_slope)
            if not of_attitude:
                bound = min(bound, gains.margin + h, (rate + allowed) / gains.barrier_slope)
            slope = gains.barrier_slope if h <= 0.0 else braking / (allowed + braking / gains.barrier_slope)  # phi'
            rhs = -gains.barrier_rate * (rate + allowed) - slope * rate - drift_term - turning
            if face == 0:
                if fraction < 1.0:
                    rhs = observation.previous_rhs[i] + fraction * (rhs - observation.previous_rhs[i])
                observation.previous_rhs[i] = rhs

            rows = add_row(work, rows, n, motion.thruster_acceleration, rhs, price, lower, upper)
    observation.bound = bound
    return rows


def add_row(
    work: Workspace,
    rows: int,
    n: Vector6,
    thruster_acceleration: Columns6,
    rhs: float,
    price: float,
    lower: Array,
    upper: Array,
) -> int:
    """Add the constraint n^T A u >= rhs, unless no forces within the limits violate it; return the number of rows."""
    # Units of arguments: thruster_acceleration [m/s2, rad/s2]; lower, upper [N]
    row = work.rows[rows]
    row[:] = n @ thruster_acceleration
    if not rhs > row @ np.where(row > 0.0, lower, upper):
        return rows
    work.rhs[rows], work.price[rows] = rhs, price
    return rows + 1


def write_tilt_rows(
    work: Workspace,
    rows: int,
    metric: Vector6,
    down: Vector3,
    motion: Motion,
    lower: Array,
    upper: Array,
    gains: DeployableGains,
) -> int:
    """Add the constraint of the tilt about each axis that is left to the righting moment; return the number of rows."""
    # `down` is the vertical k in body axes: pitch tilts k_x, and roll k_y. h = sin(tilt) - |k_x| is a barrier as those
    # of regions, but yields to them: no promise rests on it. It keeps thrusters from tilting the vehicle, and never
    # asks them to right it, for which they may have a short arm alone.
    omega, n = motion.velocity[3:], zeros(6)
    turning = cross(down, omega)  # dk/dt
    for axis in range(3, 5):
        if metric[axis] > 0.0:
            continue
        i = 4 - axis  # k_x' = k_y r - k_z q, k_y' = k_z p - k_x r
        sign = (1.0 if down[i] > 0.0 else -1.0) * (1.0 if i == 0 else -1.0)
        n[:] = 0.0
        n[axis] = sign * down[2]
        rate = n[axis] * omega[axis - 3] - sign * down[1 - i] * omega[2]
        curve = sign * (turning[2] * omega[axis - 3] - turning[1 - i] * omega[2])
        h = sine(min(gains.tilt, QUARTER_TURN)) - abs(down[i])
        allowed = approach_speed(h, gains.turning_deceleration, gains.barrier_slope)
        slope = gains.barrier_slope
        if h > 0.0:
            slope = gains.turning_deceleration / (allowed + gains.turning_deceleration / gains.barrier_slope)
        rhs = -gains.barrier_rate * (rate + allowed) - slope * rate - n[axis] * motion.free_acceleration[axis] - curve
        rhs = min(rhs, 0.0)
        rows = add_row(
            work, rows, n, motion.thruster_acceleration, rhs, _TILT_PRICE / square(motion.inertia), lower, upper
        )
    return rows
