"""The score of the deployable law over held-out scenes, compared with the baseline laws."""

import msgspec
import numpy as np
import pytest

from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.flyer import SceneFlyer
from cosim.campaigns.scenes.generator import generate_scenes
from cosim.campaigns.scenes.scene import Scene

BASELINES = ["pd", "sun_cheah", "unarbitrated", "antonelli", "pid_cbf"]
QUICKER = ["pid_cbf"]  # on plain scenes, and less thrifty


def scores(law, first, count, hard=False, reported=False, vehicle=None):
    with SceneFlyer(law, Conditions(report_failures=reported)) as flyer:
        scenes = generate_scenes(count, first, "hard" if hard else "plain", vehicle)
        return [flyer.fly(msgspec.json.decode(line, type=Scene))[0] for line in scenes]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hard", "reported"), [(False, False), (True, False), (True, True)], ids=["plain", "hard", "reported"]
)
def test_every_goal_is_reached_without_violation(hard, reported):
    flown = scores("deployable", 70_000, 40, hard, reported)
    assert min(score.min_clearance for score in flown) > 0.0
    assert all(score.reached and score.failed_step < 0 for score in flown)


@pytest.mark.medium
@pytest.mark.parametrize(
    ("hard", "count"),
    [(True, 5), *(pytest.param(hard, 100, marks=pytest.mark.slow) for hard in (False, True))],
)
def test_six_thruster_vehicle_reaches_every_goal_without_violation(hard, count):
    """Righting moments down to a sixth of the file's; hard scenes lose a thruster, which may leave roll as well."""
    flown = scores("deployable", 72_000, count, hard, vehicle="bluerov2")
    assert min(score.min_clearance for score in flown) > 0.0
    assert all(score.reached and score.bound_excess <= 0.0 for score in flown)


@pytest.mark.slow
def test_deployable_law_is_no_costlier_or_slower_than_baselines_with_one_exception():
    """Medians over the plain scenes that the baseline reaches without violation."""
    ours = scores("deployable", 71_000, 30)
    for law in BASELINES:
        pairs = [
            (b, o) for b, o in zip(scores(law, 71_000, 30), ours, strict=True) if b.reached and b.min_clearance > 0.0
        ]
        assert len(pairs) > 15, law
        for what in ("reach_time", "effort"):
            theirs, own = (np.median([getattr(score, what) for score in side]) for side in zip(*pairs, strict=True))
            assert own <= theirs or (law in QUICKER and what == "reach_time"), (law, what)
