"""Thrust margins: force of the thrusters in each direction, and what is left beside current and net buoyancy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from controller.driven_axes import add_righting
from controller.force_limits import DIRECTIONS, max_forces
from controller.laws.deployable.gains import DeployableGains
from controller.quaternion import rotation_matrix
from controller.restoring import regressor
from controller.theory import coriolis, damping
from cosim.scenario.vehicle_model import vehicle_model
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

_WORDS = (("south", "", "north"), ("west", "", "east"), ("up", "", "down"))
NAMES = [
    "-".join(filter(None, (words[1 + int(sign)] for words, sign in zip(_WORDS, np.sign(direction), strict=True))))
    for direction in DIRECTIONS
]  # of the directions in the world


@dataclass(frozen=True)
class Margin:
    """Force in one direction at zero moment."""

    direction: str  # one of `NAMES`
    force: float  # N


@dataclass(frozen=True)
class ThrustMargin:
    """Forces that the thrusters of a vehicle at rest can give while its attitude is kept."""

    hold: tuple[float, ...]  # (6,) N, N m, body frame: wrench against current, weight, buoyancy and trim
    drag: float  # N, drag of the current
    excess_weight: float  # N, W - B
    thrust: Margin | None  # least over the directions, without `hold`; None if the limits exclude a zero wrench
    left: Margin | None  # least over the directions beside `hold`; None if `hold` alone is not feasible
    left_without: tuple[Margin | None, ...]  # `left` with each thruster lost


def held_wrench(vehicle: Vehicle, phi: Array, quaternion: Array, current: Array) -> Array:
    """Return the wrench that keeps a vehicle at rest in a current, (6,) [N, N m], body frame: (11) with nu = 0."""
    # Units of arguments: phi [N, N m]; current [m/s]
    wrench: Array = drag_wrench(vehicle, quaternion, current) + regressor(quaternion) @ phi - vehicle.trim
    return wrench


def drag_wrench(vehicle: Vehicle, quaternion: Array, current: Array) -> Array:
    """Return the part of it that is against the current [m/s] alone."""
    relative = np.zeros(6)
    relative[:3] = -rotation_matrix(quaternion).T @ current
    drag = damping(np.array(vehicle.linear_damping), np.array(vehicle.quadratic_damping), relative) * relative
    wrench: Array = coriolis(np.array(vehicle.added_mass), relative) @ relative + drag
    return wrench


def thrust_margin(vehicle: Vehicle, phi: Array, quaternion: Array, current: Array) -> ThrustMargin:
    """Return the forces that the thrusters can give, and those left while the vehicle is kept still."""
    # Units of arguments: phi [N, N m]; current [m/s]
    hold = held_wrench(vehicle, phi, quaternion, current)
    n = vehicle.n_thrusters
    *without, left = least_margins(vehicle, quaternion, hold, ~np.eye(n + 1, n, dtype=bool))
    return ThrustMargin(
        hold=tuple(hold.tolist()),
        drag=float(np.linalg.norm(drag_wrench(vehicle, quaternion, current)[:3])),
        excess_weight=float(phi[0]),
        thrust=least_margins(vehicle, quaternion, np.zeros(6), np.ones((1, n)))[0],
        left=left,
        left_without=tuple(without),
    )


def least_margins(vehicle: Vehicle, quaternion: Array, hold: Array, alive: Array) -> list[Margin | None]:
    """Return the direction and force of the minimum margin for each row of `alive`, None if `hold` is not feasible."""
    directions = DIRECTIONS @ rotation_matrix(quaternion)  # in the body frame
    B, lower, upper = vehicle.thruster_matrix, vehicle.thrust_min * alive, vehicle.thrust_max * alive
    righting = vehicle_model(vehicle).righting_moment
    if righting > 0.0:
        B, lower, upper = add_righting(B, lower, upper, righting * np.sin(DeployableGains().tilt))
    forces = max_forces(B, lower, upper, directions, hold)
    worst = np.argmin(forces.round(9), axis=1)  # the first of equal ones
    return [None if np.isnan(row[i]) else Margin(NAMES[i], float(row[i])) for row, i in zip(forces, worst, strict=True)]
