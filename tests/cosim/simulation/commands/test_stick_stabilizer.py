"""Stabilized manual control with late or missing state estimates."""

import numpy as np
import pytest

from controller import VehicleState
from cosim.simulation.commands.stick_stabilizer import StickStabilizer
from plant_fmu import load_vehicle

REACH = np.full(6, 100.0)


def unknown():
    return VehicleState(np.full(3, np.nan), np.full(4, np.nan), np.full(6, np.nan), np.zeros(8))


def know(state, depth):
    state.position[:], state.velocity_body[:] = [0.0, 0.0, depth], 0.0
    state.quaternion[:] = [1.0, 0.0, 0.0, 0.0]


def test_setpoint_is_the_first_known_state():
    """A navigation filter gives no state before it is aligned."""
    state = unknown()
    keeper = StickStabilizer(load_vehicle("bluerov2_heavy"), state, 0.02, REACH)
    assert keeper.wrench(np.zeros(6), 0.5, True) == pytest.approx(np.zeros(6))
    know(state, 3.0)
    assert keeper.wrench(np.zeros(6), 0.5, True) == pytest.approx(np.zeros(6), abs=1e-12)
    state.position[2] = 3.2
    assert keeper.wrench(np.zeros(6), 0.5, True)[2] < -1.0


def test_depth_hold_resumes_after_a_depth_outage():
    state = unknown()
    know(state, 3.0)
    keeper = StickStabilizer(load_vehicle("bluerov2_heavy"), state, 0.02, REACH)
    state.position[:] = np.nan
    for stick in (0.0, 0.5):
        assert keeper.wrench(np.array([0.0, 0.0, stick, 0.0, 0.0, 0.0]), 0.5, True)[2] == 0.0
    know(state, 3.5)
    keeper.wrench(np.zeros(6), 0.5, True)
    state.position[2] = 3.3
    assert keeper.wrench(np.zeros(6), 0.5, True)[2] > 1.0
