"""The examples of a law and of a shape in the package run in a copy of the packages."""

import json
import re
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.copies import ROOT, copy_of_the_packages, python

pytestmark = pytest.mark.slow

SCENARIO = """
vehicle = "odin"

[time]
duration = 60.0
step = 0.01

[initial]
position = [0.0, 0.0, 2.0]

[goal]
type = "sphere"
center = [4.0, 0.0, 2.0]
radius = 0.5

[law]
name = "sliding_mode"

[[regions]]
name = "rock"
criterion = "obstacle"
keep = "out"
gain = 100.0
shape = { type = "sphere", center = [2.0, 0.2, 2.0], radius = 0.5 }
"""

FLY = """
from pathlib import Path
import numpy as np
from controller import FunctionLaw
from cosim.precheck.precheck import check_scenario
from cosim.results.record import load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

def steer(state, goal, regions, weights):
    # level all the while, so that the axes of the body are those of the world
    force = -20.0 * np.clip(goal.gradients[0], -1.0, 1.0) - 100.0 * weights[0] * regions.gradients[0]
    return np.concatenate([force - 60.0 * state.velocity_body[:3], np.zeros(3)])

scenario = load_scenario("ring.toml")
run = run_scenario(scenario, Path("through"), report=False, law=FunctionLaw(steer))
record = load_record(run.folder)
p = record.stack([f"position.{axis}" for axis in "xyz"]) - [2.0, 0.3, 2.0]
apart = np.hypot(np.hypot(p[:, 1], p[:, 2]) - 1.0, p[:, 0]) - 0.2
np.testing.assert_allclose(record["ring.clearance"], apart, atol=1e-9)
through = np.interp(0.0, p[:, 0], np.hypot(p[:, 1], p[:, 2]))
print(run.summary["reached"], run.summary["min_clearance"]["ring"] > 0.0, through < 0.8, check_scenario(scenario).holds)
"""

STRUCK = """
vehicle = "odin"

[time]
duration = 2.0
step = 0.02
control = 0.02
arbiter = 0.02

[plant]
fmi = 3

[master]
order = "gauss-seidel"

[arbiter]
engine = "closed"

[initial]
position = [0.0, 0.0, 2.0]

[goal]
type = "sphere"
center = [4.0, 0.0, 2.0]
radius = 0.5

[law]
name = "ismail_dunnigan"

[[regions]]
name = "ring"
criterion = "obstacle"
keep = "out"
gain = 10.0
shape = { type = "torus", center = [0.0, 1.0, 2.0], axis = [0.0, 0.0, 1.0], radius = 1.05, tube = 0.2 }
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the packages with the law, the shape, and scenarios of them."""
    folder = copy_of_the_packages(tmp_path_factory.mktemp("copy"))
    for example, package in (("laws/sliding_mode.py", "laws"), ("shapes/torus.py", "regions/shapes")):
        shutil.copy(ROOT / "examples" / example, folder / "controller" / package)
    (folder / "past.toml").write_text(SCENARIO)
    ring = 'type = "torus", center = [2.0, 0.3, 2.0], axis = [1.0, 0.0, 0.0], radius = 1.0, tube = 0.2'
    table = SCENARIO.replace("60.0", "30.0").replace('"sliding_mode"', '"pd"').replace('"rock"', '"ring"')
    (folder / "ring.toml").write_text(re.sub('type = "sphere", .*radius = 0.5', ring, table))
    (folder / "struck.toml").write_text(STRUCK)
    return folder


def cosim(copy, *words):
    return python(copy, "-m", "cosim", *words)


def test_documented_law_reaches_the_goal_past_an_obstacle(copy):
    done = cosim(copy, "run", "past.toml", "--no-report", "--out", "run")
    assert done.returncode == 0, done.stderr
    summary = json.loads((copy / "run" / "summary.json").read_text())
    record = pq.read_table(copy / "run" / "record.parquet")
    place = np.column_stack([record[f"position.{axis}"] for axis in "xyz"])
    assert summary["law"] == "sliding_mode"
    assert np.linalg.norm(place[-1] - [4.0, 0.0, 2.0]) < 0.5
    assert np.linalg.norm(place - [2.0, 0.2, 2.0], axis=1).min() > 0.5


def test_custom_law_is_compared_over_scenes(copy):
    scenes = cosim(copy, "scenes", "--count", "4", "--seed", "3", "--out", "scenes.jsonl")
    assert scenes.returncode == 0, scenes.stderr
    words = ["scenes.jsonl", "--laws", "sliding_mode,pd", "--replays", "0", "--out", "side"]
    done = cosim(copy, "compare", *words)
    assert done.returncode == 0, done.stderr
    assert (copy / "side" / "sliding_mode" / "results.parquet").exists()


def test_custom_law_is_exported_as_a_system_of_fmus(copy):
    done = cosim(copy, "export", "past.toml", "--set", "arbiter.engine=closed", "--to", "ssp", "--out", "past.ssp")
    assert done.returncode == 0 and (copy / "past.ssp").exists(), done.stderr


def test_documented_torus_region_is_avoided(copy):
    done = python(copy, "-c", FLY)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["True", "True", "True", "True"]


def test_report_replay_exports_and_check_draw_the_torus(copy):
    for command in (
        ["run", "struck.toml", "--out", "struck"],
        ["report", "--replay", "struck", "--out", "struck.html"],
        ["export", "struck", "--to", "mcap", "--out", "struck.mcap"],
        ["export", "struck", "--to", "rrd", "--out", "struck.rrd"],
    ):
        done = cosim(copy, *command)
        assert done.returncode == 0, (command, done.stderr)
    page = (copy / "struck.html").read_text()
    assert '"kind":"torus"' in page and '"drawing":{"points":' in page
    checked = cosim(copy, "check", "struck.toml")
    assert "Traceback" not in checked.stderr, checked.stderr


def test_torus_is_packaged_and_swept(copy):
    done = cosim(copy, "export", "struck.toml", "--to", "ssp", "--out", "struck.ssp")
    assert done.returncode == 0, done.stderr
    vary = ["--vary", "initial.position.1=-0.05,0,-1", "--design", "grid", "--out", "swept", "--replays", "0"]
    done = cosim(copy, "sweep", "struck.toml", *vary)
    assert done.returncode == 0, done.stderr
    rows = pq.read_table(copy / "swept" / "results.parquet").to_pylist()
    assert [row["violated"] for row in rows] == [True, True, False]
