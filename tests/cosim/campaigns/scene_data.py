"""Scenes for the tests of campaigns."""

import json
from pathlib import Path

from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.rows import SCHEMA, table_of
from cosim.campaigns.store.parts import write_tables
from cosim.campaigns.store.results import Results
from cosim.campaigns.workers import batch_sizing

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
    """Return rows without wall-clock columns."""
    return [{k: v for k, v in row.items() if k != "worst_step_time"} for row in results.table.to_pylist()]


def results_of(path, rows):
    """Write rows to a file, and return them as results."""
    write_tables(path, [table_of(rows)], SCHEMA)
    return Results(path, SCHEMA)


def batches_of(monkeypatch, n):
    """Make every batch hold `n` rows, independent of their duration."""
    for name, value in {"FIRST": n, "GREATEST": n, "TARGET": 1e9, "LEAST": 1e9}.items():
        monkeypatch.setattr(batch_sizing, name, value)
