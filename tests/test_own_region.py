"""The page on regions of one's own, followed to the letter in a copy of the packages: its shape flies."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "howto" / "own-region.md").read_text()

VISIBILITY = "from controller.regions.visibility"
EDITS = {  # the rows of the page's table that make a shape fly
    "orientation.py": [("kind: ClassVar[int] = 9", "kind: ClassVar[int] = 10")],
    "visibility.py": [("kind: ClassVar[int] = 10", "kind: ClassVar[int] = 11")],
    "kinds.py": [
        (VISIBILITY, f"from controller.regions.torus import torus\n{VISIBILITY}"),
        ("    return cone(p, q)", "    if kind == 8:\n        return cone(p, q)\n    return torus(p, q)"),
    ],
    "region_set.py": [
        (VISIBILITY, f"from controller.regions.torus import Torus\n{VISIBILITY}"),
        ('    "cone": Cone,', '    "cone": Cone,\n    "torus": Torus,'),
    ],
}  # fmt: skip

SCENARIO = """
vehicle = "odin"

[time]
duration = 30.0
step = 0.01

[initial]
position = [0.0, 0.0, 2.0]

[goal]
type = "sphere"
centre = [4.0, 0.0, 2.0]
radius = 0.5

[law]
name = "pd"

[[regions]]
name = "ring"
criterion = "obstacle"
keep = "out"
gain = 100.0
shape = { type = "torus", centre = [2.0, 0.3, 2.0], axis = [1.0, 0.0, 0.0], radius = 1.0, tube = 0.2 }
"""

FLY = """
from pathlib import Path
import numpy as np
from controller import FunctionLaw
from cosim.precheck.precheck import check_scenario
from cosim.results.record import load_record
from cosim.run.run import run_scenario
from cosim.scenario.scenario import load_scenario

def steer(state, goal, regions, weights):
    # level all the while, so that the axes of the body are those of the world
    force = -20.0 * np.clip(goal.gradients[0], -1.0, 1.0) - 100.0 * weights[0] * regions.gradients[0]
    return np.concatenate([force - 60.0 * state.velocity_body[:3], np.zeros(3)])

scenario = load_scenario("ring.toml")
run = run_scenario(scenario, Path("run"), report=False, law=FunctionLaw(steer))
record = load_record(run.folder)
p = record.stack([f"position.{axis}" for axis in "xyz"]) - [2.0, 0.3, 2.0]
apart = np.hypot(np.hypot(p[:, 1], p[:, 2]) - 1.0, p[:, 0]) - 0.2
np.testing.assert_allclose(record["ring.clearance"], apart, atol=1e-9)
through = np.interp(0.0, p[:, 0], np.hypot(p[:, 1], p[:, 2]))
print(run.summary["reached"], run.summary["min_clearance"]["ring"] > 0.0, through < 0.8, check_scenario(scenario).holds)
"""


@pytest.mark.slow
def test_the_torus_of_the_page_flies(tmp_path):
    for package in ("fuzzy_arbiter", "plant_fmu", "controller", "cosim"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "LICENSE", tmp_path)  # FMUs carry it
    regions = tmp_path / "controller" / "regions"
    (code,) = re.findall(r"<!-- file: torus\.py -->\n```python\n(.*?)```", PAGE, re.DOTALL)
    (regions / "torus.py").write_text(code)
    for name, changes in EDITS.items():
        text = (regions / name).read_text()
        assert name in PAGE
        for old, new in changes:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        (regions / name).write_text(text)
    (tmp_path / "ring.toml").write_text(SCENARIO)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", FLY], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["True", "True", "True", "True"]
