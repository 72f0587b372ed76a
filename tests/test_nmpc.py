"""The predictive controller of the benchmarks with a stub planner: its inputs and their timing."""

import contextlib
import json

import msgspec
import numpy as np
import pytest

from benchmarks import nmpc
from benchmarks.__main__ import main
from controller import LAWS
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.generator import make_scene
from cosim.campaigns.scenes.scene import Scene


class Planner:
    """Pulls down with every vertical thruster, and keeps what it was given."""

    def __init__(self):
        self.given = []

    def exchange(self, line):
        self.given.append(json.loads(line))
        return {"forces": [0.0] * 4 + [-3.0] * 4, "success": len(self.given) % 2 == 0, "seconds": 0.001}


@pytest.fixture
def flown(monkeypatch):
    """A hard scene of 2 s, and the planner that flew it."""
    planner = Planner()
    monkeypatch.setitem(LAWS, "nmpc", nmpc.NmpcLaw)
    monkeypatch.setattr(nmpc.NmpcLaw.function, "process", planner)
    monkeypatch.setattr(nmpc.NmpcLaw.function, "failures", 0)
    nmpc.NmpcLaw.function.times.clear()
    scene = msgspec.convert(make_scene(7, "hard"), Scene)
    with SceneFlyer("nmpc", Conditions(duration=2.0)) as flyer:
        score, _ = flyer.fly(scene)
    return scene, planner, score


@pytest.mark.medium
def test_planner_receives_law_inputs_at_10_hz(flown):
    scene, planner, _ = flown
    assert len(planner.given) == 20 and len(nmpc.NmpcLaw.function.times) == 20
    assert [given["again"] for given in planner.given] == [True] + [False] * 19
    first, last = planner.given[0], planner.given[-1]
    assert first["goal"] == pytest.approx(scene.goal.centre) and first["band"] == pytest.approx(scene.depth_band)
    for given, time in ((first, 0.0), (last, 1.9)):
        for ball, obstacle in zip(given["spheres"], scene.obstacles, strict=True):
            assert ball[:3] == pytest.approx(np.array(obstacle.centre) + time * np.array(obstacle.velocity))
            assert ball[3:] == pytest.approx([obstacle.radius, *obstacle.velocity])
    assert first["position"] == pytest.approx(scene.start, abs=0.1)
    assert not {"weight_minus_buoyancy", "current", "failed_thruster"} & set(first)
    assert nmpc.NmpcLaw.function.failures == 10


@pytest.mark.medium
def test_planned_forces_are_held_until_the_next_plan(flown):
    _, _, score = flown
    assert score.effort == pytest.approx(4 * 3.0 * 2.0)
    assert score.thrust_variation == pytest.approx(4 * 3.0)


@pytest.mark.medium
def test_observer_estimates_the_vertical_force(monkeypatch, flown):
    scene, planner, _ = flown
    mass = 187.5
    disturbance = planner.given[-1]["disturbance"][2] * mass
    assert disturbance == pytest.approx(scene.weight_minus_buoyancy, abs=0.25 * abs(scene.weight_minus_buoyancy) + 1.0)


def test_the_search_ranks_by_safety_then_reached_then_time(monkeypatch):
    times = {(8.0, 0.05): (9.0, -0.01), (8.0, 0.1): (12.0, 0.1)}

    def fly(gains, kind, seed, count):
        time, clearance = times.get((gains.stages, gains.margin), (11.0 if gains.interval == 0.3 else 11.5, 0.1))
        return [nmpc.Score(True, time, clearance, 1.0, 1.0, 0.0, -1)] * count

    monkeypatch.setattr(nmpc, "fly", fly)
    monkeypatch.setattr(nmpc, "planner", lambda gains, environment: contextlib.nullcontext())
    found = nmpc.search(None)
    assert (found.stages, found.interval) == (12.0, 0.3)


def test_unknown_kind_is_rejected(capsys):
    with pytest.raises(SystemExit):
        main(["nmpc", "conflict"])
    assert "'conflict'" in capsys.readouterr().err
