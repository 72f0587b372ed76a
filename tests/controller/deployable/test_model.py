"""The vehicle as the deployable law sees it, against the plant."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from controller import LawError
from controller.laws.deployable.braking import min_forces
from controller.laws.deployable.model import (
    Loads,
    free_acceleration,
    make_dynamics,
    make_thrusters,
    reallocate,
    thrust_acceleration,
)
from controller.quaternion import rotation_matrix
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu import Plant
from plant_fmu.vehicle import load_vehicle
from tests.controller.deployable.scenery import MODELS

POSE = [*(f"quaternion.e{i}" for i in range(4)), *(f"velocity.{a}" for a in "uvwpqr")]


@pytest.mark.parametrize(
    "name", [name if name == "odin" else pytest.param(name, marks=pytest.mark.slow) for name in MODELS]
)
def test_model_acceleration_matches_the_plant(name):
    """One FMU step of 0.1 ms at random attitudes, rates and currents, with r_G at the origin as the law takes it."""
    rng, step = np.random.default_rng(3), 1e-4
    vehicle = dataclasses.replace(load_vehicle(name), trim=rng.normal(size=6) * [9.0, 9.0, 9.0, 1.0, 1.0, 1.0])
    model = vehicle_model(vehicle)
    dynamics, thrusters = make_dynamics(model, np.ones(9)), make_thrusters(model)
    with Plant(vehicle) as plant:
        for _ in range(8):
            e, nu = rng.normal(size=4), rng.normal(size=6) * [0.6, 0.6, 0.6, 0.3, 0.3, 0.3]
            e /= np.linalg.norm(e)
            current, forces, restoring = rng.normal(size=3) * 0.3, rng.uniform(-9, 9, 8), rng.uniform(-15, 15)
            plant.reset()
            values = {"substep": step, "position.z": 20.0, "buoyancy": vehicle.weight - restoring}
            values |= dict(zip(POSE, (*e, *nu), strict=True)) | {f"r_G.{a}": 0.0 for a in "xyz"}
            values |= {f"current.{a}": c for a, c in zip("xyz", current, strict=True)}
            values |= {f"thrust_time_constant[{i + 1}]": 0.0 for i in range(8)}
            plant.set(values)
            plant.initialize()
            # phi_2..phi_4 of (12): r_G W - r_B B, with r_G at the origin
            moments = -(vehicle.weight - restoring) * np.array([plant[f"r_B.{a}"] for a in "xyz"])
            for j in range(8):
                plant[f"thrust[{j + 1}]"] = forces[j]
            plant.step(step)
            after = np.array([plant[name] for name in POSE])
            R = rotation_matrix(e)
            before = R @ nu[:3]
            there = np.r_[rotation_matrix(after[:4]) @ after[4:7] - before, after[7:] - nu[3:]] / step
            free = free_acceleration(dynamics, R, before, nu[3:], Loads(current, restoring, moments, 0.0, 1.0))
            thrusters.effectiveness[:] = rng.uniform(0.3, 1.0, 8)
            pushed = thrust_acceleration(dynamics, thrusters, R, forces / thrusters.effectiveness)
            # a step is a difference quotient: it is off by half a step times what the acceleration changes in a second
            assert (free + pushed)[:3] == pytest.approx(there[:3], abs=2e-3 * (0.1 + np.abs(there[:3]).max()))
            assert (free + pushed)[3:] == pytest.approx(there[3:], abs=2e-3 * (0.1 + np.abs(there[3:]).max()))


def test_remaining_thrusters_realize_the_wrench_after_a_failure():
    for model in MODELS.values():
        thrusters = make_thrusters(model)
        for lost in range(8):
            thrusters.health[:] = 1.0
            thrusters.health[lost] = 0.0
            reallocate(thrusters)
            assert thrusters.lower[lost] == thrusters.upper[lost] == 0.0
            wrench = np.array([3.0, -4.0, 2.0, 0.1, -0.2, 0.3])
            forces = thrusters.allocator @ wrench
            assert forces[lost] == pytest.approx(0.0, abs=1e-12)
            assert model.thruster_matrix @ forces == pytest.approx(wrench, abs=0.05)


@pytest.mark.slow
def test_least_force_is_that_of_the_worst_direction():
    """Against a search over all directions for the greatest force that the limits allow without moment: within 2 %."""
    for model in MODELS.values():
        forces = min_forces(model, 0.35)
        for lost in (2, 6, 8):
            limits = [(0.0, 0.0) if j == lost else (-u, u) for j, u in enumerate(model.thrust_max)]

            def support(angles, limits=limits, B=model.thruster_matrix):
                """Half the width of the set of forces along a direction: its least is the ball's that it holds."""
                a, b = angles
                n = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
                return -linprog(-(n @ B[:3]), A_eq=B[3:], b_eq=np.zeros(3), bounds=limits).fun

            rng = np.random.default_rng(0)
            starts = [rng.uniform([0.0, -1.5], [6.3, 1.5]) for _ in range(25)]
            best = min(starts, key=support)
            least = minimize(support, best, method="Nelder-Mead", options={"maxiter": 60}).fun
            assert 0.98 * forces[lost] <= least <= 1.001 * forces[lost]


def with_thrusters(model, keep):
    matrix = np.ascontiguousarray(model.thruster_matrix[:, keep])
    return model._replace(thruster_matrix=matrix, thrust_min=model.thrust_min[keep], thrust_max=model.thrust_max[keep])


@pytest.mark.medium
def test_vehicle_without_force_in_every_direction_is_rejected():
    with pytest.raises(
        LawError, match=r"does not drive roll both ways, or too weakly, and the righting moment is 0 N m"
    ):
        min_forces(with_thrusters(MODELS["bluerov2_heavy"], [0, 1, 2, 3, 4, 6]), 0.35)


def test_without_redundancy_least_force_after_a_loss_is_the_nominal_one():
    six = with_thrusters(MODELS["odin"], [0, 1, 2, 4, 5, 6])
    forces = min_forces(
        six._replace(
            thruster_matrix=np.vstack([np.eye(3), np.zeros((3, 3))]) @ np.eye(3, 6)
            + np.vstack([np.zeros((3, 6)), np.eye(3, 6, 3)])
        ),
        0.35,
    )
    assert forces == pytest.approx(np.full(7, 27.0))


def test_model_does_not_depend_on_weight_and_buoyancy():
    """Another weight, buoyancy and other centers make the same numbers."""
    vehicle = load_vehicle("odin")
    other = dataclasses.replace(vehicle, weight=1500.0, buoyancy=1490.0, r_G=(0.1, 0.0, 0.2), r_B=(0.0, 0.1, 0.0))
    for ours, theirs in zip(vehicle_model(vehicle), vehicle_model(other), strict=True):
        assert np.array_equal(ours, theirs)


@pytest.mark.medium
def test_least_force_of_asymmetric_thrusters_is_that_of_the_weaker_direction():
    """Vertical thrusters that push down less than up: the worst direction is among those that go down, or up."""
    for low, high in ((-5.0, 27.0), (-27.0, 5.0)):
        uneven = MODELS["odin"]._replace(thrust_min=np.full(8, -27.0), thrust_max=np.full(8, 27.0))
        vertical = np.abs(uneven.thruster_matrix[2]) > 0.5
        uneven.thrust_min[vertical], uneven.thrust_max[vertical] = low, high
        down = np.sort(uneven.thruster_matrix[2, vertical] * low)
        assert down.size == 4 and np.all(down == down[0])
        assert min_forces(uneven, 0.35)[-1] == pytest.approx(20.0)


def test_stuck_thruster_has_equal_limits_at_its_force():
    thrusters = make_thrusters(MODELS["odin"])
    thrusters.health[3], thrusters.stuck[3] = 0.0, -7.0
    reallocate(thrusters)
    assert thrusters.lower[3] == thrusters.upper[3] == -7.0
    assert np.array_equal(thrusters.matrix[:, 3], thrusters.nominal_matrix[:, 3])
