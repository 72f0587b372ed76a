"""A rangefinder below the vehicle, against distances that geometry says."""

import math

import numpy as np
import pytest

from controller.quaternion import from_axis_angle
from cosim.scenario.scenario import load_scenario
from cosim.sitl.rangefinder import MAX_RANGE, Rangefinder

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
ROLLED = from_axis_angle(np.array([1.0, 0.0, 0.0]), math.radians(30.0))
UPSIDE_DOWN = from_axis_angle(np.array([1.0, 0.0, 0.0]), math.pi)


@pytest.mark.parametrize(("attitude", "distance"), [(LEVEL, 1.6), (ROLLED, 1.6 / math.cos(math.radians(30.0)))])
def test_without_a_bottom_the_beam_meets_the_depth_limit(attitude, distance):
    below = Rangefinder(load_scenario("pipe-inspection"))
    assert below.measure(np.array([0.0, 0.0, 3.0]), attitude, math.nan) == pytest.approx(distance, abs=2e-3)


def test_obstacle_in_the_beam_shortens_the_range():
    """The pipe's axis is in 4.6 m, its surface, with the vehicle's size, 0.6 m above."""
    below = Rangefinder(load_scenario("pipe-inspection"))
    assert below.measure(np.array([0.0, 3.75, 2.0]), LEVEL, math.nan) == pytest.approx(2.0, abs=2e-3)


def test_beam_measures_the_plants_bottom_as_in_ardupilot():
    below = Rangefinder(load_scenario("sitl"))
    assert below.measure(np.zeros(3), LEVEL, 27.0) == 27.0
    assert below.measure(np.zeros(3), ROLLED, 27.0) == pytest.approx(27.0 / math.cos(math.radians(30.0)))
    assert below.measure(np.zeros(3), UPSIDE_DOWN, 27.0) == MAX_RANGE


def test_empty_beam_reports_maximum_range_and_no_obstacle_no_rangefinder():
    """An ArduPilot keeps the last distance that it heard, so there must be another one."""
    below = Rangefinder(load_scenario("pipe-inspection"))
    assert below.measure(np.array([0.0, 0.0, 3.0]), UPSIDE_DOWN, math.nan) == MAX_RANGE
    assert not Rangefinder(load_scenario("pipe-inspection", ["regions=[]"])).is_fitted
