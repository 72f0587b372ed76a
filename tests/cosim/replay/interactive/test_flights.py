"""Flights in a page are those of `cosim run`, to the last bit: of the recorded scenario, and of what a reader saves."""

from pathlib import Path

import numpy as np
import pytest

from controller.laws.deployable.gains import DeployableGains
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.scene_file import read_scenes
from cosim.replay.view_columns import ViewColumns
from cosim.results.run_result import load_run
from cosim.results.wording import verdict
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]  # the first build compiles a C library too

HARD = Path(__file__).parents[3] / "data" / "scenes" / "hard.jsonl"
MOVED = {"goal.center.1": 0.05, "goal.center.2": 4.02, "regions.3.shape.center.0": 7.15}
WATER = {"plant.current.0": 0.05, "plant.current.1": -0.12, "plant.parameters.buoyancy": 127.3}
NOISE = {"sensing.position_noise": 0.02, "sensing.velocity_noise": 0.0}
GAINS = {"law.gains.speed": 0.7, "law.gains.barriers": 0.0}
FAILS = {"thruster": 3, "time": 4.31}

SCENES = {
    "docking": ("docking", ()),
    "a moving view": ("pipe-inspection", ("time.duration=20",)),
    "through sensors": ("harbour", ("time.duration=30",)),
    "exact, a wrench": ("paper-limited", ("arbiter.engine=closed", "time.duration=5")),
    "exact, allocated": (
        "paper",
        ("arbiter.engine=closed", "time.duration=5", "actuation.through=thrusters", "vehicle=bluerov2_heavy"),
    ),
    "goals in turn": (
        "docking",
        ("goal.then=[[6.0, -2.5, 3.0]]", "goal.stay=1", "time.duration=40", "plant.current=[0,0,0]"),
    ),
    "a current that varies": (
        "docking",
        ("plant.parameters.current_shear.x=0.02", "plant.parameters.current_variation.y=0.05",
         "plant.parameters.current_variation_period=0.7", "plant.parameters.seed=4", "time.duration=6"),
    ),
    "known failures": (
        "docking",
        ("report_failures=true", "failures=[{thruster = 2, time = 3.0}, {thruster = 5, time = 1.0, stuck = true}]",
         "time.duration=15", "sensing.dead_from=8", "sensing.dead_for=1"),
    ),
}  # fmt: skip


def flown_run(scenario, folder):
    return load_run(run_scenario(scenario, folder, report=False).folder)


def assert_same(flown, run):
    """Hold every signal of a flight against the record, to the last bit."""
    viewing = ViewColumns(run.scenario, run.record.columns)
    names = [run.record.columns[i].name for i in viewing.picked]
    picked = viewing.compute_rows(np.column_stack([run.record[name] for name in names]))
    recorded = dict(zip((column.name for column in viewing.columns), picked.T, strict=True))
    every = run.scenario.control_every
    assert len(flown.columns) > 30 and {"active", "rule.R1", "position.x", "estimate.phi1"} <= set(flown.columns)
    for name, column in flown.columns.items():
        expected = recorded[name][: run.scenario.steps : every]
        np.testing.assert_array_equal(column, expected, err_msg=name)


@pytest.fixture
def same_as_saved(fly, tmp_path):
    """Return a function that flies other numbers in the page of a run, and the scenario it saves, to the last bit."""

    def flown_and_saved(run, values, failure=None):
        flown = fly(run, values, failure)
        (tmp_path / "saved.toml").write_text(flown.toml)
        saved = flown_run(load_scenario(tmp_path / "saved.toml"), tmp_path / "saved")
        assert_same(flown, saved)
        return flown, saved

    return flown_and_saved


@pytest.mark.parametrize("scene", SCENES)
def test_page_simulation_equals_its_run_bit_for_bit(scene, fly, tmp_path):
    name, overrides = SCENES[scene]
    run = flown_run(load_scenario(name, overrides), tmp_path / "run")
    flown = fly(run)
    assert_same(flown, run)
    assert verdict(run.summary).startswith(flown.verdict.removesuffix(".").split(";")[0])


@pytest.mark.parametrize(
    ("values", "failure"), [(MOVED | WATER, None), (NOISE | GAINS, FAILS)], ids=["places and water", "noise and gains"]
)
def test_saved_scenario_reproduces_the_run_bit_for_bit(values, failure, same_as_saved, shipped_run):
    _, saved = same_as_saved(load_run(shipped_run("docking").folder), values, failure)
    assert "as a test has it" in saved.scenario.title


@pytest.mark.parametrize(
    ("goal", "then"),
    [("type='sphere', center=[7.1,0,4], radius=0.4", 0),
     ("type='cylinder', start=[7.1,0,3.6], end=[7.1,0.1,4.4], radius=0.4", 1)],
    ids=["a sphere", "a cylinder"],
)  # fmt: skip
def test_goals_in_turn_move_each_by_itself(goal, then, same_as_saved, tmp_path):
    places = f"{goal}, then=[[6.0,-2.5,3.0],[6.3,-2.9,3.2]], stay=0.5"
    changed = [f"goal={{{places}}}", "time.duration=40", "plant.current=[0,0,0]"]
    run = flown_run(load_scenario("docking", changed), tmp_path / "first")
    values = {f"goal.then.{then}.0": 5.87, "goal.then.0.2": 3.31}
    values |= {"goal.start.1": 0.125, "goal.end.1": 0.225} if then else {"goal.center.1": 0.13}
    _, saved = same_as_saved(run, values)
    assert saved.scenario.goal_then[then][0] == 5.87 and saved.record["goal.place"].max() >= 1


def test_moved_cylinder_and_saved_scenario_equal_their_run(fly, same_as_saved, tmp_path):
    run = flown_run(load_scenario("harbour", ["time.duration=12"]), tmp_path / "first")
    shape = run.scenario.table["regions"][2]["shape"]
    values = {
        f"regions.2.shape.{end}.{axis}": shape[end][axis] + by
        for end in ("start", "end")
        for axis, by in ((0, -1.2), (1, 0.4), (2, 0.5))
    }
    flown, _ = same_as_saved(run, values)
    assert (flown.columns["pile 1.clearance"] != fly(run).columns["pile 1.clearance"]).any()


def test_noise_can_be_added_to_an_exact_run(fly, tmp_path):
    run = flown_run(
        load_scenario("docking", ["sensing.position_noise=0", "sensing.velocity_noise=0", "time.duration=8"]),
        tmp_path / "exact",
    )
    flown = fly(run, {"sensing.position_noise": 0.01, "sensing.velocity_noise": 0.005})
    noisy = load_scenario("docking", ["time.duration=8"])
    assert_same(flown, flown_run(noisy, tmp_path / "noisy"))


def test_hard_scene_equals_its_scored_run(fly, tmp_path):
    scene = list(read_scenes(HARD))[1]
    run = flown_run(scene_scenario(scene, "deployable", DeployableGains(), Conditions(duration=20.0)), tmp_path / "run")
    assert_same(fly(run), run)


def test_value_rejected_by_the_plant_is_named(fly, shipped_run):
    run = load_run(shipped_run("docking").folder)
    refused = fly(run, {"plant.parameters.buoyancy": -5.0})
    assert "buoyancy" in refused
