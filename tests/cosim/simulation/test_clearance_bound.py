"""`law.bound` on vehicles that are not the law's, which a goal behind a wall presses against a barrier."""

import json

import numpy as np
import pytest

from cosim import SceneFlyer
from cosim.campaigns.scenes.generator import generate_scenes
from cosim.campaigns.scenes.scenario_scene import ScenarioScene


def pressing_scene(seed):
    """Return a scene of a wrong model with a wall in front of the goal, or a slope through it, and gusts in half."""
    table = json.loads(next(generate_scenes(1, seed, "mismatch")))["scenario"]
    rng = np.random.default_rng([44, seed])
    normal = np.array([1.0, *rng.normal(0.0, 0.4, 2)])
    normal /= np.linalg.norm(normal)
    wall = {"type": "half_space", "point": [rng.uniform(2.5, 9.0), 0.0, 4.0], "normal": normal.tolist()}
    table["regions"] = [*table["regions"][-1:], {"name": "wall", "criterion": "obstacle", "hard": True, "keep": "in",
                                                 "gain": 100.0, "shape": wall}]  # fmt: skip
    table["time"]["duration"] = 40.0
    if rng.integers(2):
        spread = rng.uniform(0.1, 0.2)
        table["plant"]["parameters"] |= {f"current_variation.{axis}": spread for axis in "xy"}
        table["plant"]["parameters"]["current_correlation_time"] = rng.uniform(1.0, 4.0)
    return ScenarioScene(seed, "pressing", table)


@pytest.mark.parametrize("seeds", [range(3), pytest.param(range(3, 200), marks=pytest.mark.slow)], ids=["few", "many"])
@pytest.mark.medium
def test_bound_is_never_above_the_clearance_of_a_wrong_model(seeds):
    pressed, errors = 0, []
    with SceneFlyer("deployable") as flyer:
        for seed in seeds:
            score, rows = flyer.fly(pressing_scene(seed), trace=True)
            assert score.bound_excess <= 0.0 and score.bound_promised > 0.9, seed
            pressed += np.mean(rows["law.barriers"] > 0.0) > 0.2
            errors.append(np.nanpercentile(rows["law.acceleration_error"], 90))
    assert pressed > 0.6 * len(seeds) and max(errors) > 0.3
