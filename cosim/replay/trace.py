"""The trace of a run: header and rows of its page, from scenario, record and summary."""

from __future__ import annotations

import base64
import dataclasses
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.io.strict_json import nan_to_none
from cosim.replay.events import events_of
from cosim.replay.header import header_of
from cosim.replay.region_changes import list_region_changes, read_command_log
from cosim.replay.sampling import MAX_BYTES, sampled_rows
from cosim.replay.view_columns import ViewColumns
from cosim.results.extremes import rows_at
from cosim.results.record import Rows
from cosim.results.run_result import Run
from cosim.results.wording import verdict
from cosim.simulation.signals import Array

_FORCE = [f"command.{axis}" for axis in "XYZ"]


@dataclass(frozen=True)
class Trace:
    """Header and rows of a page."""

    header: dict[str, Any]
    rows: Array  # (n, columns), equal to the record to the last bit
    steps: NDArray[np.intp]  # (n,) their indices in the record

    def as_json(self) -> dict[str, Any]:
        """Return the header with the packed numbers."""
        # The numbers are float64, little-endian, column by column. Their bytes are ordered by planes, all first bytes,
        # then all second ones and so on, which compresses better; then raw deflate, and base64.
        numbers = np.ascontiguousarray(self.rows.T, dtype="<f8")
        planes = np.ascontiguousarray(numbers.view(np.uint8).reshape(-1, 8).T).tobytes()
        deflate = zlib.compressobj(6, zlib.DEFLATED, -zlib.MAX_WBITS)
        packed = deflate.compress(planes) + deflate.flush()
        return {**self.header, "rows": len(self.rows), "data": base64.b64encode(packed).decode()}


def trace_of(run: Run, max_bytes: int = MAX_BYTES) -> Trace:
    """Make the trace of a run."""
    scenario, record, summary = run.scenario, run.record, run.summary
    view_columns = ViewColumns(scenario, record.columns)
    log = read_command_log(run)
    changes, events = list_region_changes(run, log), events_of(run, log)
    times = [t for event in events for t in (event.time, event.until) if t is not None]
    event_rows = rows_at(record, [*(change["time"] for change in changes), *times])
    clearances = ["goal.clearance", *(f"{secondary.region.name}.clearance" for secondary in scenario.regions)]
    extreme_signals = (_extreme_signals(block, clearances) for block in record.blocks([*_FORCE, *clearances]))
    steps = sampled_rows(record, len(view_columns.columns), extreme_signals, 1 + len(clearances), event_rows, max_bytes)
    names = [record.columns[i].name for i in view_columns.picked]
    picked, missing = _read(record, names, steps)
    rows, columns = view_columns.compute_rows(picked), view_columns.columns
    if scenario.log:  # signals that a log never has, such as weights, are not shown as gaps
        kept = [i for i in range(len(columns)) if i >= len(names) or missing[i] < len(record)]
        rows, columns = rows[:, kept], tuple(columns[i] for i in kept)
    # the goal's shape at the start; later ones are in the changes
    at_start = dataclasses.replace(scenario, goal=run.planned.goal)
    header = header_of(at_start, columns) | {
        "verdict": verdict(summary),
        "status": summary["status"],
        "summary": {key: summary[key] for key in ("min_clearance", "reach_time", "settle_time")},
        "changes": changes,
        "events": [dataclasses.asdict(event) for event in events],
        "gaps": {
            name: int(count)
            for name, count in zip(names, missing, strict=True)
            if 0 < count < len(record) or (count and not scenario.log)
        },
    }
    return Trace(nan_to_none(header), rows, steps)


def _read(record: Rows, names: Sequence[str], steps: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp]]:
    """Read some rows of some signals; return them, and the count of missing numbers of each signal in all rows."""
    rows, missing, first = [], np.zeros(len(names), np.intp), 0
    for block in record.blocks(names):
        within = steps[(steps >= first) & (steps < first + len(block))] - first
        rows.append(block.take(within).to_array())
        missing += [np.count_nonzero(np.isnan(block[name])) for name in names]
        first += len(block)
    return np.concatenate(rows), missing


def _extreme_signals(rows: Rows, clearances: Sequence[str]) -> list[Array]:
    """Return the signals whose extremes a page keeps: the length of the commanded force, and clearances."""
    return [np.linalg.norm(rows.stack(_FORCE), axis=1), *(rows[name] for name in clearances)]
