"""Stream a recorded run over MAVLink as if it were running."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import RunError
from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.run_links import max_lead
from cosim.mavlink.thread import MAX_SNAPSHOTS, SNAPSHOT_PERIOD, LinkThread
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.link import open_links
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.results.record import Record, load_record
from cosim.results.required_columns import require_columns
from cosim.results.run_result import SCENARIO
from cosim.scenario.scenario import load_scenario
from cosim.simulation.columns import column_names
from cosim.simulation.pace import Pace
from cosim.simulation.signals import Array

_MAX_QUEUED = MAX_SNAPSHOTS // 2


@dataclass(frozen=True)
class StreamResult:
    """Result of streaming a record."""

    simulated: float  # s
    wall: float  # s
    loss_reports: list[str]  # texts about lost or refused frames


def stream_record(
    folder: Path, endpoints: Sequence[Endpoint], options: MavlinkOptions, rate: float | None = 1.0
) -> StreamResult:
    """Stream a recorded run as a running vehicle that accepts no commands."""
    if not (folder / SCENARIO).is_file():
        raise RunError(f"{folder}: holds no run ({SCENARIO} is missing)")
    scenario, record = load_scenario(folder / SCENARIO, imported=True), load_record(folder)
    require_columns(scenario, record)
    expected = set(column_names(scenario))  # further columns could separate columns that are read as one slice
    columns = [column for column in record.columns if column.name in expected or column.name.startswith("law.")]
    autopilot = Autopilot(VehicleContext(scenario, columns, options, commands=None, live=False))
    thread = LinkThread(autopilot, open_links(endpoints, options), scenario.time.step, max_lead(scenario, rate))
    every = max(1, round(SNAPSHOT_PERIOD / scenario.time.step))
    thread.start()
    started, simulated = time.perf_counter(), 0.0
    pace = None if rate is None else Pace(every * scenario.time.step / rate)
    try:
        for k, row in _rows(record, every, [column.name for column in columns]):
            simulated = float(row[0])
            if pace is not None:
                pace.wait()
            thread.await_queue(_MAX_QUEUED)
            thread.observe(k, row)
        thread.await_queue(0)
    finally:
        thread.close()
    return StreamResult(simulated, time.perf_counter() - started, thread.loss_reports())


def _rows(record: Record, every: int, names: Sequence[str]) -> Iterator[tuple[int, Array]]:
    """Yield the step and row of every `every`-th step."""
    first = 0
    for rows in record.blocks(names):
        block = rows.to_array()
        for i in range(-first % every, len(block), every):
            yield first + i, block[i]
        first += len(block)
