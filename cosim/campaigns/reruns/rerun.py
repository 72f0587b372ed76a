"""One row of a campaign again: the same to the last bit, and with everything recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.campaigns.reruns.repeat import repeat_of
from cosim.campaigns.store.folder import read_plan
from cosim.campaigns.store.plan import code_digest
from cosim.results.record import load_record
from cosim.results.run_result import Run
from cosim.run.run import run_scenario
from plant_fmu import PlantError

_OF_THE_CLOCK = ("worst_step_time",)  # columns that no repetition gives again


@dataclass(frozen=True)
class Rerun:
    """A row that was flown again."""

    key: int  # of the row
    differing: dict[str, tuple[Any, Any]]  # by column: as it is stored, as it came again
    other_code: bool  # the code is not that which has flown the row
    run: Run | None  # with full record; None where there can be none
    apart: dict[str, tuple[Any, Any]]  # by column: as it is stored, as it came step by step; more than rounding
    stopped: str | None  # why the plant refused to go on, as it did in the row


def rerun(folder: Path, key: int, out: Path | None = None, progress: bool = False) -> Rerun:
    """Fly a row again as it was flown, and once more step by step with full record and report.

    Parameters
    ----------
    folder : Path
        Of a campaign.
    key : int
        Number of the row in a sweep, seed of the scene in a campaign of scenes.
    out : Path, optional
        The run folder; it must not exist, or be empty. Default: a new one below ``runs``.
    progress : bool
        Show a bar of the run, if there is a terminal.

    Returns
    -------
    Rerun
        What differs, bit by bit, from what is stored; the run; and where it came out otherwise than the row.

    Raises
    ------
    RunError
        If the folder holds no campaign that is complete, there is no such row, or it kills whoever flies it.
    Exception
        Whatever `run_scenario` raises.
    """
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
        except PlantError as error:
            if repeat.stored["stopped_at"] is None:
                raise
            stopped = str(error)
        else:
            if run.summary["status"] == "completed":
                apart = repeat.apart(repeat.outcome(repeat.scenario, load_record(run.folder), run.summary))
    other_code = read_plan(folder).get("code_sha256") != code_digest()
    return Rerun(key, differing, other_code, run, apart, stopped)


def _identical(one: Any, other: Any) -> bool:
    """Return whether two numbers are the same to the last bit; 0.0 and -0.0 are not."""
    if isinstance(one, float) and isinstance(other, float):
        return one == other and math.copysign(1.0, one) == math.copysign(1.0, other)
    return bool(one == other)
