"""Scenes as points of a cube: uniform points give the generator's distribution within its family."""

import json

import numpy as np
import pytest
from scipy.stats import ks_2samp

from controller import LAWS
from cosim.campaigns.falsification.spaces import QuantileGenerator, SceneSpace
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.conflicts import CONFLICTS, make_conflict
from cosim.campaigns.scenes.generator import MAX_OBSTACLES, make_scene
from cosim.campaigns.scenes.scene_file import decode_scene


def scene_at(space, point, seed=0):
    return decode_scene(space.line(point, seed))


def features(scene):
    """Return numbers of a scene that its parameters decide."""
    start, goal = np.array(scene.start), np.array(scene.goal.centre)
    balls = scene.obstacles
    failed = scene.failed_thruster
    return {
        "start": start[2],
        **{f"goal {axis}": x for axis, x in zip("xyz", goal, strict=True)},
        "obstacles": len(balls),
        **{f"first {axis}": x for axis, x in zip("xyz", np.array(balls[0].centre), strict=True)},
        "last x": balls[-1].centre[0],
        "last y": balls[-1].centre[1],
        "radius": balls[0].radius,
        "drift": balls[0].velocity[0],
        "aside": balls[0].velocity[1],
        "current": np.hypot(*scene.current[:2]),
        "heading": np.arctan2(scene.current[1], scene.current[0]),
        "weight": scene.weight_minus_buoyancy,
        "righting": scene.righting_moment,
        "thruster": failed.index if failed else 0,
        "time": failed.time if failed else 0.0,
    }


@pytest.mark.parametrize("kind", MAX_OBSTACLES)
def test_no_point_leaves_the_family(kind):
    space, rng = SceneSpace(kind, 3.0), np.random.default_rng(2)
    corners = rng.integers(0, 2, (60, space.dimension)).astype(float)
    for i, point in enumerate([*corners, *rng.random((60, space.dimension))]):
        scene = scene_at(space, point, i)
        hard = kind == "hard"
        start, goal = np.array(scene.start), np.array(scene.goal.centre)
        assert 1.5 <= start[2] <= 4.0 and 8.0 <= goal[0] <= 12.0 and abs(goal[1]) <= 3.0 and 1.5 <= goal[2] <= 4.5
        assert (6 if hard else 1) <= len(scene.obstacles) <= (14 if hard else 6)
        for ball in scene.obstacles:
            assert 0.3 <= ball.radius <= 0.9
            assert np.linalg.norm(ball.centre - start) - ball.radius > 0.6
            assert np.linalg.norm(ball.centre - goal) - ball.radius - 0.5 > 0.6
            share = (ball.centre - start) @ (goal - start) / ((goal - start) @ (goal - start))
            aside = np.linalg.norm(ball.centre - start - np.clip(share, 0.2, 0.8) * (goal - start))
            assert aside <= 3.0 * np.linalg.norm([0.3, 0.6, 0.5]) + 1e-9
        assert np.linalg.norm(scene.current) <= (0.4 if hard else 0.25) * (1.0 + 1e-12)
        assert abs(scene.weight_minus_buoyancy) <= 15.0 and 10.0 <= scene.righting_moment <= 62.0
        assert not hard or (1 <= scene.failed_thruster.index <= 8 and 5.0 <= scene.failed_thruster.time <= 30.0)


def test_sampling_with_replacement_is_rejected():
    with pytest.raises(NotImplementedError):
        QuantileGenerator(np.empty(0), np.random.default_rng(0)).choice(3, 2, replace=True)


def test_redrawn_obstacle_leaves_others_unchanged():
    space, rng, changed = SceneSpace("hard"), np.random.default_rng(5), 0
    for point in rng.random((60, space.dimension)):
        other = point.copy()
        other[-6:-1] = 0.5  # numbers of the last obstacle
        other[-11:-6] = [1.0, 0.0, 0.5, 0.5, 0.5]  # of the one before: too near to the start
        one, two = (json.loads(space.line(p, 0))["obstacles"] for p in (point, other))
        assert one[:-2] == two[:-2]
        changed += one != two
    assert changed > 0


def test_sensing_noise_uses_the_scene_noise_seed():
    line = json.loads(SceneSpace("hard").line(np.full(SceneSpace("hard").dimension, 0.4), 3))
    sensing = scene_scenario(decode_scene(json.dumps(line).encode()), "pd", LAWS["pd"].gains_type(), Conditions())
    assert sensing.sensing.seed == int(0.4 * 2**31)
    del line["noise"]["seed"]
    sensing = scene_scenario(decode_scene(json.dumps(line).encode()), "pd", LAWS["pd"].gains_type(), Conditions())
    assert sensing.sensing.seed == 3


def test_near_points_are_near_scenes():
    space = SceneSpace("hard", 3.0)
    point = np.full(space.dimension, 0.45)
    here, there = features(scene_at(space, point)), features(scene_at(space, point + 1e-6))
    assert all(there[name] == pytest.approx(here[name], abs=1e-4) for name in here)
    assert here != there


def numbers(conflict):
    """Return numbers of a conflict that its parameters decide."""
    table = conflict["scenario"]
    return {
        "kind": sum(map(ord, conflict["kind"])),
        "order": table["criteria"][0]["order"],
        "goal": table["goal"]["center"][0],
        "regions": len(table["regions"]),
        "priority": max(region["priority"] for region in table["regions"]),
        "drift": table["regions"][0]["velocity"][2],
        "current": np.hypot(*table["plant"]["current"][:2]),
        "buoyancy": table["plant"]["parameters"]["buoyancy"],
        "start": table["initial"]["position"][2],
    }


@pytest.mark.medium
@pytest.mark.parametrize("family", [*MAX_OBSTACLES, *CONFLICTS])
def test_points_drawn_evenly_are_scenes_of_the_generator(family):
    space, rng = SceneSpace(family), np.random.default_rng(1)
    drawn = [json.loads(space.line(rng.random(space.dimension), i)) for i in range(700)]
    if family in CONFLICTS:
        samples = [numbers(scene) for scene in drawn], [numbers(make_conflict(i, family)) for i in range(700)]
    else:
        scenes = drawn, [make_scene(i, family) for i in range(700)]
        samples = [[features(decode_scene(json.dumps(scene).encode())) for scene in some] for some in scenes]
    for name in samples[0][0]:
        assert ks_2samp(*([one[name] for one in some] for some in samples)).pvalue > 1e-3, name


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("family", ["conflict", "hard", "plain", "tour"])
def test_scene_is_determined_by_its_point_and_valid(family):
    space, rng = SceneSpace(family), np.random.default_rng(3)
    corners = rng.integers(0, 2, (20, space.dimension)).astype(float)
    for i, point in enumerate([*corners, *rng.random((40, space.dimension))]):
        one, other = (json.loads(space.line(point, seed)) for seed in (i, i + 100))
        for scene in (one, other):
            scene.get("scenario", {}).pop("title", None)
        assert one["seed"] == i and one | {"seed": i + 100} == other
        assert family != "hard" or one["noise"]["seed"] == int(point[-1] * 2**31)
        assert scene_at(space, point, i).seed == i
        if family in CONFLICTS:  # the last coordinate is of chance alone
            other = json.loads(space.line(np.append(point[:-1], 1.0 - point[-1]), i))["scenario"]
            assert one["scenario"]["sensing"].pop("seed") != other["sensing"].pop("seed")
            del other["title"]
            assert one["scenario"] == other
