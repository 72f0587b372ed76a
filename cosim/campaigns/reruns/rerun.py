"""Rerun of a row of a campaign: with the same engine, bit for bit, and step by step with full record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.campaigns.reruns.repeat import repeat_of
from cosim.campaigns.store.folder import read_plan
from cosim.campaigns.store.plan import code_digest
from cosim.results.run_result import Run
from cosim.run.run import run_scenario
from plant_fmu import PlantError

_OF_THE_CLOCK = ("worst_step_time",)  # columns of wall-clock times, which differ in a rerun


@dataclass(frozen=True)
class Rerun:
    """Result of a rerun."""

    key: int  # key of the row
    differing: dict[str, tuple[Any, Any]]  # stored value and that of the rerun, by column, where they differ
    other_code: bool  # True if the row was flown by other code
    run: Run | None  # run with full record; None if the row was refused or stopped
    # stored value and that of `run`, by column, where they differ by more than rounding
    apart: dict[str, tuple[Any, Any]]
    stopped: str | None  # error of the plant that stopped the flight, as in the row


def rerun(folder: Path, key: int, out: Path | None = None, progress: bool = False) -> Rerun:
    """Fly a row again with its engine, and once more step by step with full record and report."""
    repeat = repeat_of(folder, key)
    flyer = repeat.task.flyer()
    try:
        (again,) = flyer.fly(repeat.batch).to_pylist()
    finally:
        flyer.close()
    differing = {
        name: (value, again[name])
        for name, value in repeat.stored.items()
        if name not in _OF_THE_CLOCK and not _identical(value, again[name])
    }
    run, apart, stopped = None, {}, None
    if repeat.scenario is not None:
        try:
            run = run_scenario(repeat.scenario, out, progress=progress)
            apart = repeat.differences(run)
        except PlantError as error:
            if repeat.stored["stopped_at"] is None:
                raise
            stopped = str(error)
    other_code = read_plan(folder).get("code_sha256") != code_digest()
    return Rerun(key, differing, other_code, run, apart, stopped)


def _identical(one: Any, other: Any) -> bool:
    """Return True if two values are identical; 0.0 and -0.0 are not."""
    if isinstance(one, float) and isinstance(other, float):
        return one == other and math.copysign(1.0, one) == math.copysign(1.0, other)
    return bool(one == other)
