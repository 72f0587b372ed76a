"""The rows of a campaign of scenes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pyarrow as pa

from cosim.batch.outcome import arrivals_text
from cosim.campaigns.scenes.flyer import Score
from cosim.campaigns.store.results import ARRIVALS, make_schema, make_table

Row = dict[str, Any]  # values by column; a missing one is null
_INTEGER, _FLOAT, _BOOL, _TEXT = pa.int64(), pa.float64(), pa.bool_(), pa.string()
_COLUMNS = (  # name, type, unit, description
    ("seed", _INTEGER, "", "Of the scene"),
    ("reached", _BOOL, "", "Inside the goal region for the last seconds that count as settled"),
    ("violation", _BOOL, "", "Beyond a region's surface at any instant, or the flight was not flown to its end"),
    ("min_clearance", _FLOAT, "m", "Least distance to any hard region's surface, negative where violated"),
    ("bound_excess", _FLOAT, "m", "Greatest excess of the law's last bound over a clearance; null: it has none"),
    ("bound_promised", _FLOAT, "", "Fraction of the law's steps in which it gave a bound; null: it has none"),
    ("healthy_weakened", _BOOL, "", "A healthy thruster was isolated, or its limit lowered below half its true one"),
    ("weighted_violation", _FLOAT, "m.s", "Integral of how deep each region is violated, times its priority, summed"),
    ("reach_time", _FLOAT, "s", "Since when it was in the goal region without a break; null if not reached"),
    ("effort", _FLOAT, "N.s", "Integral of the magnitudes of the thrusters' given forces, summed"),
    ("thrust_variation", _FLOAT, "N", "Sum of the changes of the thrusters' commanded forces"),
    ("worst_step_time", _FLOAT, "s", "Wall-clock time of the longest call of law and allocation"),
    ("stopped_at", _FLOAT, "s", "When the FMU refused to go on, 0 for not at all; null if it never did"),
    ("refused", _TEXT, "", "Why the scene was not flown; null if it was"),
    ("scene", _TEXT, "", "The scene itself, as a line of JSON"),
    ARRIVALS[:4],
)
SCHEMA: Any = make_schema((*column, column[1] in (_FLOAT, _TEXT)) for column in _COLUMNS)


def row_of(seed: int, score: Score, plant_step: float, scene: str = "") -> Row:
    """Make the row of a flight; plant_step [s]."""
    row = score._asdict()
    failed_step, stopped = row.pop("failed_step"), score.failed_step >= 0
    row |= {
        "seed": seed,
        "reached": bool(score.reached),
        "violation": bool(stopped or not score.min_clearance >= 0.0),
        "reach_time": score.reach_time if score.reached else None,
        "worst_step_time": row.pop("worst_step"),
        "stopped_at": failed_step * plant_step if stopped else None,
        "scene": scene,
        "arrivals": arrivals_text(score.arrivals),
    }
    return {key: None if isinstance(x, float) and not math.isfinite(x) else x for key, x in row.items()}


def refused_row(seed: int, reason: str, scene: str = "") -> Row:
    """Make the row of a scene that was not flown."""
    row = {"seed": seed, "reached": False, "violation": True, "healthy_weakened": False}
    return row | {"stopped_at": 0.0, "refused": reason, "scene": scene}


def table_of(rows: Sequence[Row]) -> Any:
    """Convert rows to a table of `SCHEMA`."""
    return make_table(SCHEMA, ([row.get(name) for row in rows] for name in SCHEMA.names))
