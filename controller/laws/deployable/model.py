"""The vehicle model of the deployable law: accelerations, and working thrusters."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from controller.driven_axes import require_driven
from controller.law import VehicleModel
from controller.laws.deployable.braking import UNLIMITED
from controller.laws.deployable.thrust_limit import command_for, limited_force
from controller.linear_algebra import cross, invert_symmetric
from controller.stack_array import Array, Columns6, Matrix3, Matrix6, Shape, Vector3, Vector6, VectorM, array, interpret
from controller.state import State

Allocator = Annotated[Array, Shape("m", 6)]
MatrixM = Annotated[Array, Shape("m", "m")]
Rows2 = Annotated[Array, Shape(2, "m")]

_REGULARISATION = 1e-3  # relative to a thruster's diagonal entry of H


class Dynamics(NamedTuple):
    """Constants of the vehicle, derived from its nominal parameters."""

    mass: Matrix6  # kg, kg m, kg m2: M, rigid body and added, center of gravity at the origin
    inverse_mass: Matrix6  # 1/kg, 1/(kg m), 1/(kg m2): M^-1
    linear_damping: Vector6  # N s/m, N m s/rad
    quadratic_damping: Vector6  # N s2/m2, N m s2/rad2
    trim: Vector6  # N, N m: constant wrench on the body
    translational_mass: float  # kg, mean over the three axes
    rigid_mass: float  # kg, without added mass
    braking: Array  # (m + 1,) m/s2, worst direction: with thruster j lost, and last with all working
    max_speed: float = (
        UNLIMITED  # m/s, through water, at which the righting moment still holds axes that are left to it
    )


class Thrusters(State):
    """Thrusters and their allocation."""

    # A failed thruster has a column of zeros and limits of zero; a stuck one keeps its column, and its limits are its
    # force.

    nominal_matrix: Columns6  # thruster matrix of the vehicle
    matrix: Columns6  # thruster matrix with the columns of failed thrusters zero, unless they are stuck
    lower: VectorM  # N, present lower limits
    upper: VectorM  # N, present upper limits
    nominal_lower: VectorM  # N, lower limits of the vehicle
    nominal_upper: VectorM  # N, upper limits of the vehicle
    inverse: MatrixM  # H^-1 with H = B^T Q B + regularization
    allocator: Allocator  # H^-1 B^T Q: maps a wrench to its least-squares forces
    metric: Vector6  # 1/N2, 1/(N m)2: Q, cost of an error of the wrench; 0: left to the righting moment
    nominal_metric: Vector6  # Q with all thrusters working
    rights: float  # 1 if axes of rotation may be left to the righting moment, else 0
    health: VectorM  # 1 working, 0 failed
    stuck: VectorM  # N, constant force of a stuck thruster; NaN for all others
    effectiveness: VectorM  # estimated ratio of each thruster's force to the commanded one
    ceiling: Rows2  # estimated true limits, as a fraction of the nominal ones, and their standard deviations
    forces: VectorM  # N, commanded forces of the last period
    acting: VectorM  # N, mean forces behind the lag over that period
    acting_now: VectorM  # N, forces behind the lag at its end


def make_dynamics(vehicle: VehicleModel, braking: Array, max_speed: float = UNLIMITED) -> Dynamics:
    """Return the constants of a vehicle; braking (m + 1,) [N], max_speed [m/s]."""
    mass = vehicle.rigid_mass + vehicle.added_mass
    mean = float(np.trace(mass[:3, :3])) / 3.0
    inverse = 0.5 * (mass + mass.T)
    invert_symmetric(inverse)
    return Dynamics(
        mass=mass,
        inverse_mass=inverse,
        linear_damping=vehicle.linear_damping.copy(),
        quadratic_damping=vehicle.quadratic_damping.copy(),
        trim=vehicle.trim.copy(),
        translational_mass=mean,
        rigid_mass=float(vehicle.rigid_mass[0, 0]),
        braking=np.asarray(braking) / mean,
        max_speed=max_speed,
    )


def make_thrusters(vehicle: VehicleModel) -> Thrusters:
    """Return the thrusters, all working."""
    B = vehicle.thruster_matrix
    arm = np.sqrt(np.sum(B[3:] ** 2) / np.sum(B[:3] ** 2))  # m, typical lever arm of a thruster
    thrusters = Thrusters(
        m=B.shape[1],
        nominal_matrix=B.copy(),
        matrix=B.copy(),
        lower=vehicle.thrust_min.copy(),
        upper=vehicle.thrust_max.copy(),
        nominal_lower=vehicle.thrust_min.copy(),
        nominal_upper=vehicle.thrust_max.copy(),
        nominal_metric=np.array([1.0] * 3 + [4.0 / arm**2] * 3),
        rights=float(vehicle.righting_moment > 0.0),
    )
    thrusters.nominal_metric[require_driven(B, vehicle.thrust_min, vehicle.thrust_max, vehicle.righting_moment)] = 0.0
    thrusters.health[:] = thrusters.effectiveness[:] = 1.0
    thrusters.stuck[:], thrusters.ceiling[0] = np.nan, 2.0
    interpret(reallocate, (thrusters,))
    return thrusters


def reallocate(thrusters: Thrusters) -> None:
    """Update matrix, limits and inverses from `health` and `stuck`; leave lost axes if that saves others."""
    t = thrusters
    t.matrix = t.nominal_matrix * np.where(np.isnan(t.stuck), t.health, 1.0)
    t.lower = np.where(np.isnan(t.stuck), t.nominal_lower * t.health, t.stuck)
    t.upper = np.where(np.isnan(t.stuck), t.nominal_upper * t.health, t.stuck)
    t.metric = t.nominal_metric
    _invert(t)
    lost = _lost_axes(t)
    for k in range(2):
        axis = 4 - k  # pitch before roll
        if t.rights > 0.0 and lost > 0.5 and t.metric[axis] > 0.0:
            t.metric[axis] = 0.0
            _invert(t)
            remaining = _lost_axes(t)
            if remaining < lost - 0.5:
                lost = remaining
            else:
                t.metric[axis] = t.nominal_metric[axis]
                _invert(t)


def _lost_axes(thrusters: Thrusters) -> float:
    """Return the number of axes that the allocation cannot drive alone, of those that are not left."""
    lost, t = 0.0, thrusters
    for axis in range(6):
        if t.metric[axis] > 0.0:
            lost += 1.0 - t.matrix[axis] @ t.allocator[:, axis]
    return lost


def _invert(thrusters: Thrusters) -> None:
    """Update both inverses from matrix and metric."""
    t, H = thrusters, thrusters.inverse
    H[:] = (t.matrix.T * t.metric) @ t.matrix
    for j in range(t.health.size):
        column = t.nominal_matrix[:, j]
        H[j, j] += _REGULARISATION * max(float((column * t.metric) @ column), 1e-12)
    invert_symmetric(H)
    t.allocator = (t.inverse @ t.matrix.T) * t.metric


class Loads(NamedTuple):
    """Loads on the vehicle other than its thrusters."""

    water_velocity: Vector3  # m/s, NED
    net_weight: float  # N, W - B
    moments: Vector3  # phi_2..phi_4 of (12) [N m], body axes
    yaw_moment: float  # N m, about the body's z axis, beside these
    drag: float  # drag of translation, relative to the vehicle's


def free_wrench(dynamics: Dynamics, R: Matrix3, velocity: Vector3, omega: Vector3, loads: Loads) -> Vector6:
    """Return the wrench on the body without thrust [N, N m]: all of (11) but thrust and M nu_r'."""
    # Units of arguments: velocity [m/s] in NED, omega [rad/s] in body axes
    # It has drag against the water, weight and buoyancy, and the rate of the momentum M nu_r in the rotating body axes,
    # which in oblique motion includes Munk's moment.
    nu_r = np.concatenate((R.T @ (velocity - loads.water_velocity), omega))
    momentum = dynamics.mass @ nu_r
    drag = -(dynamics.linear_damping + dynamics.quadratic_damping * abs(nu_r)) * nu_r
    k = R[2]  # R^T e3
    force = loads.drag * drag[:3] + (loads.net_weight * k - cross(omega, momentum[:3]))
    moment = drag[3:] - cross(k, loads.moments) - cross(omega, momentum[3:]) - cross(nu_r[:3], momentum[:3])
    moment[2] += loads.yaw_moment
    return np.concatenate((force, moment)) + dynamics.trim


def drag_acceleration(dynamics: Dynamics, R: Matrix3, relative: Vector3) -> Vector3:
    """Return the acceleration [m/s2], NED, by the vehicle's own drag at a velocity [m/s], NED, against the water."""
    nu_r = R.T @ relative
    force = -(dynamics.linear_damping[:3] + dynamics.quadratic_damping[:3] * abs(nu_r)) * nu_r
    return R @ (dynamics.inverse_mass[:3, :3] @ force)


def to_acceleration(
    dynamics: Dynamics, R: Matrix3, velocity: Vector3, omega: Vector3, loads: Loads, wrench: Vector6
) -> Vector6:
    """Return the acceleration [m/s2] in NED and [rad/s2] in body axes, by a wrench [N, N m] on a moving vehicle."""
    body = dynamics.inverse_mass @ wrench
    relative = R.T @ (velocity - loads.water_velocity)
    turning = array(  # the body axes rotate: + omega x nu_r
        body[0] + omega[1] * relative[2] - omega[2] * relative[1],
        body[1] + omega[2] * relative[0] - omega[0] * relative[2],
        body[2] + omega[0] * relative[1] - omega[1] * relative[0],
    )
    return np.concatenate((R @ turning, body[3:]))


def free_acceleration(dynamics: Dynamics, R: Matrix3, velocity: Vector3, omega: Vector3, loads: Loads) -> Vector6:
    """Return the acceleration without thrust, in the frames of `to_acceleration`."""
    wrench = free_wrench(dynamics, R, velocity, omega, loads)
    return to_acceleration(dynamics, R, velocity, omega, loads, wrench)


def write_thruster_acceleration(
    dynamics: Dynamics, thrusters: Thrusters, R: Matrix3, R_ahead: Matrix3, out: Columns6, ahead: Columns6
) -> None:
    """Write the acceleration by one newton of each thruster, at the attitudes `R` and `R_ahead`."""
    # Linear in NED [m/s2], angular in body axes [rad/s2].
    for j in range(thrusters.health.size):
        body = dynamics.inverse_mass @ thrusters.matrix[:, j]
        out[:3, j], out[3:, j] = R @ body[:3], body[3:]
        ahead[:3, j], ahead[3:, j] = R_ahead @ body[:3], body[3:]


def write_force_limits(thrusters: Thrusters, limits: Array) -> None:
    """Write the true force [N] of each thruster at its lower and upper limit, shape (2, m)."""
    # Both limits of a stuck thruster are its estimated force.
    for j in range(thrusters.health.size):
        if not np.isnan(thrusters.stuck[j]):
            thrusters.lower[j] = thrusters.upper[j] = thrusters.stuck[j] * thrusters.effectiveness[j]
            limits[0, j] = limits[1, j] = thrusters.lower[j]
        else:
            ceiling, spread = thrusters.ceiling[0, j], thrusters.ceiling[1, j]
            min_force, _ = limited_force(thrusters.lower[j], thrusters.nominal_lower[j], ceiling, spread)
            max_force, _ = limited_force(thrusters.upper[j], thrusters.nominal_upper[j], ceiling, spread)
            limits[0, j] = min_force * thrusters.effectiveness[j]
            limits[1, j] = max_force * thrusters.effectiveness[j]


def command_forces(thrusters: Thrusters, forces: Array) -> None:
    """Convert desired forces of the thrusters [N] to commands [N], divided by their effectiveness."""
    # A stuck thruster gets zero: if it works after all, it does not produce the force at which it is assumed stuck.
    for j in range(forces.size):
        if not np.isnan(thrusters.stuck[j]):
            forces[j] = 0.0
        elif thrusters.effectiveness[j] > 0.0:
            limit = thrusters.nominal_upper[j] if forces[j] > 0.0 else thrusters.nominal_lower[j]
            desired = forces[j] / thrusters.effectiveness[j]
            command = command_for(desired, limit, thrusters.ceiling[0, j], thrusters.ceiling[1, j])
            forces[j] = min(max(command, thrusters.lower[j]), thrusters.upper[j])


def available_braking(dynamics: Dynamics, thrusters: Thrusters) -> float:
    """Return the deceleration [m/s2] in the worst direction with the failed thruster lost, or else any one."""
    # Each further failure halves it, which is a rule of thumb.
    worst, lost, ceiling = np.min(dynamics.braking), 0, 1.0
    for j in range(thrusters.health.size):
        if thrusters.health[j] == 0.0:
            worst = dynamics.braking[j] if lost == 0 else 0.5 * min(worst, dynamics.braking[j])
            lost += 1
        else:
            ceiling = min(ceiling, thrusters.ceiling[0, j])
    return ceiling * worst


def thrust_acceleration(dynamics: Dynamics, thrusters: Thrusters, R: Matrix3, forces: Array) -> Vector6:
    """Return the acceleration by thruster forces [N] times effectiveness: linear in NED, angular in body axes."""
    body = dynamics.inverse_mass @ (thrusters.matrix @ (thrusters.effectiveness * forces))
    return np.concatenate((R @ body[:3], body[3:]))
