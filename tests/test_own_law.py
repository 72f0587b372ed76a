"""The example of a law in the package flies in a copy of the packages."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.copies import ROOT, copy_of_the_packages, python

LAW = (ROOT / "examples" / "laws" / "sliding_mode.py").read_text()

SCENARIO = """
vehicle = "odin"

[time]
duration = 60.0
step = 0.01

[initial]
position = [0.0, 0.0, 2.0]

[goal]
type = "sphere"
centre = [4.0, 0.0, 2.0]
radius = 0.5

[law]
name = "sliding_mode"

[[regions]]
name = "rock"
criterion = "obstacle"
keep = "out"
gain = 100.0
shape = { type = "sphere", centre = [2.0, 0.2, 2.0], radius = 0.5 }
"""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the packages with the law."""
    folder = copy_of_the_packages(tmp_path_factory.mktemp("copy"))
    (folder / "controller" / "laws" / "sliding_mode.py").write_text(LAW)
    return folder


def cosim(copy, *words):
    return python(copy, "-m", "cosim", *words)


def test_documented_law_reaches_the_goal_past_an_obstacle(copy):
    (copy / "past.toml").write_text(SCENARIO)
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


def test_law_without_c_code_is_rejected_by_name(copy):
    done = cosim(copy, "export", "paper", "--set", "law.name=sliding_mode", "--to", "ssp", "--out", "x.ssp")
    assert done.returncode == 2, done.stdout + done.stderr
    assert "sliding_mode" in done.stderr and done.stderr.count("\n") == 1
