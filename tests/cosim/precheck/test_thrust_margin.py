"""Thrust in each direction, against values derived by hand from the ODIN-like vehicle."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller.force_limits import DIRECTIONS
from controller.restoring import parameters
from cosim.precheck.thrust_margin import NAMES, thrust_margin
from plant_fmu import load_vehicle

ODIN = load_vehicle("odin")
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
STILL = np.zeros(3)


def test_directions_have_names_of_their_own():
    named = dict(zip(NAMES, DIRECTIONS.tolist(), strict=True))
    assert len(named) == 26
    assert named["north"] == [1.0, 0.0, 0.0] and named["up"] == [0.0, 0.0, -1.0]
    assert named["south-east-down"] == pytest.approx(np.array([-1.0, 1.0, 1.0]) / math.sqrt(3.0))


def margin(current, weight=ODIN.weight, quaternion=LEVEL, vehicle=ODIN):
    phi = parameters(weight, vehicle.buoyancy, vehicle.r_G, vehicle.r_B)
    return thrust_margin(vehicle, phi, quaternion, np.array(current))


def test_margin_in_still_water_is_the_full_force():
    m = margin(STILL)
    assert m.drag == 0.0 and m.excess_weight == pytest.approx(-2.0)
    assert m.thrust.force == pytest.approx(54.0) == m.left.force  # 2 N of 108 N leave the horizontal as it is
    assert [left.force for left in m.left_without[:4]] == pytest.approx([27.0] * 4)
    assert [left.force for left in m.left_without[4:]] == pytest.approx([52.0] * 4)


def test_current_reduces_the_margin_by_its_drag():
    """48 N s2/m2 at 0.4 m/s from the south: 7.68 N, of which 1/sqrt(2) along the weak diagonal."""
    m = margin([0.4, 0.0, 0.0])
    assert m.drag == pytest.approx(7.68)
    assert m.hold == pytest.approx([-7.68, 0.0, 2.0, 0.0, 0.0, 0.0])
    assert m.left.direction.startswith("south-")
    assert m.left.force == pytest.approx(54.0 - 7.68 / math.sqrt(2.0))


def test_trim_is_held_as_the_drag_of_a_current_is():
    pulled = dataclasses.replace(ODIN, trim=np.array([7.68, 0.0, 0.0, 0.0, 0.0, 0.0]))
    m = margin(STILL, vehicle=pulled)
    assert m.drag == 0.0 and m.hold == pytest.approx([-7.68, 0.0, 2.0, 0.0, 0.0, 0.0])
    assert m.left.force == pytest.approx(margin([0.4, 0.0, 0.0]).left.force)


def test_weight_narrows_the_vertical():
    m = margin(STILL, weight=ODIN.buoyancy + 100.0)
    assert m.hold[2] == pytest.approx(-100.0)  # up
    assert m.left.direction == "up" and m.left.force == pytest.approx(8.0)
    assert m.left_without[4] is None


def test_excessive_current_has_no_margin():
    assert margin([2.0, 0.0, 0.0]).left is None


def test_munk_moment_is_included():
    """A long body in an oblique stream wants to turn across it."""
    rov = load_vehicle("bluerov2_heavy")
    m = margin([0.3, 0.3, 0.0], weight=rov.weight, vehicle=rov)
    surge, sway = rov.added_mass[0, 0], rov.added_mass[1, 1]
    # nu_r = (-0.3, -0.3): C_A nu_r turns by (Y_added - X_added) u v
    assert m.hold[5] == pytest.approx((sway - surge) * 0.3 * 0.3)


def test_attitude_turns_the_thrusters_with_it():
    turned = Rotation.from_euler("z", 45, degrees=True).as_quat(scalar_first=True)
    m = margin(STILL, quaternion=turned)
    assert m.thrust.direction in ("north", "east", "south", "west")
    assert m.thrust.force == pytest.approx(54.0)
