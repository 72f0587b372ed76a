"""The vehicle model of the deployable law: accelerations, and working thrusters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.law import VehicleModel
from controller.laws.deployable.linear_algebra import invert_symmetric, product
from controller.stack_array import zeros

Array = NDArray[np.float64]

_REGULARISATION = 1e-3  # of a thruster's own share in H


class Dynamics(NamedTuple):
    """Constant numbers of the vehicle, derived from its nominal ones."""

    mass: Array  # (6, 6) kg, kg m, kg m2: M, rigid body and added, centre of gravity at the origin
    inverse_mass: Array  # (6, 6) SI
    linear_damping: Array  # (6,) N s/m, N m s/rad
    quadratic_damping: Array  # (6,) N s2/m2, N m s2/rad2
    translational_mass: Array  # (1,) kg, mean of the three
    braking: Array  # (m + 1,) m/s2, worst direction: with thruster j lost, and last with all working


class Thrusters(NamedTuple):
    """Thrusters and their allocation; a failed thruster has a column of zeros and limits of zero."""

    nominal_matrix: Array  # (6, m) thruster matrix of the vehicle
    matrix: Array  # (6, m) of the working thrusters
    lower: Array  # (m,) N
    upper: Array  # (m,) N
    nominal_lower: Array  # (m,) N, limits of the vehicle
    nominal_upper: Array  # (m,) N
    inverse: Array  # (m, m) H^-1 with H = B^T Q B + regularisation
    allocator: Array  # (m, 6) H^-1 B^T Q: from wrench to nearest forces
    metric: Array  # (6,) Q: cost of an error of the wrench, 1/N2, 1/(N m)2
    health: Array  # (m,) 1 working, 0 failed
    forces: Array  # (m,) N, commanded in the last period


def make_dynamics(vehicle: VehicleModel, braking: Array) -> Dynamics:
    """Return the constant numbers of a vehicle.

    Parameters
    ----------
    vehicle : VehicleModel
        Nominal numbers.
    braking : ndarray, shape (m + 1,)
        Greatest force [N] in the worst direction with each thruster lost, and with none.

    Returns
    -------
    Dynamics
        Arrays of its own.
    """
    mass = vehicle.rigid_mass + vehicle.added_mass
    mean = float(np.trace(mass[:3, :3])) / 3.0
    inverse = 0.5 * (mass + mass.T)
    invert_symmetric(inverse)
    return Dynamics(
        mass=mass,
        inverse_mass=inverse,
        linear_damping=vehicle.linear_damping.copy(),
        quadratic_damping=vehicle.quadratic_damping.copy(),
        translational_mass=np.array([mean]),
        braking=np.asarray(braking) / mean,
    )


def make_thrusters(vehicle: VehicleModel) -> Thrusters:
    """Return the thrusters, all working.

    Parameters
    ----------
    vehicle : VehicleModel
        Nominal numbers.

    Returns
    -------
    Thrusters
        Arrays of its own.
    """
    B = vehicle.thruster_matrix
    m = B.shape[1]
    arm = np.sqrt(np.sum(B[3:] ** 2) / np.sum(B[:3] ** 2))  # m, typical
    thrusters = Thrusters(
        nominal_matrix=B.copy(),
        matrix=B.copy(),
        lower=vehicle.thrust_min.copy(),
        upper=vehicle.thrust_max.copy(),
        nominal_lower=vehicle.thrust_min.copy(),
        nominal_upper=vehicle.thrust_max.copy(),
        inverse=np.zeros((m, m)),
        allocator=np.zeros((m, 6)),
        metric=np.array([1.0] * 3 + [4.0 / arm**2] * 3),
        health=np.ones(m),
        forces=np.zeros(m),
    )
    reallocate(thrusters)
    return thrusters


def reallocate(thrusters: Thrusters) -> None:
    """Update matrix, limits and inverses to `health`."""
    m = thrusters.health.size
    for j in range(m):
        for k in range(6):
            thrusters.matrix[k, j] = thrusters.nominal_matrix[k, j] * thrusters.health[j]
        thrusters.lower[j] = thrusters.nominal_lower[j] * thrusters.health[j]
        thrusters.upper[j] = thrusters.nominal_upper[j] * thrusters.health[j]
    H = thrusters.inverse
    for i in range(m):
        for j in range(m):
            total = 0.0
            for k in range(6):
                total += thrusters.matrix[k, i] * thrusters.metric[k] * thrusters.matrix[k, j]
            H[i, j] = total
        own = 0.0
        for k in range(6):
            own += thrusters.nominal_matrix[k, i] * thrusters.metric[k] * thrusters.nominal_matrix[k, i]
        H[i, i] += _REGULARISATION * max(own, 1e-12)
    invert_symmetric(H)
    for i in range(m):
        for k in range(6):
            total = 0.0
            for j in range(m):
                total += thrusters.inverse[i, j] * thrusters.matrix[k, j]
            thrusters.allocator[i, k] = total * thrusters.metric[k]


def free_acceleration(
    dynamics: Dynamics,
    R: Array,
    velocity: Array,
    omega_body: Array,
    water_velocity: Array,
    net_weight: float,
    out: Array,
) -> None:
    """Write the acceleration over ground without thrust, NED, shape (3,) [m/s2].

    The translational part of (11): drag against the water, W - B, and the rotation of the body axes, in which mass and
    drag are given. The coupling of rotation into translation through added mass is neglected, except for the thrusters'
    moments in `thrust_acceleration`.

    Parameters
    ----------
    dynamics : Dynamics
        Of the vehicle.
    R : ndarray, shape (3, 3)
        From body to world.
    velocity : ndarray, shape (3,)
        Over ground [m/s], world frame.
    omega_body : ndarray, shape (3,)
        [rad/s].
    water_velocity : ndarray, shape (3,)
        Velocity of the water [m/s], world frame.
    net_weight : float
        W - B [N].
    out : ndarray, shape (3,)
        Receives the acceleration.
    """
    force, relative, momentum = zeros(6), zeros(3), zeros(3)
    for i in range(3):
        for k in range(3):
            relative[i] += R[k, i] * (velocity[k] - water_velocity[k])
    for i in range(3):
        for k in range(3):
            momentum[i] += dynamics.mass[i, k] * relative[k]
    for i in range(3):
        drag = (dynamics.linear_damping[i] + dynamics.quadratic_damping[i] * abs(relative[i])) * relative[i]
        j, k = (i + 1) % 3, (i + 2) % 3
        # d(M nu_r)/dt + omega x (M nu_r) = force
        force[i] = net_weight * R[2, i] - drag - (omega_body[j] * momentum[k] - omega_body[k] * momentum[j])
    body = zeros(6)
    product(dynamics.inverse_mass, force, body)
    for i in range(3):  # the body axes rotate: omega x nu_r
        j, k = (i + 1) % 3, (i + 2) % 3
        relative_turning = omega_body[j] * relative[k] - omega_body[k] * relative[j]
        body[i] += relative_turning
    for i in range(3):
        out[i] = 0.0
        for k in range(3):
            out[i] += R[i, k] * body[k]


def thrust_acceleration(dynamics: Dynamics, thrusters: Thrusters, R: Array, forces: Array, out: Array) -> None:
    """Write the acceleration by thruster forces [N], shape (6,): linear in NED, angular in body axes."""
    wrench, body = zeros(6), zeros(6)
    product(thrusters.matrix, forces, wrench)
    product(dynamics.inverse_mass, wrench, body)
    for i in range(3):
        out[i] = 0.0
        for k in range(3):
            out[i] += R[i, k] * body[k]
        out[3 + i] = body[3 + i]
