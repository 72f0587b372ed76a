"""Scenes: parsed by line, rejected by line and key, and passed to the law without undisclosed conditions."""

import hashlib
import itertools
import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from controller import LAWS, IsmailDunniganLaw
from controller.regions.region_set import PackedRegions
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.generator import MAKERS, generate_scenes
from cosim.campaigns.scenes.scene import Failure, plant_parameters
from cosim.campaigns.scenes.scene_file import SceneStore, read_scenes
from cosim.errors import ScenarioError
from plant_fmu import load_vehicle
from tests.refusals import refusals

SCENES = Path(__file__).parents[3] / "data" / "scenes"
LINE = json.loads((SCENES / "hard.jsonl").read_text().splitlines()[0])
SCENE = next(read_scenes(SCENES / "hard.jsonl"))


def test_a_line_is_read_whole():
    assert SCENE.seed == LINE["seed"] and list(SCENE.start) == LINE["start"]
    assert list(SCENE.goal.centre) == LINE["goal"]["centre"] and SCENE.goal.radius == LINE["goal"]["radius"]
    assert [(list(o.centre), o.radius, list(o.velocity)) for o in SCENE.obstacles] == [
        (o["centre"], o["radius"], o["velocity"]) for o in LINE["obstacles"]
    ]
    assert SCENE.failed_thruster == Failure(**LINE["failed_thruster"])
    assert (SCENE.noise.position, SCENE.noise.velocity) == (0.02, 0.01)


def test_blank_lines_are_skipped(tmp_path):
    file = tmp_path / "scenes.jsonl"
    file.write_text(f"\n{json.dumps(LINE)}\n  \n{json.dumps(LINE)}")
    assert list(read_scenes(file)) == [SCENE, SCENE]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        *refusals("scenes"),
        ("\xff", ["invalid"]),
        (f'{{"seed": {2**63}}}', ["expected 0 to 9223372036854775807"]),
        (f'{{"seed": {"9" * 500}}}', ["seed is 99"]),
    ],
)
def test_invalid_scene_line_is_rejected_by_key(tmp_path, text, words):
    """Keys are those of a valid scene but for the ones that are given."""
    file = tmp_path / "scenes.jsonl"
    bad = json.dumps(LINE | json.loads(text)) if text.startswith('{"') else text
    file.write_bytes(f"{json.dumps(LINE)}\n{bad}".encode("latin-1"))
    with pytest.raises(ScenarioError, match=r"scenes\.jsonl, line 2: ") as refused:
        list(read_scenes(file))
    message = str(refused.value)
    assert "\n" not in message and all(word in message for word in words)


@pytest.mark.parametrize("name", ["nowhere.jsonl", "."])
def test_unreadable_file_is_rejected(tmp_path, name):
    with pytest.raises(ScenarioError, match=r"No such file|directory"):
        list(read_scenes(tmp_path / name))


# ---- the text that campaigns store: their folders are known by its SHA-256 ----


def stored(path, lines):
    path.write_text("\n".join(lines))
    with SceneStore(path) as store:
        return b"".join(store.lines(store.seeds)), store.digest


@pytest.mark.parametrize("kind", MAKERS)
def test_stored_scene_is_the_line_without_spaces(kind, tmp_path):
    lines = list(generate_scenes(3, 5, kind))
    text, digest = stored(tmp_path / "scenes.jsonl", lines)
    assert text == b"".join(msgspec.json.encode(msgspec.json.decode(line)) + b"\n" for line in lines)
    assert digest == hashlib.sha256(text).hexdigest()


def _scenes_with_and_without_each_optional_key():
    noises = ({}, {"position": 0.1}, {"velocity": 0, "position": 0}, {"seed": None}, {"seed": 7, "velocity": 0.2})
    obstacles = ([], [{"radius": 1, "centre": [1, 2, 3]}], [{"velocity": [0, 0, 0], "centre": [1, 2, 3], "radius": 1}])
    failures = ({}, {"failed_thruster": None}, {"failed_thruster": {"time": 1, "index": 2}})
    goal = {"goal": {"radius": 0.5, "centre": [9, 0, 2]}, "weight_minus_buoyancy": 1, "righting_moment": 20}
    rest = {"start": [0, 0, 2.0], **goal, "depth_band": [0.3, 7], "current": [0, 0, 0]}
    tables = itertools.product([{}, *({"noise": noise} for noise in noises)], obstacles, failures)
    return [n | f | rest | {"obstacles": o, "seed": seed} for seed, (n, o, f) in enumerate(tables)]


STORED = {  # SHA-256 that commit 8838699d writes to campaign.json for the same lines
    "plain": (SCENES / "plain.jsonl", "48daca105dd5c2dc05ce176a4d7755d28615378811e37879cd6543cb55930384"),
    "hard": (SCENES / "hard.jsonl", "81291bcf97775a8bdd2f89e01e3a75ba931026bab92886feffda73d690a9978d"),
    "by hand": (None, "a873ec55858d6b48befb9466914534060aa83d3baa3933e5e1d444f7904363b2"),
}


@pytest.mark.parametrize(("file", "digest"), STORED.values(), ids=STORED)
def test_campaigns_know_the_scenes_of_earlier_folders(file, digest, tmp_path):
    lines = file.read_text().splitlines() if file else map(json.dumps, _scenes_with_and_without_each_optional_key())
    assert stored(tmp_path / "scenes.jsonl", lines)[1] == digest


def test_plant_parameters_match_the_scene():
    vehicle = load_vehicle("odin")
    values = plant_parameters(SCENE, vehicle)
    assert vehicle.weight - values["buoyancy"] == pytest.approx(SCENE.weight_minus_buoyancy)
    righting = vehicle.r_G[2] * vehicle.weight - values["r_B.z"] * values["buoyancy"]
    assert righting == pytest.approx(SCENE.righting_moment)
    assert not {"weight", "mass", "r_G.z"} & values.keys()  # those of the vehicle's file
    assert [values[f"thrust_time_constant[{i}]"] for i in range(1, 9)] == [0.0] * 8


# ---- what the law knows ----

UNTOLD = {
    "current": {"current": (0.3, -0.2, 0.1)},
    "weight and buoyancy": {"weight_minus_buoyancy": -SCENE.weight_minus_buoyancy},
    "righting moment": {"righting_moment": 60.0},
    "which thruster fails": {"failed_thruster": Failure(7, 0.1)},
    "when it fails": {"failed_thruster": Failure(LINE["failed_thruster"]["index"], 0.0)},
    "that one fails": {"failed_thruster": None},
}
TOLD = {
    "start": {"start": (0.1, 0.0, 2.0)},
    "goal": {"goal": replace(SCENE.goal, radius=0.6)},
    "obstacles": {"obstacles": SCENE.obstacles[1:]},
    "depth band": {"depth_band": (0.4, 7.0)},
    "noise": {"noise": replace(SCENE.noise, position=0.03)},
}


class _Noting:
    """A step that Python runs: what is no plain function is not translated."""

    def __call__(self, *arguments):
        _Spy.steps.append(_frozen(arguments))
        IsmailDunniganLaw.function(*arguments)


class _Spy(IsmailDunniganLaw):
    """Notes all that it is made of, and all that it is given at each step."""

    name = "spy"
    made = ()
    steps = ()
    function = _Noting()

    @classmethod
    def for_vehicle(cls, *arguments):
        _Spy.made, _Spy.steps = _frozen(arguments), []
        return super().for_vehicle(*arguments)


def _frozen(value):
    """Return nested tuples and arrays as bytes, to be compared later to the last bit."""
    if isinstance(value, tuple):
        return tuple(_frozen(item) for item in value)
    return value.tobytes() if isinstance(value, np.ndarray) else value


@pytest.fixture
def spied(monkeypatch):
    """Return a function that runs a scene for half a second and returns the law's arguments and inputs."""
    monkeypatch.setitem(LAWS, "spy", _Spy)

    def fly(scene, reported=False):
        with SceneFlyer("spy", Conditions(duration=0.5, report_failures=reported)) as flyer:
            flyer.fly(scene)
        return _Spy.made, _Spy.steps

    return fly


@pytest.mark.medium(fast=4)
@pytest.mark.parametrize("change", UNTOLD.values(), ids=UNTOLD)
def test_undisclosed_conditions_affect_only_the_plant(spied, change):
    before, after = SCENE, replace(SCENE, **change)
    made, steps = spied(before)
    made_after, steps_after = spied(after)
    assert before != after
    assert made_after == made
    assert steps_after[0] == steps[0]
    for one, other in zip(steps, steps_after, strict=True):
        state, goal, regions, _weights, gains, _memory, _forces = one
        state_after, goal_after, regions_after, _, gains_after, _, _ = other
        assert (goal, regions, gains, state[3]) == (goal_after, regions_after, gains_after, state_after[3])


@pytest.mark.parametrize("change", TOLD.values(), ids=TOLD)
def test_disclosed_conditions_reach_the_law(spied, change):
    assert spied(replace(SCENE, **change)) != spied(SCENE)


def test_law_receives_failure_only_if_configured(spied):
    scene = replace(SCENE, failed_thruster=Failure(3, 0.2))
    healths = [np.frombuffer(step[0][3]) for step in spied(scene, reported=True)[1]]
    assert all((h == 1.0).all() for h in healths[:10])
    assert all(h.tolist() == [1, 1, 0, 1, 1, 1, 1, 1] for h in healths[10:])
    assert all((np.frombuffer(step[0][3]) == 1.0).all() for step in spied(scene)[1])


def test_law_receives_current_region_positions_and_velocities(spied):
    _, steps = spied(SCENE)
    shifts, velocities = (np.frombuffer(steps[20][2][i]).reshape(-1, 3) for i in (4, 5))
    np.testing.assert_allclose(shifts, 0.4 * velocities, rtol=1e-12)
    assert velocities[0].tolist() == LINE["obstacles"][0]["velocity"] and not velocities[1:].any()
    assert PackedRegions._fields[4:6] == ("shifts", "velocities")
