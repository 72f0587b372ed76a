"""The calibration that `paper-calibrated` ships."""

import math

import pytest

from benchmarks.calibration import calibrate, window
from cosim.errors import ScenarioError
from cosim.scenario.scenario import load_scenario

PAPER = load_scenario("paper", ["arbiter.engine=closed"])


def test_window_of_a_known_calibration():
    """341 N and 2 s give 2.650 to 3.043 s [measured independently]."""
    assert window(PAPER, 341.0, 2.0) == pytest.approx((2.650, 3.043), abs=0.005)


def test_window_that_is_missed_is_nan():
    assert math.isnan(window(PAPER, 1.0, 2.0)[0])


def test_without_regions_there_is_nothing_to_fit():
    with pytest.raises(ScenarioError, match="intersection"):
        calibrate(load_scenario("paper", ["regions=[]", "intersection=[]"]))


def test_thrusters_have_no_limit_to_fit():
    with pytest.raises(ScenarioError, match="thrusters"):
        calibrate(load_scenario("paper", ["actuation.through=thrusters"]))


@pytest.mark.slow
def test_a_path_that_misses_the_overlap_has_no_fit(monkeypatch):
    monkeypatch.setattr("benchmarks.calibration._GRID", (4, 3))  # each of them misses it
    with pytest.raises(ScenarioError, match="overlap"):
        calibrate(load_scenario("paper", ["arbiter.engine=closed", "initial.position=[0,3,1]", "time.step=0.01",
                                          "time.control=0.01", "time.arbiter=0.01"]))  # fmt: skip


@pytest.mark.slow
def test_the_shipped_numbers_are_those_of_the_fit():
    coarse = [f"time.{key}=0.01" for key in ("step", "control", "arbiter")]  # finer steps move it by less than 0.1 N
    fit = calibrate(load_scenario("paper", ["arbiter.engine=closed", *coarse]))
    shipped = load_scenario("paper-calibrated").limit
    assert fit.force == pytest.approx(shipped.force, rel=2e-3)
    assert fit.time_constant == pytest.approx(shipped.time_constant, abs=1e-3)
    # no better fit in the neighborhood
    for force in (0.97, 1.03):
        entered, left = window(PAPER, force * fit.force, fit.time_constant)
        assert ((entered - 2.65) ** 2 + (left - 2.95) ** 2) / 2 > fit.cost
