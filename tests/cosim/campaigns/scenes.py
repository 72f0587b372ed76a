"""Scenes for the tests of campaigns."""

import json
from pathlib import Path

from cosim.scene_run import Conditions

DATA = Path(__file__).parents[2] / "data" / "scenes"
PLAIN = [json.loads(line) for line in (DATA / "plain.jsonl").read_text().splitlines()]
HARD = [json.loads(line) for line in (DATA / "hard.jsonl").read_text().splitlines()]
BRIEF = Conditions(duration=0.4)


def many(n):
    """Return `n` scenes, each with a seed of its own, hardly in order."""
    return [PLAIN[i % len(PLAIN)] | {"seed": 1000 + (i * 7) % n} for i in range(n)]


def write(path, scenes):
    """Write a file of scenes, and return its path."""
    path.write_text("".join(json.dumps(scene) + "\n" for scene in scenes))
    return path


def rows(results):
    """Return rows without what the wall clock says."""
    return [{k: v for k, v in row.items() if k != "worst_step_time"} for row in results.table.to_pylist()]
