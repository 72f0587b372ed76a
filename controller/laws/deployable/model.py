"""The vehicle model of the deployable law: accelerations, and working thrusters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.law import VehicleModel
from controller.laws.deployable.thrust_limit import command_for, limited_force
from controller.linear_algebra import invert_symmetric, product
from controller.stack_array import zeros

Array = NDArray[np.float64]

_REGULARISATION = 1e-3  # relative to a thruster's diagonal entry of H


class Dynamics(NamedTuple):
    """Constants of the vehicle, derived from its nominal parameters."""

    mass: Array  # (6, 6) kg, kg m, kg m2: M, rigid body and added, center of gravity at the origin
    inverse_mass: Array  # (6, 6) 1/kg, 1/(kg m), 1/(kg m2): M^-1
    linear_damping: Array  # (6,) N s/m, N m s/rad
    quadratic_damping: Array  # (6,) N s2/m2, N m s2/rad2
    translational_mass: Array  # (1,) kg, mean over the three axes
    rigid_mass: Array  # (1,) kg, without added mass
    braking: Array  # (m + 1,) m/s2, worst direction: with thruster j lost, and last with all working


class Thrusters(NamedTuple):
    """Thrusters and their allocation."""

    # A failed thruster has a column of zeros and limits of zero; a stuck one keeps its column, and its limits are its
    # force.

    nominal_matrix: Array  # (6, m) thruster matrix of the vehicle
    matrix: Array  # (6, m) thruster matrix with the columns of failed thrusters zero, unless they are stuck
    lower: Array  # (m,) N, present lower limits
    upper: Array  # (m,) N, present upper limits
    nominal_lower: Array  # (m,) N, lower limits of the vehicle
    nominal_upper: Array  # (m,) N, upper limits of the vehicle
    inverse: Array  # (m, m) H^-1 with H = B^T Q B + regularization
    allocator: Array  # (m, 6) H^-1 B^T Q: maps a wrench to its least-squares forces
    metric: Array  # (6,) 1/N2, 1/(N m)2: Q, cost of an error of the wrench
    health: Array  # (m,) 1 working, 0 failed
    stuck: Array  # (m,) N, constant force of a stuck thruster; NaN for all others
    effectiveness: Array  # (m,) estimated ratio of each thruster's force to the commanded one
    ceiling: Array  # (2, m) estimated true limits, as a fraction of the nominal ones, and their standard deviations
    forces: Array  # (m,) N, commanded forces of the last period
    acting: Array  # (m,) N, mean forces behind the lag over that period
    acting_now: Array  # (m,) N, forces behind the lag at its end


def make_dynamics(vehicle: VehicleModel, braking: Array) -> Dynamics:
    """Return the constants of a vehicle; braking (m + 1,) [N]."""
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
        rigid_mass=np.array([vehicle.rigid_mass[0, 0]]),
        braking=np.asarray(braking) / mean,
    )


def make_thrusters(vehicle: VehicleModel) -> Thrusters:
    """Return the thrusters, all working."""
    B = vehicle.thruster_matrix
    m = B.shape[1]
    arm = np.sqrt(np.sum(B[3:] ** 2) / np.sum(B[:3] ** 2))  # m, typical lever arm of a thruster
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
        stuck=np.full(m, np.nan),
        effectiveness=np.ones(m),
        ceiling=np.vstack([np.full(m, 2.0), np.zeros(m)]),
        forces=np.zeros(m),
        acting=np.zeros(m),
        acting_now=np.zeros(m),
    )
    reallocate(thrusters)
    return thrusters


def reallocate(thrusters: Thrusters) -> None:
    """Update matrix, limits and inverses from `health` and `stuck`."""
    m = thrusters.health.size
    for j in range(m):
        if not np.isnan(thrusters.stuck[j]):  # constant force for any command
            for k in range(6):
                thrusters.matrix[k, j] = thrusters.nominal_matrix[k, j]
            thrusters.lower[j] = thrusters.upper[j] = thrusters.stuck[j]
            continue
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


class Loads(NamedTuple):
    """Loads on the vehicle other than its thrusters."""

    water_velocity: Array  # (3,) m/s, NED
    net_weight: Array  # (1,) N, W - B
    moments: Array  # (3,) phi_2..phi_4 of (12) [N m], body axes


def free_wrench(dynamics: Dynamics, R: Array, velocity: Array, omega_body: Array, loads: Loads, out: Array) -> None:
    """Write the wrench on the body without thrust, shape (6,) [N, N m]: all of (11) but thrust and M nu_r'."""
    # with velocity [m/s], omega_body [rad/s]
    # It has drag against the water, weight and buoyancy, and the rate of the momentum M nu_r in the rotating body axes,
    # which in oblique motion includes Munk's moment.
    relative, momentum = zeros(6), zeros(6)
    _relative_velocity(R, velocity, loads, relative)
    for i in range(3):
        relative[3 + i] = omega_body[i]
    product(dynamics.mass, relative, momentum)
    for i in range(6):
        out[i] = -(dynamics.linear_damping[i] + dynamics.quadratic_damping[i] * abs(relative[i])) * relative[i]
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        out[i] += loads.net_weight[0] * R[2, i] - (omega_body[a] * momentum[b] - omega_body[b] * momentum[a])
        out[3 + i] -= R[2, a] * loads.moments[b] - R[2, b] * loads.moments[a]  # S(k) phi with k = R^T e3
        out[3 + i] -= omega_body[a] * momentum[3 + b] - omega_body[b] * momentum[3 + a]
        out[3 + i] -= relative[a] * momentum[b] - relative[b] * momentum[a]


def to_acceleration(
    dynamics: Dynamics, R: Array, velocity: Array, omega_body: Array, loads: Loads, wrench: Array, out: Array
) -> None:
    """Write the acceleration by a wrench, shape (6,) [N, N m], of a moving vehicle; velocity [m/s]."""
    # with omega_body [rad/s], out [m/s2]
    body, relative = zeros(6), zeros(3)
    _relative_velocity(R, velocity, loads, relative)
    product(dynamics.inverse_mass, wrench, body)
    for i in range(3):  # the body axes rotate: omega x nu_r
        a, b = (i + 1) % 3, (i + 2) % 3
        out[3 + i] = body[3 + i]
        body[3 + i] = body[i] + omega_body[a] * relative[b] - omega_body[b] * relative[a]
    for i in range(3):
        out[i] = 0.0
        for k in range(3):
            out[i] += R[i, k] * body[3 + k]


def _relative_velocity(R: Array, velocity: Array, loads: Loads, out: Array) -> None:
    """Write the velocity [m/s] against the water, body axes, into out[:3]."""
    for i in range(3):
        out[i] = 0.0
        for k in range(3):
            out[i] += R[k, i] * (velocity[k] - loads.water_velocity[k])


def free_acceleration(
    dynamics: Dynamics, R: Array, velocity: Array, omega_body: Array, loads: Loads, out: Array
) -> None:
    """Write the acceleration without thrust, shape (6,), in the frames of `to_acceleration`."""
    wrench = zeros(6)
    free_wrench(dynamics, R, velocity, omega_body, loads, wrench)
    to_acceleration(dynamics, R, velocity, omega_body, loads, wrench, out)


def write_thruster_acceleration(
    dynamics: Dynamics, thrusters: Thrusters, R: Array, R_ahead: Array, out: Array, ahead: Array
) -> None:
    """Write the acceleration by one newton of each thruster, shape (6, m), at the attitudes `R` and `R_ahead`."""
    # Linear in NED [m/s2], angular in body axes [rad/s2].
    body = zeros(6)
    for j in range(thrusters.health.size):
        for i in range(6):
            body[i] = 0.0
            for k in range(6):
                body[i] += dynamics.inverse_mass[i, k] * thrusters.matrix[k, j]
        for i in range(6):
            out[i, j] = ahead[i, j] = body[i]
        for i in range(3):
            out[i, j] = R[i, 0] * body[0] + R[i, 1] * body[1] + R[i, 2] * body[2]
            ahead[i, j] = R_ahead[i, 0] * body[0] + R_ahead[i, 1] * body[1] + R_ahead[i, 2] * body[2]


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


def smallest(values: Array) -> float:
    """Return the smallest of values."""
    result: float = values[0]
    for i in range(values.size):
        result = min(result, values[i])
    return result


def available_braking(dynamics: Dynamics, thrusters: Thrusters) -> float:
    """Return the deceleration [m/s2] in the worst direction with the failed thruster lost, or else any one."""
    # Each further failure halves it, which is a rule of thumb.
    worst, lost, ceiling = smallest(dynamics.braking), 0, 1.0
    for j in range(thrusters.health.size):
        if thrusters.health[j] == 0.0:
            worst = dynamics.braking[j] if lost == 0 else 0.5 * min(worst, dynamics.braking[j])
            lost += 1
        else:
            ceiling = min(ceiling, thrusters.ceiling[0, j])
    return ceiling * worst


def thrust_acceleration(dynamics: Dynamics, thrusters: Thrusters, R: Array, forces: Array, out: Array) -> None:
    """Write the acceleration by thruster forces [N] times effectiveness: (6,), linear in NED, angular in body axes."""
    wrench, body = zeros(6), zeros(6)
    for k in range(6):
        for j in range(forces.size):
            wrench[k] += thrusters.matrix[k, j] * (thrusters.effectiveness[j] * forces[j])
    product(dynamics.inverse_mass, wrench, body)
    for i in range(3):
        out[i] = 0.0
        for k in range(3):
            out[i] += R[i, k] * body[k]
        out[3 + i] = body[3 + i]
