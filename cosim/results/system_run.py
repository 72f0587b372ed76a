"""A run of a system of FMUs in its folder, finished, interrupted or killed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.errors import RunError
from cosim.io.strict_json import read_json
from cosim.results.record import Record, load_record
from cosim.results.run_result import SUMMARY, SYSTEM
from plant_fmu.errors import printable


@dataclass(frozen=True, eq=False)
class SystemRun:
    """A run of a system of FMUs."""

    folder: Path
    record: Record  # outputs over time, read at their first use
    summary: dict[str, Any]

    @property
    def outcome(self) -> str:
        """How the run ended, in a line."""
        s = self.summary
        return f"{printable(s['status'])}: {s['steps']} steps, {s['simulated_time']:g} s"


def is_of_system(folder: Path) -> bool:
    """Check whether a folder holds the run of a system of FMUs."""
    return (folder / SYSTEM).is_file()


def load_system_run(folder: Path) -> SystemRun:
    """Open a run of a system of FMUs; raise `RunError` if it cannot be read."""
    record, file = load_record(folder), folder / SUMMARY
    if not len(record):
        raise RunError(f"{folder}: the record has no rows")
    summary = {"status": "killed", "wall_time": None} | (read_json(file) if file.exists() else {})
    return SystemRun(folder, record, summary | {"steps": len(record) - 1, "simulated_time": record.value("time", -1)})
