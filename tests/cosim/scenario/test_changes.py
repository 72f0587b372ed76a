"""Titles list the changes made since they were written."""

import dataclasses
import re

import numpy as np
import pytest

from controller import FunctionLaw
from cosim.batch.variation import Variation
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.rerun import repeat_of
from cosim.precheck.output import check_text
from cosim.precheck.precheck import check_scenario
from cosim.replay.header import header_of
from cosim.replay.pages import joint_title
from cosim.results.run_result import load_run
from cosim.run.run_folder import report_again
from cosim.run.run_scenario import run_scenario
from cosim.scenario.law_factory import with_custom_law
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios
from cosim.sitl.sitl_session import scenario_to_fly
from tests.cosim.campaigns.fake import design, fakes
from tests.cosim.replay.decoding import read_page

__all__ = ["fakes"]

LIMITED = "The paper's scenario, paper's law, body force limited to 108 N"
FORCE = f"{LIMITED} (changed: limit.force = 500 N)"


def saved(path, text):
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", list_scenarios())
def test_shipped_scenarios_have_unchanged_titles(name):
    scenario = load_scenario(name)
    assert scenario.title == scenario.table["title"] and scenario.table["changed"] == ()


def test_the_numbers_of_shipped_titles_are_those_of_their_scenarios():
    of = {name: load_scenario(name) for name in list_scenarios()}
    assert "108 N" in of["paper-limited"].title and of["paper-limited"].limit.force == 108.0
    assert "no limit" in of["paper"].title and of["paper"].limit.force == np.inf
    assert "8 N too heavy" in of["depth-transit"].title
    assert of["depth-transit"].true_restoring_parameters[0] == pytest.approx(8.0, abs=0.1)
    assert "twenty-four rocks" in of["dense-field"].title
    assert sum(r.criterion == "obstacle" for r in of["dense-field"].regions) == 24
    assert "two drifting buoys" in of["moving-obstacle"].title
    assert sum(r.moves for r in of["moving-obstacle"].regions) == 2 and any(of["moving-obstacle"].goal_velocity)
    stating = {name for name, scenario in of.items() if re.search(r"\d|twenty|two|no limit", scenario.title)}
    assert stating == {"paper-limited", "paper", "depth-transit", "dense-field", "moving-obstacle"}, "all are asked"


@pytest.mark.parametrize(
    ("overrides", "added"),
    [
        (["limit.force=108"], ""),
        (["arbiter.points=101"], ""),
        (["limit.force=500"], " (changed: limit.force = 500 N)"),
        (["limit.force=500", "limit.force=108.0"], ""),
        (["regions.1.gain=7"], " (changed: regions.SR2.gain = 7)"),
        (["initial.position.1=2"], " (changed: initial.position.1 = 2 m)"),
        (["initial.position=[1,2,3]"], " (changed: initial.position = (1, 2, 3) m)"),
        (["regions.SR1.shape.center.0=3"], " (changed: regions.SR1.shape.center.0 = 3 m)"),
        (['goal={type="box",center=[8,0,5],size=[1,1,1]}'], " (changed: goal)"),
        (["intersection=[]", "regions=[]"], " (changed: regions = none)"),
        (["vehicle=rexrov"], " (changed: vehicle = rexrov)"),
        (["report_failures=true"], " (changed: report_failures = true)"),
        (["plant.parameters.weight=1230"], " (changed: plant.parameters.weight = 1230 N)"),
        (["plant.parameters.r_B.z=0.5"], " (changed: plant.parameters.r_B.z = 0.5 m)"),
        (["law.name=pd"], " (changed: law.name = pd)"),
        (["law.name=pd", "law.gains.limit=50"], " (changed: law.name = pd, law.gains.limit = 50 N)"),
        (["commands.enabled=true", "sensing.seed=3", "record.lyapunov=false", "compare=''"], ""),
        (
            ["limit.force=1", "limit.time_constant=2", "arbiter.ramp=3", "plant.substep=0.001", "time.duration=5"],
            " (changed: arbiter.ramp = 3 m, limit.force = 1 N, limit.time_constant = 2 s and 2 more)",
        ),
    ],
)
def test_overrides_are_listed_in_the_title(overrides, added):
    assert load_scenario("paper-limited", overrides).title == LIMITED + added


def test_overridden_title_lists_no_changes(tmp_path):
    both = ["limit.force=500", 'title="Limited to 500 N"']
    assert load_scenario("paper-limited", both).title == "Limited to 500 N"
    changed = saved(tmp_path / "changed.toml", load_scenario("paper-limited", ["limit.force=500"]).toml())
    assert load_scenario(changed, ['title="Limited to 500 N"']).title == "Limited to 500 N"
    own = saved(tmp_path / "own.toml", 'base = "changed.toml"\ntitle = "My own"\narbiter = { ramp = 1.0 }\n')
    assert load_scenario(own).title == "My own"


def test_inherited_title_lists_overridden_keys(tmp_path):
    one = saved(tmp_path / "one.toml", 'base = "paper-limited"\nlimit = { force = 500.0 }\n')
    two = saved(tmp_path / "two.toml", 'base = "one.toml"\n[arbiter]\nramp = 0.5\n')
    assert load_scenario(one).title == FORCE
    told = f"{LIMITED} (changed: arbiter.ramp = 0.5 m, limit.force = 500 N"
    assert load_scenario(two).title == f"{told})"
    assert load_scenario(two, ["time.duration=1"]).title == f"{told}, time.duration = 1 s)"
    assert load_scenario(two, ["limit.force=108"]).title == f"{LIMITED} (changed: arbiter.ramp = 0.5 m)"


def test_title_lists_settings_that_complete_a_partial_scenario(tmp_path):
    half = saved(tmp_path / "half.toml", 'title = "Half"\nvehicle = "odin"\ntime = { duration = 2.0 }\n')
    rest = ["initial.position=[0,0,1]", 'goal={type="sphere",center=[3,0,2],radius=0.5}']
    assert load_scenario(half, rest).title == "Half (changed: initial, goal)"


def test_written_scenario_keeps_and_extends_its_listed_changes(tmp_path):
    changed = load_scenario("paper-limited", ["limit.force=500"])
    file = saved(tmp_path / "mine.toml", changed.toml())
    assert load_scenario(file).title == FORCE and load_scenario(file).toml() == changed.toml()
    assert load_scenario(file, ["arbiter.ramp=0.5"]).title == f"{FORCE[:-1]}, arbiter.ramp = 0.5 m)"
    gone = saved(tmp_path / "gone.toml", load_scenario("paper-limited", ["regions.SR3.gain=1"]).toml())
    overrides = ["regions=[]", "intersection=[]"]
    assert load_scenario(gone, overrides).title == f"{LIMITED} (changed: regions.SR3.gain, regions = none)"


def test_unprintable_changes_are_rejected(tmp_path):
    from cosim.errors import ScenarioError

    file = saved(
        tmp_path / "mine.toml", load_scenario("paper").toml().replace("changed = []", 'changed = ["\\u001b[2J"]')
    )
    with pytest.raises(ScenarioError, match=r"changed is .* printable"):
        load_scenario(file)


@pytest.mark.slow
def test_report_pages_show_the_changed_title(tmp_path):
    scenario = load_scenario("paper-limited", ["limit.force=500", "time.duration=0.05", "arbiter.engine=closed"])
    folder = run_scenario(scenario, tmp_path / "run").folder
    assert "limit.force = 500 N" in scenario.title
    for _ in range(2):
        assert f"<h1>{scenario.title}</h1>".replace("'", "&#39;") in (folder / "report.html").read_text()
        reader, [(header, _)] = read_page((folder / "replay.html").read_text())
        assert reader.title == header["title"] == scenario.title
        report_again(folder)
    run = load_run(folder)
    assert run.planned.title == run.scenario.title == scenario.title
    assert header_of(scenario, ())["title"] == scenario.title
    assert check_text(check_scenario(scenario)).startswith(scenario.title)
    assert load_scenario(folder / "scenario.toml").title == scenario.title


def test_sweep_row_titles_list_varied_keys(tmp_path, fakes):
    base = load_scenario("paper-limited", ["arbiter.ramp=0.5"])
    made = Variation(base, ["limit.force", "law.gains.k_p1"]).scenario([1 / 3, 18.8], 7)
    assert made.title == f"{LIMITED} (changed: arbiter.ramp = 0.5 m, limit.force = 0.333333 N)"
    run_sweep(base, design(3, vary=["limit.force=50:500"]), tmp_path / "out")
    repeated = repeat_of(tmp_path / "out", 1).scenario
    assert repeated.title.startswith(f"{LIMITED} (changed: arbiter.ramp = 0.5 m, limit.force = ")


def test_title_names_an_external_law():
    def rest(*_):
        return np.zeros(6)

    own = with_custom_law(FunctionLaw(rest), load_scenario("paper-limited", ["limit.force=500"]))
    assert own.title == f"{LIMITED} (flown by {own.law.name}; changed: limit.force = 500 N)"
    assert (
        scenario_to_fly("sitl", [], None, 400, "ardupilot").title == "Open water for an autopilot (flown by ardupilot)"
    )
    heavy = scenario_to_fly("sitl", ["time.duration=60"], "bluerov2_heavy_wu", 400, "ardupilot").title
    assert heavy.endswith("(flown by ardupilot; changed: vehicle = bluerov2_heavy_wu, time.duration = 60 s)")


def test_page_of_several_runs_shows_each_title_once():
    assert joint_title({"a": "One", "b": "One"}) == "One: a, b"
    assert joint_title({"a": "One", "b": "Two", "c": "One"}) == "One: a, c; Two: b"


def test_title_names_the_law_of_the_summary():
    scenario = load_scenario("paper")
    autopilot = dataclasses.replace(scenario, law=dataclasses.replace(scenario.law, name="px4"))
    assert autopilot.title == f"{scenario.title} (flown by px4)"
