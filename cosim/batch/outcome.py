"""Outcome of a flight as one row of numbers, which are defined as in the summary of a recorded run."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

# type, unit and description of each field
FIELDS: dict[str, tuple[type, str, str]] = {
    "reached": (np.bool_, "", "Was inside the goal region at some step"),
    "reach_time": (np.float64, "s", "When it first was; none: never"),
    "settled": (np.bool_, "", "Was inside for the last ten seconds"),
    "settle_time": (np.float64, "s", "When it came in for the last time; none: never"),
    "violated": (np.bool_, "", "Violated a hard region at some step"),
    "min_clearance": (np.float64, "m", "Least clearance of any hard region of place; inf: there is none"),
    "weighted_violation": (
        np.float64,
        "m.s",
        "Integral of how deep each region is violated, times its priority, summed",
    ),
    "closest_to_goal": (np.float64, "m", "Least distance to the goal region, below 0 inside"),
    "effort": (np.float64, "N.s", "Integral of the magnitude of the force on the body"),
    "max_force": (np.float64, "N", "Greatest force on the body"),
    "max_speed": (np.float64, "m/s", "Greatest speed over ground"),
    "final_x": (np.float64, "m", "Position at the end, north"),
    "final_y": (np.float64, "m", "Position at the end, east"),
    "final_z": (np.float64, "m", "Position at the end, down"),
    "phi1": (np.float64, "N", "Estimate of phi 1 in (12) at the end"),
    "phi2": (np.float64, "N.m", "Estimate of phi 2 in (12) at the end"),
    "phi3": (np.float64, "N.m", "Estimate of phi 3 in (12) at the end"),
    "phi4": (np.float64, "N.m", "Estimate of phi 4 in (12) at the end"),
    "stopped_at": (np.float64, "s", "When the plant refused to go on; none: it did not"),
}

OUTCOME = np.dtype([(name, kind) for name, (kind, _, _) in FIELDS.items()])

Arrivals = tuple[float | None, ...]
Outcomes = NDArray[Any]  # items of type OUTCOME


@dataclass(frozen=True)
class BatchResult:
    """Outcomes of a batch of flights."""

    outcomes: Outcomes  # (rows,); false and NaN in refused rows
    refused: dict[int, str] = field(default_factory=dict)  # reason of scenario or plant, by row in the batch
    # s, first time within the goal at each of its places, by row; None: never
    arrivals: dict[int, Arrivals] = field(default_factory=dict)


def arrivals_of(times: NDArray[np.float64]) -> Arrivals:
    """Return arrival times [s], with None for NaN."""
    return tuple(None if math.isnan(time) else time for time in times.tolist())


def arrivals_text(arrivals: Arrivals) -> str | None:
    """Format arrival times [s] for a table as JSON, null for never; None for a goal with one place."""
    return json.dumps(arrivals) if len(arrivals) > 1 else None


def empty_outcomes(rows: int) -> Outcomes:
    """Make empty outcomes: false and NaN; returns (rows,)."""
    outcomes = np.zeros(rows, OUTCOME)
    for name, (kind, _, _) in FIELDS.items():
        if kind is np.float64:
            outcomes[name] = np.nan
    return outcomes
