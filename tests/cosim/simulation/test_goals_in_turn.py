"""Successive goals: when they advance, when they count as reached, and the fused loop bit for bit."""

import re

import numpy as np
import pytest

from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.errors import ScenarioError
from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from plant_fmu import load_vehicle

PLACES = [(0.0, 0.0, 2.0), (2.0, 1.0, 2.5), (0.0, 0.0, 2.0)]
TOUR = [
    "vehicle=bluerov2_heavy", "law.name=deployable", "actuation.through=thrusters", "regions=[]", "time.step=0.01",
    "time.control=0.02", "time.arbiter=0.02", "initial.position=[-1.5, 0.0, 2.0]", "time.duration=40.0",
    "goal={type='sphere', center=[0.0, 0.0, 2.0], radius=0.4, then=[[2.0, 1.0, 2.5], [0.0, 0.0, 2.0]], stay=2.0}",
    "sensing.position_noise=0.02", "sensing.velocity_noise=0.01", "intersection=[]",
]  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return run_scenario(load_scenario("paper", TOUR), tmp_path_factory.mktemp("tour") / "run", report=False)


@pytest.mark.medium
def test_goal_advances_after_the_stay_time(run):
    record = load_record(run.folder)
    place = np.rint(record["goal.place"]).astype(int)
    position = np.column_stack([record[f"position.{axis}"] for axis in "xyz"])
    inside = 0.4 - np.linalg.norm(position - np.array(PLACES)[place], axis=1)
    assert record["goal.clearance"] == pytest.approx(inside, abs=1e-9)
    for k in range(1, len(place)):
        stayed = k > 200 and place[k - 201] == place[k - 1] and inside[k - 201 : k].min() >= 0.0
        assert place[k] - place[k - 1] == (stayed and place[k - 1] < 2)
    assert place[-1] == 2


def test_only_the_last_goal_counts_as_reached(run):
    record = load_record(run.folder)
    within = (record["goal.place"] == 2.0) & (record["goal.clearance"] >= 0.0)
    assert run.summary["reached"] and run.summary["reach_time"] == record["time"][np.argmax(within)]
    assert run.summary["closest_to_goal"] == -record["goal.clearance"][record["goal.place"] == 2.0].max()


def test_fused_loop_equals_the_master(run):
    for duration in (40.0, 6.0):  # 6 s end at the second place
        scenario = load_scenario("paper", [*TOUR, f"time.duration={duration}", "arbiter.engine=closed"])
        with FusedFlyer(Variation(scenario, [])) as flyer:
            outcome, trace = flyer.fly_one(scenario, trace=True)
        if duration == 40.0:
            record = load_record(run.folder)
            for column in [*(f"position.{axis}" for axis in "xyz"), "goal.clearance", "goal.place"]:
                np.testing.assert_array_equal(trace[column], record[column][:-1:2])
            for name in ("reached", "reach_time", "settled", "settle_time", "closest_to_goal"):
                assert outcome[name] == run.summary[name]
        else:
            assert not outcome["reached"] and np.isnan(outcome["closest_to_goal"])


@pytest.mark.medium
@pytest.mark.parametrize("net_weight", [-50.0, 0.0, 50.0])
def test_soft_region_does_not_block_a_goal_inside_it(net_weight):
    """The top of the goal is 0.6 m deep in a soft region, whose push there is more than what brings the vehicle on."""
    shape = "{type='half_space', point=[0.0, 0.0, 3.3], normal=[0.0, 0.0, 1.0]}"
    changes = [
        "goal={type='sphere', center=[2.0, 0.0, 4.8], radius=0.9}",
        f"regions=[{{name='greatest', criterion='depth', keep='in', hard=false, gain=100.0, shape={shape}}}]",
        f"plant.parameters.buoyancy={load_vehicle('bluerov2_heavy').weight - net_weight}",
        "arbiter.engine=closed",
    ]
    scenario = load_scenario("paper", [*TOUR, *changes])
    with FusedFlyer(Variation(scenario, [])) as flyer:
        outcome, _ = flyer.fly_one(scenario)
    assert outcome["settled"] and 0.0 <= -outcome["closest_to_goal"] < 0.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("goal.stay=-1.0", "goal.stay is -1.0, expected 0 s"),
        ("goal.then=[[0.0, 0.0, inf]]", "goal.then[0][2]"),
        ("goal.velocity=[0.1, 0.0, 0.0]", "goal.velocity"),
        ("goal.streamed=true", "goal.streamed is true"),
        ("commands.enabled=true", "commands.enabled is true"),
    ],
)
def test_incompatible_keys_are_rejected_by_name(change, words):
    with pytest.raises(ScenarioError, match=re.escape(words)):
        load_scenario("paper", [*TOUR, change])
