"""The rows of a campaign, one a scene, and the Parquet files that hold them."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.errors import RunError
from cosim.scene_run import Score
from cosim.signals import Array


class Row(NamedTuple):
    """What a scene came to; None where there is no number."""

    seed: int
    reached: bool
    violation: bool
    min_clearance: float | None  # m
    reach_time: float | None  # s
    effort: float | None  # N s
    thrust_variation: float | None  # N
    worst_step_time: float | None  # s
    stopped_at: float | None  # s


_COLUMNS = (  # name, type, unit, description
    ("seed", pa.int64(), "", "Of the scene"),
    ("reached", pa.bool_(), "", "Inside the goal region for the last seconds that count as settled"),
    ("violation", pa.bool_(), "", "Beyond a region's surface at any instant, or the flight was not flown to its end"),
    ("min_clearance", pa.float64(), "m", "Least distance to any region's surface, negative where violated"),
    ("reach_time", pa.float64(), "s", "Since when it was in the goal region without a break; null if not reached"),
    ("effort", pa.float64(), "N.s", "Integral of the magnitudes of the thrusters' given forces, summed"),
    ("thrust_variation", pa.float64(), "N", "Sum of the changes of the thrusters' commanded forces"),
    ("worst_step_time", pa.float64(), "s", "Wall-clock time of the longest call of law and allocation"),
    ("stopped_at", pa.float64(), "s", "When the FMU refused to go on, 0 for not at all; null if it never did"),
)
SCHEMA: Any = pa.schema(
    [
        pa.field(name, kind, nullable=kind == pa.float64(), metadata={"unit": unit, "description": description})
        for name, kind, unit, description in _COLUMNS
    ]
)


def row_of(seed: int, score: Score, plant_step: float) -> Row:
    """Return the row of a flight.

    Parameters
    ----------
    seed : int
        Of the scene.
    score : Score
        What the flight came to.
    plant_step : float
        Length of a plant step [s].

    Returns
    -------
    Row
        A clearance that is no number, and a flight that stopped, count as violations: neither was seen to be safe.
    """
    stopped = score.failed_step >= 0
    return Row(
        seed=seed,
        reached=bool(score.reached),
        violation=bool(stopped or not score.min_clearance >= 0.0),
        min_clearance=_number(score.min_clearance),
        reach_time=_number(score.reach_time) if score.reached else None,
        effort=_number(score.effort),
        thrust_variation=_number(score.thrust_variation),
        worst_step_time=_number(score.worst_step),
        stopped_at=score.failed_step * plant_step if stopped else None,
    )


def refused_row(seed: int) -> Row:
    """Return the row of a scene that the plant refused before the flight."""
    return Row(seed, False, True, None, None, None, None, None, 0.0)


def _number(x: float) -> float | None:
    return float(x) if math.isfinite(x) else None


class Results:
    """The rows of a campaign as columns.

    Parameters
    ----------
    table : pyarrow.Table
        Of `SCHEMA`.

    Attributes
    ----------
    table : pyarrow.Table
        In order of seed.
    """

    def __init__(self, table: Any) -> None:
        self.table = table.sort_by("seed")

    def __len__(self) -> int:
        return int(self.table.num_rows)

    def __getitem__(self, name: str) -> Any:
        """Return a column, shape (scenes,), in order of seed; NaN where there is no number."""
        return self.table[name].to_numpy()

    def number(self, name: str, absent: float = np.nan) -> Array:
        """Return a column of numbers, shape (scenes,), with `absent` where there is none."""
        column: Array = self[name].astype(float)
        return np.where(np.isnan(column), absent, column)

    def write(self, path: Path) -> None:
        """Write them to a Parquet file, whole or not at all."""
        write_whole(path, self.table)


def table_of(rows: Sequence[Row]) -> Any:
    """Return rows as a table of `SCHEMA`."""
    return pa.Table.from_pylist([row._asdict() for row in rows], schema=SCHEMA)


def write_whole(path: Path, table: Any) -> None:
    """Write a table to a Parquet file, whole or not at all.

    Parameters
    ----------
    path : Path
        The file; what was there is replaced.
    table : pyarrow.Table
        Any.

    Raises
    ------
    OSError
        If it cannot be written; nothing is left then.
    """
    scratch = path.with_name(f".{path.name}-{os.getpid()}")
    try:
        pq.write_table(table, scratch, compression="zstd")
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


def read_results(path: Path) -> Results:
    """Read the results of a campaign.

    Parameters
    ----------
    path : Path
        A file that `Results.write` wrote.

    Returns
    -------
    Results
        In order of seed.

    Raises
    ------
    RunError
        If it cannot be read, or is of another kind.
    """
    try:
        return Results(pq.read_table(path, schema=SCHEMA))
    except (OSError, pa.ArrowException) as error:
        raise RunError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
