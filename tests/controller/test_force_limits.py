"""The force of thrusters in each direction against linear programs, and against a vehicle's geometry."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from controller.force_limits import max_forces
from plant_fmu import load_vehicle

ODIN = load_vehicle("odin")


def by_linear_program(matrix, lower, upper, direction, wrench):
    """Return the greatest s with B u = wrench + [s direction, 0] and u within its limits, NaN if there is none."""
    equal = np.column_stack([matrix, -np.r_[direction, np.zeros(3)]])
    bounds = [*zip(lower, upper, strict=True), (None, None)]
    done = linprog(np.r_[np.zeros(len(lower)), -1.0], A_eq=equal, b_eq=wrench, bounds=bounds)
    return -done.fun if done.success and done.fun <= 1e-9 else np.nan


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("count", [1, 4, 6, 7, 8, 11, pytest.param(40, marks=pytest.mark.medium)])
def test_force_is_that_of_a_linear_program(count):
    """Random thrusters, of which some are lost, some are alike, and all may push in a plane alone."""
    rng = np.random.default_rng(count)
    finite, flat = 0, 0
    for i in range(24):
        matrix = rng.normal(size=(6, count)) * [[1.0], [1.0], [1.0], [0.2], [0.2], [0.2]]
        if i % 3 == 1:
            matrix[[2, 3, 4]] = 0.0
        if i % 4 == 1 and count > 1:
            matrix[:, -1] = -2.0 * matrix[:, 0]
        alive = rng.random(count) < 0.9
        lower, upper = -rng.uniform(0.0, 30.0, count) * alive, rng.uniform(0.0, 40.0, count) * alive
        wrench = matrix @ rng.uniform(lower, upper) * rng.choice([0.0, 0.5, 1.0, 1.6])
        inside = matrix @ (upper - lower)
        directions = np.array([rng.normal(size=3), inside[:3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        directions = directions[directions.any(axis=1)]
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        forces = max_forces(matrix, lower, upper, directions, wrench)
        if np.isnan(forces).any():  # outside of the limits, and then beside one ray and its opposite at least
            assert np.isnan(forces).all()
            u = linprog(np.zeros(count), A_eq=matrix, b_eq=wrench, bounds=list(zip(lower, upper, strict=True)))
            assert not u.success
            continue
        for direction, force in zip(directions, forces, strict=True):
            assert force == pytest.approx(by_linear_program(matrix, lower, upper, direction, wrench), abs=1e-6)
            finite, flat = finite + (force > 1e-3), flat + (force < 1e-9)
    assert flat and (finite or count < 6)


@pytest.mark.parametrize(
    ("direction", "load", "lost", "expected"),
    [  # four horizontal thrusters at 45 degrees, four vertical ones, of 27 N each
        ([1, 0, 0], 0.0, [], 4 * 27.0 / math.sqrt(2.0)),
        ([-math.sqrt(0.5), -math.sqrt(0.5), 0], 0.0, [], 54.0),
        ([0, 0, 1], 0.0, [], 108.0),
        ([0, 0, -1], 0.0, [], 108.0),
        ([0, 0, 1], 0.0, [4], 54.0),  # a lost vertical thruster leaves half of the vertical force
        ([0, 0, 1], 100.0, [], 8.0),
        ([0, 0, 1], 108.1, [], math.nan),
    ],
)
def test_force_follows_from_the_geometry(direction, load, lost, expected):
    alive = ~np.isin(np.arange(8), lost)
    limits = ODIN.thrust_min * alive, ODIN.thrust_max * alive
    (force,) = max_forces(
        ODIN.thruster_matrix, *limits, np.array([direction], float), np.array([0, 0, load, 0, 0, 0.0])
    )
    assert force == pytest.approx(expected, nan_ok=True)
