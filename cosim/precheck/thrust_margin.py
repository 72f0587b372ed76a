"""Thrust margins: force of the thrusters in each direction, and what is left beside current and net buoyancy."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from controller.quaternion import rotation_matrix
from controller.restoring import regressor
from controller.theory import coriolis, damping
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

# the 26 directions from the middle of a cube to its faces, edges and corners, by name
_WORDS = (("south", "", "north"), ("west", "", "east"), ("up", "", "down"))
DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "-".join(_WORDS[axis][1 + sign] for axis, sign in enumerate(signs) if sign): tuple(
        (np.array(signs) / np.linalg.norm(signs)).tolist()
    )
    for signs in itertools.product((-1, 0, 1), repeat=3)
    if any(signs)
}


@dataclass(frozen=True)
class Margin:
    """Force in one direction at zero moment."""

    direction: str  # one of DIRECTIONS
    force: float  # N


@dataclass(frozen=True)
class ThrustMargin:
    """Forces that the thrusters of a vehicle at rest can give while its attitude is kept."""

    hold: tuple[float, ...]  # (6,) N, N m, body frame: wrench against current, weight and buoyancy
    drag: float  # N, drag of the current
    excess_weight: float  # N, W - B
    thrust: Margin | None  # least over the directions, without `hold`; None if the limits exclude a zero wrench
    left: Margin | None  # least over the directions beside `hold`; None if `hold` alone is not feasible
    left_without: tuple[Margin | None, ...]  # `left` with each thruster lost


def greatest_force(vehicle: Vehicle, direction_body: Array, hold: Array, alive: Array) -> float | None:
    """Return the maximum force in a direction beside a constant wrench, by a linear program; hold [N, N m]."""
    # with returns [N]
    matrix = np.column_stack([vehicle.thruster_matrix, -np.r_[direction_body, 0.0, 0.0, 0.0]])
    bounds = [*zip(vehicle.thrust_min * alive, vehicle.thrust_max * alive, strict=True), (0.0, None)]
    done = linprog(np.r_[np.zeros(vehicle.n_thrusters), -1.0], A_eq=matrix, b_eq=hold, bounds=bounds)
    return float(-done.fun) if done.success else None


def held_wrench(vehicle: Vehicle, phi: Array, quaternion: Array, current: Array) -> Array:
    """Return the wrench that keeps a vehicle at rest in a current, (6,) [N, N m], body frame: (11) with nu = 0."""
    # with phi [N, N m], current [m/s]
    relative = np.zeros(6)
    relative[:3] = -rotation_matrix(quaternion).T @ current
    drag = damping(np.array(vehicle.linear_damping), np.array(vehicle.quadratic_damping), relative) * relative
    wrench: Array = coriolis(np.array(vehicle.added_mass), relative) @ relative + drag + regressor(quaternion) @ phi
    return wrench


def thrust_margin(vehicle: Vehicle, phi: Array, quaternion: Array, current: Array) -> ThrustMargin:
    """Return the forces that the thrusters can give, and those left while the vehicle is kept still."""
    # with phi [N, N m], current [m/s]
    hold = held_wrench(vehicle, phi, quaternion, current)
    every = np.ones(vehicle.n_thrusters, dtype=bool)
    return ThrustMargin(
        hold=tuple(hold.tolist()),
        drag=float(np.linalg.norm(held_wrench(vehicle, np.zeros(4), quaternion, current)[:3])),
        excess_weight=float(phi[0]),
        thrust=least_margin(vehicle, quaternion, np.zeros(6), every),
        left=least_margin(vehicle, quaternion, hold, every),
        left_without=tuple(least_margin(vehicle, quaternion, hold, alive) for alive in ~np.diag(every)),
    )


def least_margin(vehicle: Vehicle, quaternion: Array, hold: Array, alive: Array) -> Margin | None:
    """Return the direction and force of the minimum margin, None if `hold` is not feasible."""
    to_body = rotation_matrix(quaternion).T
    worst: Margin | None = None
    for name, direction in DIRECTIONS.items():
        force = greatest_force(vehicle, to_body @ np.array(direction), hold, alive)
        if force is None:
            return None
        if worst is None or force < worst.force:
            worst = Margin(name, force)
    return worst
