"""Axes that thrusters drive, of random layouts, against linear programs; and vehicles that leave some of them."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.optimize import linprog

from controller import LAWS, LawError
from controller.allocation import Allocation
from controller.driven_axes import AXES, passive_axes, undriven_axes
from controller.laws.deployable.braking import UNLIMITED, max_upright_speed
from controller.laws.deployable.model import make_thrusters, reallocate
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu import load_vehicle

HEAVY = load_vehicle("bluerov2_heavy")
ROV = load_vehicle("bluerov2")
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
WEAK = 0.01  # force or moment, as a fraction of a thruster's, below which an axis is not driven


def layout(seed):
    """Return a random vehicle of five to seven thrusters: level ones at any angle, and upright or oblique ones."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 8))
    columns = []
    for j in range(n):
        heading, position = rng.uniform(-np.pi, np.pi), rng.uniform(-0.25, 0.25, 3)
        level = j < n - 3 + int(rng.integers(2))
        axis = np.array([np.cos(heading), np.sin(heading), 0.0]) if level else np.array([0.0, 0.0, -1.0])
        if rng.integers(4) == 0:
            axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        columns.append([*axis, *np.cross(position, axis)])
    low = np.where(rng.random(n) < 0.15, 0.0, -40.0)
    return dataclasses.replace(
        ROV, name=f"random{seed}", thruster_matrix=np.array(columns).T, thrust_min=low, thrust_max=np.full(n, 40.0),
        thrust_time_constant=np.zeros(n),
    )  # fmt: skip


def greatest(vehicle, axis, sign, left):
    """Return the greatest force or moment along an axis with none along others, by a linear program."""
    rows = [i for i in range(6) if i not in left]
    equal = np.column_stack([vehicle.thruster_matrix, -sign * np.eye(6)[axis]])[rows]
    bounds = [*zip(vehicle.thrust_min, vehicle.thrust_max, strict=True), (0.0, None)]
    return -linprog(np.r_[np.zeros(vehicle.n_thrusters), -1.0], A_eq=equal, b_eq=np.zeros(len(rows)), bounds=bounds).fun


def is_driven(vehicle, left, least):
    parts = vehicle.thruster_matrix[:3], vehicle.thruster_matrix[3:]
    sizes = np.repeat([40.0 * np.linalg.norm(part, axis=0).max() for part in parts], 3)
    axes = [axis for axis in range(6) if axis not in left]
    return all(greatest(vehicle, axis, sign, left) > least * sizes[axis] for axis in axes for sign in (1.0, -1.0))


@pytest.mark.medium(fast=4)
@pytest.mark.parametrize("seed", [*range(12), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(12, 200))])
def test_random_layout_is_driven_or_refused_by_its_axes(seed):
    vehicle = layout(seed)
    B, limits = vehicle.thruster_matrix, (vehicle.thrust_min, vehicle.thrust_max)
    (left,) = passive_axes(B, *(limit[None] for limit in limits))
    choices = itertools.product((WEAK, 1e-6), ([], [4], [3], [3, 4]))
    expected = next((axes for least, axes in choices if is_driven(vehicle, axes, least)), None)
    assert left == expected
    law = LAWS["deployable"]
    if left is None:
        with pytest.raises(LawError) as refused:
            law.for_vehicle(vehicle_model(vehicle), law.gains_type(), LEVEL, 0.02, 0)
        names = [AXES[axis] for axis in undriven_axes(B, *limits)]
        assert names and all(name in str(refused.value) for name in names) and "\n" not in str(refused.value)
        return
    model = vehicle_model(vehicle)
    memory = law.for_vehicle(model, law.gains_type(), LEVEL, 0.02, 0).memory
    thrusters = memory.thrusters  # leave as well what the regularized allocation would give by less than half
    given = np.diag(thrusters.matrix @ thrusters.allocator)[thrusters.metric > 0.0]
    assert (thrusters.metric[left] == 0.0).all() and (model.righting_moment == 0.0 or given.sum() > len(given) - 1.5)
    assert (memory.dynamics.braking > 0.0).all()
    allocation, forces = Allocation(B, *limits, rights=True), np.empty(B.shape[1])
    for axis in set(range(6)) - set(left) if (vehicle.thrust_min < 0.0).all() else ():
        allocation(1e-3 * np.eye(6)[axis], forces)
        given = B @ forces
        given[left] = 0.0
        assert given == pytest.approx(1e-3 * np.eye(6)[axis], abs=1e-9)


def test_bluerov2_leaves_pitch_and_without_a_vertical_thruster_roll():
    thrusters = make_thrusters(vehicle_model(ROV))
    for lost, left in [*((j, [4]) for j in range(4)), (4, [3, 4]), (5, [3, 4]), (None, [4])]:
        thrusters.health[:] = 1.0
        if lost is not None:
            thrusters.health[lost] = 0.0
        reallocate(thrusters)
        assert np.flatnonzero(thrusters.metric == 0.0).tolist() == left
        for axis in set(range(6)) - set(left):
            wrench = (5.0 if axis < 3 else 0.5) * np.eye(6)[axis]
            given = thrusters.matrix @ thrusters.allocator @ wrench
            given[left] = 0.0
            assert given == pytest.approx(wrench, abs=0.06)


def test_vehicles_that_drive_all_axes_have_no_righting_moment_in_their_model():
    for name in ("odin", "bluerov2_heavy", "rexrov"):
        assert vehicle_model(load_vehicle(name)).righting_moment == 0.0
    assert vehicle_model(ROV).righting_moment == pytest.approx(112.33 * 0.1)


@pytest.mark.parametrize(
    ("keep", "words"), [([0], "surge, sway, heave and yaw"), ([4, 5], "surge, sway and yaw"), ([0, 1, 2, 3], "heave")]
)
def test_underactuated_vehicle_is_refused_by_its_axes(keep, words):
    own = {name: getattr(ROV, name)[..., keep] for name in ("thruster_matrix", "thrust_min", "thrust_max")}
    vehicle = dataclasses.replace(ROV, thrust_time_constant=np.zeros(len(keep)), **own)
    law = LAWS["deployable"]
    with pytest.raises(LawError, match=rf"thrusters.matrix with its limits does not drive {words} both ways"):
        law.for_vehicle(vehicle_model(vehicle), law.gains_type(), LEVEL, 0.02, 0)


def test_vehicle_that_does_not_right_itself_is_refused():
    law, vehicle = LAWS["deployable"], dataclasses.replace(ROV, r_B=-ROV.r_B)
    with pytest.raises(
        LawError, match=r"does not drive pitch both ways, or too weakly, and the righting moment is -11.2 N m"
    ):
        law.for_vehicle(vehicle_model(vehicle), law.gains_type(), LEVEL, 0.02, 0)


def test_a_righting_moment_does_not_bound_the_speed_of_driven_axes():
    assert max_upright_speed(vehicle_model(HEAVY)._replace(righting_moment=5.0), 0.35) == UNLIMITED
    assert 0.3 < max_upright_speed(vehicle_model(ROV), 0.35) < 1.5
