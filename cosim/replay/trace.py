"""The trace of a run: what a page shows of it, taken from scenario, record and summary."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.record import Record
from cosim.replay.header import header_of
from cosim.replay.sampling import sampled_rows
from cosim.replay.viewing import Viewing
from cosim.report_words import verdict
from cosim.scenario import Scenario
from cosim.signals import Array


@dataclass(frozen=True)
class Trace:
    """What a page shows of a run."""

    header: dict[str, Any]
    rows: Array  # (n, columns), equal to the record to the last bit
    steps: NDArray[np.intp]  # (n,) where in the record they are

    def as_json(self) -> dict[str, Any]:
        """Return the header with the numbers packed into it.

        The numbers are float64, little-endian, one column behind the other; of these bytes first all the first ones,
        then all the second ones and so on, so that they deflate well; then raw deflate, and base64.

        Returns
        -------
        dict
            As JSON knows it.
        """
        numbers = np.ascontiguousarray(self.rows.T, dtype="<f8")
        planes = np.ascontiguousarray(numbers.view(np.uint8).reshape(-1, 8).T).tobytes()
        deflate = zlib.compressobj(6, zlib.DEFLATED, -zlib.MAX_WBITS)
        packed = deflate.compress(planes) + deflate.flush()
        return {**self.header, "rows": len(self.rows), "data": base64.b64encode(packed).decode()}


def trace_of(scenario: Scenario, record: Record, summary: dict[str, Any]) -> Trace:
    """Return what a page shows of a run.

    Parameters
    ----------
    scenario : Scenario
        What was run.
    record : Record
        What it left.
    summary : dict
        What it came to.

    Returns
    -------
    Trace
        Of few enough rows for a page.
    """
    viewing = Viewing(scenario, record.columns)
    names = [record.columns[i].name for i in viewing.picked]
    steps = sampled_rows(record["time"], len(viewing.columns), _telling(scenario, record))
    picked = np.column_stack([record[name][steps] for name in names])
    header = header_of(scenario, viewing.columns) | {
        "verdict": verdict(summary),
        "status": summary["status"],
        "summary": {key: summary[key] for key in ("min_clearance", "reach_time", "settle_time")},
    }
    return Trace(header, viewing.extended(picked), steps)


def _telling(scenario: Scenario, record: Record) -> Array:
    """Return the signals whose extremes a page must not miss, shape (steps, m)."""
    clearances = [record[f"{secondary.region.name}.clearance"] for secondary in scenario.regions]
    least = [np.minimum.reduce(clearances)] if clearances else []
    force = np.linalg.norm(record.stack([f"command.{axis}" for axis in "XYZ"]), axis=1)
    return np.column_stack([record["goal.clearance"], force, *least])
