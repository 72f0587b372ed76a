"""Scenes for the tests of campaigns."""

import json
from pathlib import Path

import pyarrow.parquet as pq

from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.scene_rows import SCHEMA, table_of
from cosim.campaigns.store.results import Results
from cosim.campaigns.workers import dispatch

DATA = Path(__file__).parents[2] / "data" / "scenes"
PLAIN, HARD = ([json.loads(line) for line in (DATA / f"{k}.jsonl").read_text().splitlines()] for k in ("plain", "hard"))
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
    pq.write_table(table_of(rows), path)
    return Results(path, SCHEMA)


def batches_of(monkeypatch, n):
    """Make every batch hold `n` rows, independent of their duration."""
    for name, value in {"FIRST": n, "MAX_ROWS": n, "TARGET": 1e9, "MIN_TIME": 1e9}.items():
        monkeypatch.setattr(dispatch, name, value)


def interrupt_after(patch, tables, error=KeyboardInterrupt):
    """Raise an error instead of storing more than a number of tables."""
    from cosim.campaigns.store.row_log import RowLog

    add, left = RowLog.add, [tables]

    def counting(log, table):
        if not left[0]:
            raise error
        left[0] -= 1
        add(log, table)

    patch.setattr(RowLog, "add", counting)
