"""A scored scene as a scenario: the reference master gives the same run as the compiled loop."""

import numpy as np
import pytest

from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.scene import Failure, Noise, Obstacle, Scene, SphereSpec
from cosim.scenario.tables import Outage
from tests.cosim.simulation.keep import kept_rows

SCENE = Scene(
    seed=42,
    start=(0.0, 0.0, 2.0),
    goal=SphereSpec((4.0, 0.5, 2.5), 0.5),
    obstacles=(Obstacle((2.0, 0.1, 2.2), 0.5, (-0.05, 0.05, 0.0)), Obstacle((2.2, 1.4, 2.4), 0.4)),
    depth_band=(0.3, 7.0),
    current=(0.1, -0.2, 0.0),
    weight_minus_buoyancy=6.0,
    righting_moment=40.0,
    noise=Noise(0.02, 0.01),
    failed_thruster=Failure(3, 2.995),
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "changes"),
    [
        ("deployable", {}),
        ("deployable", {"report_failures": True}),
        ("deployable", {"sensing": "sensors", "outages": (Outage("dvl", 2.0, 3.0),)}),
        ("ismail_dunnigan", {}),
    ],
)
def test_master_and_compiled_loop_give_the_same_run(law, changes):
    conditions = Conditions(duration=12.0, **changes)
    with SceneFlyer(law, conditions) as flyer:
        score, trace = flyer.fly(SCENE, trace=True)
        scenario = scene_scenario(SCENE, law, flyer.gains, conditions)
    kept = kept_rows(scenario)
    path = np.column_stack([kept[f"position.{a}"] for a in "xyz"])
    told = np.column_stack([kept[f"sensed.{a}"] for a in "xyz"])
    thrusts = np.column_stack([kept[f"thrust[{i + 1}]"] for i in range(8)])
    assert np.ptp(path, axis=0)[0] > 1.0
    assert trace[:, 1:4] == pytest.approx(path[:-1:2], abs=1e-9)
    assert trace[:, 14:17] == pytest.approx(told[:-1:2], abs=1e-9, nan_ok=True)
    assert trace[:, 20:28] == pytest.approx(thrusts[:-1:2], abs=1e-6)
    clearances = np.column_stack([kept[f"{r.region.name}.clearance"] for r in scenario.regions])
    assert score.min_clearance == pytest.approx(clearances[1:].min(), abs=1e-9)
