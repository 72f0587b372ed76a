"""The shipped scenarios against independently computed figures, one active region at a time."""

import numpy as np
import pytest

from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

BOTH = pytest.mark.parametrize("engine", ["closed", pytest.param("skfuzzy", marks=pytest.mark.slow)])


@BOTH
def test_unlimited_paper_run_matches_reference_figures(shipped_run, engine):
    summary = shipped_run("paper", f"arbiter.engine={engine}").summary
    assert summary["max_force"] == pytest.approx(26.82e3, rel=0.01)
    assert summary["max_force_asked"] == summary["max_force"]
    ((entered, left),) = summary["intersection_windows"]
    assert entered == pytest.approx(0.186, abs=0.003)
    assert left == pytest.approx(0.234, abs=0.003)
    assert summary["max_speed"] == pytest.approx(15.15, rel=0.02)
    assert summary["min_clearance"]["SR1"] == pytest.approx(-0.258, abs=0.005)
    assert summary["min_clearance"]["SR2"] == pytest.approx(-0.395, abs=0.005)
    assert summary["reached"] and summary["settled"]
    assert summary["reach_time"] == pytest.approx(4.12, rel=0.02)
    assert summary["settle_time"] == pytest.approx(13.89, rel=0.02)
    assert summary["estimate_final"][0] == pytest.approx(-2.14, abs=0.05)
    assert summary["steps"] == 60_000
    assert summary["saturated_time"] == 0.0


@pytest.mark.parametrize("duration", [5, pytest.param(60, marks=pytest.mark.slow)])
def test_both_arbiter_engines_give_the_same_path(shipped_run, duration):
    """Their weights differ by at most the square of the grid's step over 2; the path hardly notices."""
    engines = ("closed", load_scenario("paper").arbiter.engine)
    runs = [shipped_run("paper", f"arbiter.engine={e}", f"time.duration={duration}") for e in engines]
    assert [run.summary["arbiter"] for run in runs] == ["closed", "skfuzzy"]
    closed, skfuzzy = (load_record(run.folder) for run in runs)
    names = [f"weight.{name}" for name in ("obstacle", "shape", "depth")]
    assert np.abs(closed.stack(names) - skfuzzy.stack(names)).max() < 1e-4
    path = [f"position.{axis}" for axis in "xyz"]
    assert np.abs(closed.stack(path) - skfuzzy.stack(path)).max() < 1e-6


@pytest.mark.slow
def test_paper_run_limited_to_108_newtons_matches_reference_figures(shipped_run):
    run = shipped_run("paper-limited", "arbiter.engine=closed")
    summary = run.summary
    assert summary["max_force"] == pytest.approx(108.0, rel=1e-9)
    ((entered, left),) = summary["intersection_windows"]
    assert entered == pytest.approx(2.713, abs=0.020)
    assert left == pytest.approx(3.286, abs=0.020)
    assert 0.5 + summary["min_clearance"]["SR1"] == pytest.approx(0.212, abs=0.005)
    assert 0.5 + summary["min_clearance"]["SR2"] == pytest.approx(0.137, abs=0.005)
    assert summary["max_speed"] == pytest.approx(1.644, rel=0.02)
    assert summary["estimate_lowest"][0] == pytest.approx(-69.6, abs=1.0)
    assert not summary["reached"] and summary["reach_time"] is None and summary["settle_time"] is None
    assert 0.5 + summary["closest_to_goal"] == pytest.approx(0.703, abs=0.005)
    assert summary["simulated_time"] == 120.0
    record = load_record(run.folder)
    assert record["estimate.phi1"][60_000] == pytest.approx(-61.6, abs=1.0)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("limit", "window", "speed"),
    [pytest.param(76.4, (3.24, 3.92), 1.4, marks=pytest.mark.slow), (100.0, (2.82, 3.42), 1.6)],
    ids=["76.4 N", "100 N"],
)
def test_other_force_limits_match_reference_figures(shipped_run, limit, window, speed):
    summary = shipped_run("paper-limited", "arbiter.engine=closed", "time.duration=20", f"limit.force={limit}").summary
    assert summary["intersection_windows"][0] == pytest.approx(window, abs=0.01)
    assert summary["max_speed"] == pytest.approx(speed, abs=0.06)
    assert not summary["reached"]


@pytest.mark.slow
def test_paper_calibrated_meets_the_papers_window(shipped_run):
    summary = shipped_run("paper-calibrated", "arbiter.engine=closed").summary
    ((entered, left),) = summary["intersection_windows"]
    assert entered == pytest.approx(2.65, abs=0.05)
    assert left == pytest.approx(2.95, abs=0.12)


@pytest.mark.medium
def test_a_run_repeats_to_the_last_bit(shipped_run, tmp_path):
    """The scenario file in a run folder is all that a run depends on."""
    first = shipped_run("paper-calibrated", "arbiter.engine=closed", "time.duration=5", "plant.current=[0.1,0.2,0.0]")
    again = run_scenario(load_scenario(first.folder / "scenario.toml"), tmp_path / "again", report=False)
    one, two = load_record(first.folder), load_record(again.folder)
    assert list(one.units) == list(two.units)
    for name in one.units:
        assert np.array_equal(one[name], two[name]), name


@pytest.mark.slow
def test_both_fmi_versions_give_the_same_run(shipped_run):
    short = ("arbiter.engine=closed", "time.duration=3")
    two, three = (load_record(shipped_run("paper-limited", *short, f"plant.fmi={v}").folder) for v in (2, 3))
    for name in three.units:
        assert np.array_equal(two[name], three[name]), name
