"""Thruster allocation."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller import LawError
from controller.allocation import Allocation, invert_curve
from cosim.identification.actuation import steady_forces
from plant_fmu import load_vehicle

VEHICLE = load_vehicle("odin")
B, LOW, HIGH = VEHICLE.thruster_matrix, VEHICLE.thrust_min, VEHICLE.thrust_max
wrenches = st.lists(st.floats(-1e4, 1e4), min_size=6, max_size=6).map(np.array)


def allocate(tau, limits="direction", low=LOW, high=HIGH):
    forces = np.empty(8)
    Allocation(B, low, high, limits)(np.asarray(tau, float), forces)
    return forces


def test_feasible_wrench_is_allocated_exactly_with_least_effort():
    tau = np.array([10.0, -5.0, 8.0, 1.0, -2.0, 3.0])
    forces = allocate(tau)
    assert B @ forces == pytest.approx(tau)
    assert forces == pytest.approx(np.linalg.lstsq(B, tau, rcond=None)[0])


@given(wrenches)
def test_direction_mode_scales_the_wrench_within_limits(tau):
    forces = allocate(tau)
    assert np.all(forces >= LOW - 1e-9) and np.all(forces <= HIGH + 1e-9)
    given_wrench = B @ forces
    norm = np.linalg.norm(tau)
    if norm > 1e-6:
        scale = given_wrench @ tau / norm**2
        assert 0.0 < scale <= 1.0 + 1e-9
        assert given_wrench == pytest.approx(scale * tau, abs=1e-6)


@given(wrenches)
def test_per_thruster_mode_clips_each_force(tau):
    assert allocate(tau, "per-thruster") == pytest.approx(np.clip(np.linalg.pinv(B) @ tau, LOW, HIGH), abs=1e-9)


def test_limits_may_differ_by_direction():
    low, high = np.full(8, -5.0), np.full(8, 20.0)
    forces = allocate([0.0, 0.0, 1000.0, 0.0, 0.0, 0.0], low=low, high=high)  # down: the vertical ones push back
    assert forces.min() == pytest.approx(-5.0)
    forces = allocate([0.0, 0.0, -1000.0, 0.0, 0.0, 0.0], low=low, high=high)
    assert forces.max() == pytest.approx(20.0)


def test_one_sided_thruster_limits_can_block_a_wrench():
    high = HIGH.copy()
    high[4:] = 0.0
    assert B @ allocate([0.0, 0.0, -50.0, 0.0, 0.0, 0.0], high=high) == pytest.approx(np.zeros(6))


@pytest.mark.parametrize("dead", range(8))
@pytest.mark.parametrize("limits", ["direction", "per-thruster"])
def test_healthy_thrusters_compensate_for_a_dead_one(dead, limits):
    rov = load_vehicle("bluerov2_heavy")
    low, high = rov.thrust_min.copy(), rov.thrust_max.copy()
    low[dead] = high[dead] = 0.0
    allocation, forces = Allocation(rov.thruster_matrix, low, high, limits), np.empty(8)
    for axis in range(6):
        tau = np.eye(6)[axis] * (10.0 if axis < 3 else 0.5)
        assert not allocation(tau, forces)
        assert rov.thruster_matrix @ forces == pytest.approx(tau, abs=1e-12)
        assert forces[dead] == 0.0


def test_allocation_reports_saturation():
    forces = np.empty(8)
    for limits in ("direction", "per-thruster"):
        allocation = Allocation(B, LOW, HIGH, limits)
        assert allocation(np.array([500.0, 0, 0, 0, 0, 0]), forces)
        assert not allocation(np.array([5.0, 0, 0, 0, 0, 0]), forces)


@pytest.mark.parametrize(
    "arguments", [(B, LOW[:7], HIGH), (B, LOW + 30.0, HIGH), (B[:5], LOW, HIGH), (B, LOW, HIGH, "some")]
)
def test_invalid_setup_is_rejected(arguments):
    with pytest.raises(LawError):
        Allocation(*arguments)


@given(
    st.lists(st.floats(0.0, 1.0), min_size=8, max_size=8), st.lists(st.floats(0.0, 0.9), min_size=8, max_size=8),
    st.lists(st.floats(0.0, 1.0), min_size=8, max_size=8),
)  # fmt: skip
def test_commands_give_the_forces_by_dead_band_and_curve(fractions, dead, curve):
    vehicle = replace(VEHICLE, thrust_dead_band=np.array(dead), thrust_curve=np.array(curve))
    forces = LOW + np.array(fractions) * (HIGH - LOW)
    commands = forces.copy()
    invert_curve(commands, LOW, HIGH, np.array(dead), np.array(curve))
    assert steady_forces(commands, vehicle) == pytest.approx(forces, abs=1e-6)
    assert np.all((commands == 0.0) == (forces == 0.0)) and np.all((commands >= LOW) & (commands <= HIGH))
