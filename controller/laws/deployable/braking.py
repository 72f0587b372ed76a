"""The deceleration available in every direction, also with any one thruster lost."""

from __future__ import annotations

import functools
import itertools

import numpy as np
from numpy.typing import NDArray

from controller.errors import LawError
from controller.law import VehicleModel

Array = NDArray[np.float64]

_NEGLIGIBLE = 1e-6  # force that counts as zero, as a fraction of the greatest limit


def least_forces(vehicle: VehicleModel) -> Array:
    """Return the maximum force in the worst direction, with each thruster lost and with none; returns (m + 1,) [N]."""
    # Without any moment, over the 26 directions to faces, edges and corners of a cube in body axes: for the shipped
    # vehicles within 2 % of the least over all directions. If the remaining thrusters cannot push in every direction,
    # the force with none lost is returned instead.
    B, lower, upper = vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max
    forces = np.array(_least_forces(B.tobytes(), B.shape[1], lower.tobytes(), upper.tobytes()))
    negligible = _NEGLIGIBLE * np.abs(np.r_[lower, upper]).max()
    if not forces[-1] > negligible:
        raise LawError(
            f"{B.shape[1]} thrusters push {abs(forces[-1]):.3g} N in the worst direction without a moment, "
            "expected more than 0: the law needs forces in every direction to keep out of regions"
        )
    return np.where(forces > negligible, forces, forces[-1])


@functools.lru_cache(maxsize=16)
def _least_forces(matrix: bytes, m: int, least: bytes, greatest: bytes) -> tuple[float, ...]:
    B = np.frombuffer(matrix).reshape(6, m)
    lower, upper = np.frombuffer(least), np.frombuffer(greatest)
    directions = [np.array(d) / np.linalg.norm(d) for d in itertools.product((-1, 0, 1), repeat=3) if any(d)]
    forces = []
    for lost in range(m + 1):
        working = np.arange(m) != lost
        limits = [(lo, up) if works else (0.0, 0.0) for lo, up, works in zip(lower, upper, working, strict=True)]
        forces.append(min(_greatest_force(B, limits, direction) for direction in directions))
    return tuple(forces)


def _greatest_force(B: Array, limits: list[tuple[float, float]], direction: Array) -> float:
    """Return the greatest s with B u = [s direction, 0] and u within its limits."""
    from scipy.optimize import linprog  # a slow import, a third of a command's start time

    m = B.shape[1]
    cost = np.zeros(m + 1)
    cost[m] = -1.0
    equal = np.hstack([B, np.r_[-direction, np.zeros(3)][:, None]])
    solution = linprog(cost, A_eq=equal, b_eq=np.zeros(6), bounds=[*limits, (0.0, None)])
    return float(solution.x[m]) if solution.status == 0 else 0.0
