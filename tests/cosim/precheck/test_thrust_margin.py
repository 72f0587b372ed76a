"""Thrust in each direction, against values derived by hand from the ODIN-like vehicle."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller.restoring import parameters
from cosim.precheck.thrust_margin import DIRECTIONS, greatest_force, thrust_margin
from plant_fmu import load_vehicle

ODIN = load_vehicle("odin")
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
STILL = np.zeros(3)


def test_directions_are_26_unit_vectors_with_names_of_their_own():
    assert len(DIRECTIONS) == 26
    assert DIRECTIONS["north"] == (1.0, 0.0, 0.0) and DIRECTIONS["up"] == (0.0, 0.0, -1.0)
    assert DIRECTIONS["south-east-down"] == pytest.approx(np.array([-1.0, 1.0, 1.0]) / math.sqrt(3.0))


@pytest.mark.parametrize(
    ("direction", "load", "lost", "expected"),
    [  # four horizontal thrusters at 45 degrees, four vertical ones, of 27 N each
        ("north", 0.0, [], 4 * 27.0 / math.sqrt(2.0)),
        ("south-west", 0.0, [], 54.0),
        ("down", 0.0, [], 108.0),
        ("up", 0.0, [], 108.0),
        ("down", 0.0, [4], 54.0),  # a lost vertical thruster leaves half of the vertical force
        ("down", 100.0, [], 8.0),
        ("down", 108.1, [], None),
    ],
)
def test_greatest_force_matches_the_thruster_geometry(direction, load, lost, expected):
    alive = ~np.isin(np.arange(8), lost)
    force = greatest_force(ODIN, np.array(DIRECTIONS[direction]), np.array([0.0, 0.0, load, 0.0, 0.0, 0.0]), alive)
    assert force == (None if expected is None else pytest.approx(expected))


def margin(current, weight=ODIN.weight, quaternion=LEVEL, vehicle=ODIN):
    phi = parameters(weight, vehicle.buoyancy, vehicle.r_G, vehicle.r_B)
    return thrust_margin(vehicle, phi, quaternion, np.array(current))


@pytest.mark.medium
def test_margin_in_still_water_is_the_full_force():
    m = margin(STILL)
    assert m.drag == 0.0 and m.excess_weight == pytest.approx(-2.0)
    assert m.thrust.force == pytest.approx(54.0) == m.left.force  # 2 N of 108 N leave the horizontal as it is
    assert [left.force for left in m.left_without[:4]] == pytest.approx([27.0] * 4)
    assert [left.force for left in m.left_without[4:]] == pytest.approx([52.0] * 4)


@pytest.mark.medium
def test_current_reduces_the_margin_by_its_drag():
    """48 N s2/m2 at 0.4 m/s from the south: 7.68 N, of which 1/sqrt(2) along the weak diagonal."""
    m = margin([0.4, 0.0, 0.0])
    assert m.drag == pytest.approx(7.68)
    assert m.hold == pytest.approx([-7.68, 0.0, 2.0, 0.0, 0.0, 0.0])
    assert m.left.direction.startswith("south-")
    assert m.left.force == pytest.approx(54.0 - 7.68 / math.sqrt(2.0))


@pytest.mark.medium
def test_weight_narrows_the_vertical():
    m = margin(STILL, weight=ODIN.buoyancy + 100.0)
    assert m.hold[2] == pytest.approx(-100.0)  # up
    assert m.left.direction == "up" and m.left.force == pytest.approx(8.0)
    assert m.left_without[4] is None


def test_excessive_current_has_no_margin():
    assert margin([2.0, 0.0, 0.0]).left is None


@pytest.mark.medium
def test_munk_moment_is_included():
    """A long body in an oblique stream wants to turn across it."""
    rov = load_vehicle("bluerov2_heavy")
    m = margin([0.3, 0.3, 0.0], weight=rov.weight, vehicle=rov)
    surge, sway = rov.added_mass[0, 0], rov.added_mass[1, 1]
    # nu_r = (-0.3, -0.3): C_A nu_r turns by (Y_added - X_added) u v
    assert m.hold[5] == pytest.approx((sway - surge) * 0.3 * 0.3)


@pytest.mark.medium
def test_attitude_turns_the_thrusters_with_it():
    turned = Rotation.from_euler("z", 45, degrees=True).as_quat(scalar_first=True)
    m = margin(STILL, quaternion=turned)
    assert m.thrust.direction in ("north", "east", "south", "west")
    assert m.thrust.force == pytest.approx(54.0)
