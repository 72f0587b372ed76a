"""Missions: places with headings, features and speeds, rings and polylines, against their geometry."""

import json
import re
import tomllib

import numpy as np
import pytest

from controller import LAWS, FunctionLaw
from controller.quaternion import rotation_matrix
from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.campaigns.campaign import run_campaign
from cosim.errors import ScenarioError
from cosim.precheck.precheck import check_scenario
from cosim.replay.events import events_of
from cosim.results.record import load_record
from cosim.results.run_result import load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.law_factory import with_custom_law
from cosim.scenario.scenario import load_scenario

AXIS, RADIUS, PACE = np.array([3.0, 0.0]), 1.5, 0.3
ORBIT = (
    "{type='orbit', center=[3.0, 0.0, 2.0], radius=1.5, rings=[0.0, 0.8], bearing=3.141592653589793, speed=0.3, "
    "tolerance=0.35}"
)
VIEW = (
    "{name='view', criterion='shape', keep='in', gain=1.0, hard=false, "
    "shape={type='visibility', feature=[3.0, 0.0, 2.0], camera_axis=[0.0, 1.0, 0.0], half_angle=0.5}}"
)
MISSION = [
    "vehicle=bluerov2_heavy", "law.name=deployable", "actuation.through=thrusters", "time.step=0.01",
    "time.control=0.02", "time.arbiter=0.02", "initial.position=[0.0, 0.0, 2.0]", "time.duration=110.0",
    f"regions=[{VIEW}]", "intersection=[]", "arbiter.engine=closed",
    "goal={type='sphere', center=[1.0, -1.0, 2.0], radius=0.4, stay=1.0, speed=0.25, heading=-1.4, then=["
    f"{ORBIT}, {{type='path', points=[[0.0, 0.0, 2.0], [0.0, 2.0, 2.0]], speed=0.4}}]}}",
]  # fmt: skip


def column(record, name, axes):
    return np.column_stack([record[f"{name}.{axis}"] for axis in axes])


def headings(record):
    R = np.array([rotation_matrix(e) for e in column(record, "quaternion", ["e0", "e1", "e2", "e3"])])
    return np.unwrap(np.arctan2(R[:, 1, 0], R[:, 0, 0]))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return run_scenario(load_scenario("paper", MISSION), tmp_path_factory.mktemp("mission") / "run", report=False)


@pytest.fixture(scope="module")
def record(run):
    return load_record(run.folder)


def test_goal_goes_round_the_axis_at_its_pace_while_the_vehicle_is_in_it(record):
    goal = column(record, "goal.shift", "xyz") + np.array([1.0, -1.0, 2.0])
    place, time = record["goal.place"], record["time"]
    inside = record["goal.clearance"] >= 0.0
    for ring, depth in ((1, 2.0), (2, 2.8)):
        on_ring = (place == ring) & (abs(goal[:, 2] - depth) < 1e-9)
        off = np.linalg.norm(goal[on_ring][:, :2] - AXIS, axis=1) - RADIUS
        # chords of a circle, at whose ends the goal goes on for a part of a step
        assert -RADIUS * (1.0 - np.cos(np.pi / 36)) - 1e-9 <= off.min() and off.max() < PACE * 0.01 * np.sin(np.pi / 18)
        angles = np.unwrap(np.arctan2(goal[on_ring][:, 1], goal[on_ring][:, 0] - AXIS[0]))
        assert angles[-1] - angles[0] == pytest.approx(2.0 * np.pi, abs=0.01)
        assert angles[0] == pytest.approx(np.pi if angles[0] > 0 else -np.pi, abs=0.01)  # clockwise from the south
    steps = np.linalg.norm(np.diff(goal[(place == 1) | (place == 2)], axis=0), axis=1)
    assert steps.max() < 2.0 * PACE * 0.01
    standing = np.flatnonzero((place == 1) & ~inside)[:-1]
    assert np.abs(np.diff(goal, axis=0)[standing]).max(initial=0.0) < PACE * 0.01  # waits for the vehicle
    assert (record["goal.clearance"][(place == 1) & inside] <= 0.35).all() and time[place == 3].size


def test_camera_faces_the_axis(record):
    """The camera looks to starboard: the bow is a quarter turn to port of the line of sight."""
    position, place = column(record, "position", "xy"), record["goal.place"]
    sight = np.arctan2(*(AXIS - position).T[::-1])
    off = (headings(record) + np.pi / 2 - sight + np.pi) % (2 * np.pi) - np.pi
    settled = (place == 2) & (record["time"] > record["time"][place == 2][0] + 10.0)
    assert settled.sum() > 1000 and abs(off[settled]).max() < 0.25
    feature = column(record, "view.shift", "xyz") + np.array([3.0, 0.0, 2.0])
    assert feature[place == 2][:, :2] == pytest.approx(np.tile(AXIS, ((place == 2).sum(), 1)), abs=1e-9)
    assert feature[place == 2][-1, 2] == pytest.approx(2.8, abs=1e-9)  # goes down the axis with the rings


def test_first_place_has_its_heading_and_speed(record):
    speed = np.linalg.norm(column(record, "velocity", "uvw"), axis=1)
    first = record["goal.place"] == 0
    assert speed[first].max() < 0.27
    assert headings(record)[first][-1] == pytest.approx(-1.4, abs=0.1)  # the view alone would leave -0.75
    assert abs(np.diff(headings(record)[first])).max() < 0.01 * 0.7  # the target turns at 0.4 rad/s


def test_arrivals_are_those_of_the_record(run, record):
    goals = run.summary["goals"]
    assert [*goals["arrivals"]] == [
        "place 1", "place 2 (ring 1)", "place 3 (ring 2)", "place 4 (rings done)", "place 5 (point 1)",
        "place 6 (point 2)",
    ]  # fmt: skip
    for i, (name, time) in enumerate(goals["arrivals"].items()):
        within = (record["goal.place"] == i) & (record["goal.clearance"] >= 0.0)
        assert time == record["time"][np.argmax(within)], name
    assert run.summary["reach_time"] == goals["arrivals"]["place 6 (point 2)"]
    texts = {event.text: event.time for event in events_of(load_run(run.folder), [])}
    assert texts["Reaches place 3 (ring 2) of the goal"] == goals["arrivals"]["place 3 (ring 2)"]


def test_fused_loop_has_the_same_bits_and_arrivals(run, record):
    scenario = load_scenario("paper", MISSION)
    with FusedFlyer(Variation(scenario, ["plant.current.0"])) as flyer:
        flown = flyer.fly(np.zeros((1, 1)), np.zeros(1, np.int64))
        _, trace = flyer.fly_one(scenario, trace=True)
    for name in ("position.x", "goal.shift.y", "goal.place", "quaternion.e3", "view.clearance"):
        np.testing.assert_array_equal(trace[name], record[name][:-1:2])
    assert flown.arrivals[0] == tuple(run.summary["goals"]["arrivals"].values())


def test_campaign_table_has_arrivals(tmp_path, run):
    table = tomllib.loads(load_scenario("paper", MISSION).toml(short=True))
    for key in ("law", "limit", "changed"):
        table.pop(key, None)
    scene = {"seed": 1, "kind": "mission", "scenario": table}
    (tmp_path / "scenes.jsonl").write_text(json.dumps(scene) + "\n")
    rows = run_campaign(tmp_path / "scenes.jsonl", "deployable", tmp_path / "out").results
    assert json.loads(rows["arrivals"][0])[:2] == pytest.approx(
        [*run.summary["goals"]["arrivals"].values()][:2], abs=2.0
    )


@pytest.mark.medium
@pytest.mark.parametrize("law", sorted(LAWS))
def test_every_law_takes_rings_and_headings(law, tmp_path):
    """Laws without speeds refuse these alone."""
    given = [change.replace("speed=0.25, ", "") for change in MISSION]
    changes = [f"law.name={law}", "time.duration=20"]
    run = run_scenario(load_scenario("paper", [*given, *changes]), tmp_path / "run", report=False)
    record = load_record(run.folder)
    assert np.isfinite(record["position.x"]).all()
    if not LAWS[law].takes_speed:
        with pytest.raises(ScenarioError, match=f"speeds for law {law}, expected none, or one of the laws"):
            load_scenario("paper", [*MISSION, *changes])


def test_law_of_ones_own_takes_places_alone():
    law = FunctionLaw(lambda state, goal, regions, weights: [0.0] * 6)
    with pytest.raises(ScenarioError, match=r"headings for law .*expected heading = 'kept'"):
        with_custom_law(law, load_scenario("pile-inspection"))
    kept = load_scenario("pile-inspection", ["goal.heading=kept", "goal.then.0.heading=kept"])
    assert with_custom_law(law, kept).mission.legs == kept.mission.legs


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("goal.then.0.radius=-1", "goal.then[0].radius is -1, expected above 0 m"),
        ("goal.then.0.speed=2", "goal.then[0].speed is 2 m/s, expected at most 0.88"),
        ("goal.then.0.turns=0", "goal.then[0].turns is 0.0, expected up to 20"),
        ("goal.then.0.rings=[]", "goal.then[0].rings is 0 numbers, expected 1"),
        ("goal.then.0.axis=[0,0,0]", "goal.then[0].axis"),
        ("goal.then.0.type=ring", "'place', 'orbit', 'path' (got 'ring')"),
        (
            "goal.then.0.points=[[0,0,1],[1,0,1]]",
            "goal.then[0].points is ((0.0, 0.0, 1.0), (1.0, 0.0, 1.0)), expected none",
        ),
        ("goal.then.0={type='path', points=[[0,0,1]]}", "goal.then[0].points is 1 points, expected 2"),
        ("goal.then.0={type='place'}", "goal.then[0].center is missing"),
        ("goal.then.0.heading=up", "goal.then[0].heading"),
        ("goal.then.0.stay=-1", "goal.then[0].stay is -1, expected 0 s"),
        ("goal.then.0.laps=3", "goal.then[0].laps: unknown key"),
        ("regions.view.velocity=[0.1,0,0]", "regions.view moves, expected one at rest"),
        ("commands.enabled=true", "commands.enabled is true, expected false beside goal.then"),
        ("goal={type='sphere', center=[0,0,2], radius=1, heading='feature'}", ""),
        (
            "goal={type='box', center=[0,0,2], size=[1,1,1], then=[{center=[1,0,2], tolerance=1}]}",
            "goal.then[0].tolerance",
        ),
    ],
)
def test_wrong_missions_are_refused_by_key(change, words):
    if not words:
        assert load_scenario("pile-inspection", [change]).mission.turns  # towards the region's feature
        with pytest.raises(ScenarioError, match=r"goal\.heading is 'feature', expected goal\.feature"):
            load_scenario("pile-inspection", [change, "regions=[]"])
    else:
        with pytest.raises(ScenarioError, match=re.escape(words)):
            load_scenario("pile-inspection", [change])


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ("goal.then.0.radius=1.0", None),
        ("goal.then.0.radius=0.7", "ways, pile"),
        ("goal.then.0.rings=[0.0, 8.0]", "ways, sea bed"),
        ("time.duration=60", "time"),
        ("goal.then.0={center=[8.0, 0.0, 4.0]}", "place 2"),
    ],
)
def test_check_looks_at_every_place_and_way(change, name):
    findings = check_scenario(load_scenario("pile-inspection", [change])).findings
    failing = [finding.name for finding in findings if finding.status == "fails"]
    assert failing == ([name] if name else [])
