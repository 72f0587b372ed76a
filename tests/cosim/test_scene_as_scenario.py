"""A scored scene, said as a scenario: the readable master goes where the compiled loop goes."""

import numpy as np
import pytest
import tomli_w

from cosim.master import Master
from cosim.scenario import load_scenario
from cosim.scene import Ball, Failure, Noise, Obstacle, Scene, plant_values
from cosim.scene_run import Conditions, SceneFlyer
from plant_fmu.vehicle import load_vehicle
from tests.cosim.test_master import Keep

SCENE = Scene(
    seed=42,
    start=(0.0, 0.0, 2.0),
    goal=Ball((4.0, 0.5, 2.5), 0.5),
    obstacles=(Obstacle((2.0, 0.1, 2.2), 0.5, (-0.05, 0.05, 0.0)), Obstacle((2.2, 1.4, 2.4), 0.4)),
    depth_band=(0.3, 7.0),
    current=(0.1, -0.2, 0.0),
    weight_minus_buoyancy=6.0,
    righting_moment=40.0,
    noise=Noise(0.02, 0.01),
    failed_thruster=Failure(3, 3.0),
)


def as_scenario(scene, law, duration, tell):
    """Return the table of a scenario that says what a scene says, with the periods of the score."""
    values = plant_values(scene, load_vehicle("odin"), 0.01)
    own = ("substep", "current", "position")
    regions = [
        {"name": f"obstacle {i}", "criterion": "obstacle", "keep": "out", "gain": 1.0, "velocity": list(o.velocity),
         "shape": {"type": "sphere", "centre": list(o.centre), "radius": o.radius}}
        for i, o in enumerate(scene.obstacles)
    ]  # fmt: skip
    shallow, deep = scene.depth_band
    band = {"type": "depth_band", "depth": (shallow + deep) / 2, "tolerance": (deep - shallow) / 2}
    regions.append({"name": "band", "criterion": "depth", "keep": "in", "gain": 1.0, "shape": band})
    return {
        "vehicle": "odin",
        "time": {"duration": duration, "step": 0.01, "control": 0.02, "arbiter": 0.02},
        "plant": {"current": list(scene.current), "substep": 0.01,
                  "parameters": {k: v for k, v in values.items() if k.partition(".")[0] not in own}},
        "initial": {"position": list(scene.start)},
        "goal": {"type": "sphere", "centre": list(scene.goal.centre), "radius": scene.goal.radius},
        "law": {"name": law},
        "actuation": {"through": "thrusters"},
        "sensing": {"seed": scene.seed, "position_noise": scene.noise.position, "velocity_noise": scene.noise.velocity},
        "failures": [{"thruster": scene.failed_thruster.index, "time": scene.failed_thruster.time}],
        "tell_failures": tell,
        "regions": regions,
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("law", "tell"), [("deployable", False), ("deployable", True), ("printed", False)])
def test_master_and_compiled_loop_fly_the_same_way(tmp_path, law, tell):
    duration = 12.0
    file = tmp_path / "scene.toml"
    file.write_text(tomli_w.dumps(as_scenario(SCENE, law, duration, tell)))
    with Master(load_scenario(file)) as master:
        kept = Keep(master)
        master.run([kept])
    with SceneFlyer(law, Conditions(duration=duration, tell_failures=tell)) as flyer:
        score, trace = flyer.fly(SCENE, trace=True)
    path = np.column_stack([kept[f"position.{a}"] for a in "xyz"])
    told = np.column_stack([kept[f"sensed.{a}"] for a in "xyz"])
    thrusts = np.column_stack([kept[f"thrust[{i + 1}]"] for i in range(8)])
    assert np.ptp(path, axis=0)[0] > 1.0
    assert trace[:, 1:4] == pytest.approx(path[:-1:2], abs=1e-9)
    assert trace[:, 14:17] == pytest.approx(told[:-1:2], abs=1e-9)
    assert trace[:, 20:28] == pytest.approx(thrusts[:-1:2], abs=1e-6)
    clearances = np.column_stack([kept[f"{r.region.name}.clearance"] for r in master.scenario.regions])
    assert score.min_clearance == pytest.approx(clearances[1:].min(), abs=1e-9)
