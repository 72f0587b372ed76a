"""The rows of a campaign of scenes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from cosim.campaigns.scenes.flyer import Score
from cosim.campaigns.store.columns import of_numbers, of_texts


class Row(NamedTuple):
    """Row of a scene; None for missing numbers."""

    seed: int
    reached: bool
    violation: bool
    min_clearance: float | None  # m
    bound_excess: float | None  # m
    weighted_violation: float | None  # m s
    reach_time: float | None  # s
    effort: float | None  # N s
    thrust_variation: float | None  # N
    worst_step_time: float | None  # s
    stopped_at: float | None  # s
    refused: str | None
    scene: str


_COLUMNS = (  # name, type, unit, description
    ("seed", pa.int64(), "", "Of the scene"),
    ("reached", pa.bool_(), "", "Inside the goal region for the last seconds that count as settled"),
    ("violation", pa.bool_(), "", "Beyond a region's surface at any instant, or the flight was not flown to its end"),
    ("min_clearance", pa.float64(), "m", "Least distance to any hard region's surface, negative where violated"),
    (
        "bound_excess",
        pa.float64(),
        "m",
        "Greatest excess of the law's last bound over a clearance; null: it has none",
    ),
    (
        "weighted_violation",
        pa.float64(),
        "m.s",
        "Integral of how deep each region is violated, times its priority, summed",
    ),
    ("reach_time", pa.float64(), "s", "Since when it was in the goal region without a break; null if not reached"),
    ("effort", pa.float64(), "N.s", "Integral of the magnitudes of the thrusters' given forces, summed"),
    ("thrust_variation", pa.float64(), "N", "Sum of the changes of the thrusters' commanded forces"),
    ("worst_step_time", pa.float64(), "s", "Wall-clock time of the longest call of law and allocation"),
    ("stopped_at", pa.float64(), "s", "When the FMU refused to go on, 0 for not at all; null if it never did"),
    ("refused", pa.string(), "", "Why the scene was not flown; null if it was"),
    ("scene", pa.string(), "", "The scene itself, as a line of JSON"),
)
_DTYPES = {pa.int64(): np.int64, pa.float64(): np.float64, pa.bool_(): np.bool_}
_MAY_BE_NULL = (pa.float64(), pa.string())
SCHEMA: Any = pa.schema(
    [
        pa.field(name, kind, nullable=kind in _MAY_BE_NULL, metadata={"unit": unit, "description": description})
        for name, kind, unit, description in _COLUMNS
    ]
)


def row_of(seed: int, score: Score, plant_step: float, scene: str = "") -> Row:
    """Make the row of a flight; plant_step [s]."""
    stopped = score.failed_step >= 0
    return Row(
        seed=seed,
        reached=bool(score.reached),
        violation=bool(stopped or not score.min_clearance >= 0.0),
        min_clearance=_number(score.min_clearance),
        bound_excess=_number(score.bound_excess),
        weighted_violation=_number(score.weighted_violation),
        reach_time=_number(score.reach_time) if score.reached else None,
        effort=_number(score.effort),
        thrust_variation=_number(score.thrust_variation),
        worst_step_time=_number(score.worst_step),
        stopped_at=score.failed_step * plant_step if stopped else None,
        refused=None,
        scene=scene,
    )


def refused_row(seed: int, reason: str, scene: str = "") -> Row:
    """Make the row of a scene that was not flown."""
    return Row(
        seed=seed, reached=False, violation=True, min_clearance=None, bound_excess=None, weighted_violation=None,
        reach_time=None, effort=None, thrust_variation=None, worst_step_time=None, stopped_at=0.0,
        refused=reason, scene=scene,
    )  # fmt: skip


def _number(x: float) -> float | None:
    return float(x) if math.isfinite(x) else None


def table_of(rows: Sequence[Row]) -> Any:
    """Convert rows to a table of `SCHEMA`."""
    columns = [_column(field.type, [row[i] for row in rows]) for i, field in enumerate(SCHEMA)]
    return pa.Table.from_arrays(columns, schema=SCHEMA)


def _column(kind: Any, values: list[Any]) -> Any:
    if kind == pa.string():
        return of_texts(values)
    absent = np.array([value is None for value in values], dtype=bool)
    return of_numbers(np.array([0 if value is None else value for value in values], _DTYPES[kind]), absent)
