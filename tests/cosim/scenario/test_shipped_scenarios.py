"""Shipped scenarios with the deployable law: goal reached and every hard region satisfied."""

import pytest

from cosim.results.record import load_record
from cosim.results.wording import verdict
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios

DEPLOYABLE = [name for name in list_scenarios() if load_scenario(name).law.name == "deployable"]
LONG = ("dense-field", "harbour", "paper-deployable")


def test_all_shipped_scenarios_but_those_of_other_laws_are_tested():
    assert {*list_scenarios()} - {*DEPLOYABLE} == {"paper", "paper-calibrated", "paper-limited", "sitl"}


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in DEPLOYABLE])
def test_goal_is_reached_and_every_hard_region_satisfied(tmp_path, name):
    """As shipped, but for the report: every plant step counts."""
    scenario = load_scenario(name)
    summary = run_scenario(scenario, tmp_path / "run", report=False).summary
    assert summary["settled"]
    assert summary["hard_violated"] == []
    assert min(summary["min_clearance"][region] for region in summary["hard"]) > 0.0
    said = verdict(summary)
    assert "and stayed" in said or "stayed inside" in said
    assert "kept every" in said
    # within the thrusters that there are
    limits = [abs(force) for thrust in (scenario.vehicle.thrust_min, scenario.vehicle.thrust_max) for force in thrust]
    assert summary["max_force"] <= sum(limits)


def test_view_region_is_active_in_the_shipped_scenario(tmp_path):
    """Were every angle allowed, the coupling would get out of the picture: keeping it is no matter of course."""
    shipped = load_scenario("pipe-inspection").regions[0].region.shape.half_angle
    free = load_scenario("pipe-inspection", ["regions.view.shape.half_angle=3.0", "time.duration=15.0"])
    least = run_scenario(free, tmp_path / "run", report=False).summary["min_clearance"]["view"]
    assert 3.0 - least > shipped + 0.1


def test_unreported_thruster_failure_is_detected(tmp_path):
    """It is found when it is used: at 9 s it pushes, at 10 s it is idle for a while."""
    scenario = load_scenario("dense-field", ["time.duration=12.0", "failures.0.time=9.0"])
    record = load_record(run_scenario(scenario, tmp_path / "run", report=False).folder)
    given_up = record["law.failed_thruster"]
    assert not given_up[record["time"] < 9.0].any()
    assert set(given_up[record["time"] > 10.5]) == {2.0}


def test_paper_scene_matches_the_paper():
    """Start, goal, regions and gains of the regions are the same; only law, periods and actuation differ."""
    paper, deployable = load_scenario("paper"), load_scenario("paper-deployable")
    for key in ("goal", "regions", "initial", "vehicle"):
        assert deployable.table[key] == paper.table[key], key
    assert deployable.actuation.through == "thrusters"
    assert [region.region.hard for region in deployable.regions] == [True, True, False]
