"""One row of a campaign again: the same to the last bit, and with everything recorded."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cosim.campaigns.design import design_of
from cosim.campaigns.dispatch import KILLED
from cosim.campaigns.folder import RESULTS, read_plan
from cosim.campaigns.law_gains import law_named
from cosim.campaigns.plan import SCENES, SWEEP, code_digest, difference
from cosim.campaigns.results import Results
from cosim.campaigns.scenes import SceneTask
from cosim.campaigns.sweep_rows import SweepWork
from cosim.campaigns.work import Task
from cosim.errors import RunError
from cosim.run import Run, run_scenario
from cosim.run_folder import SCENARIO
from cosim.scenario import VEHICLE_COPY, Scenario, load_scenario
from cosim.scene_run import Conditions

_OF_THE_CLOCK = ("worst_step_time",)  # columns that no repetition gives again


@dataclass(frozen=True)
class Rerun:
    """A row that was flown again."""

    key: int  # of the row
    differing: dict[str, tuple[Any, Any]]  # by column: as it is stored, as it came again
    other_code: bool  # the code is not that which has flown the row
    run: Run | None  # with full record; None where there can be none


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
        What differs, bit by bit, from what is stored; and the run.

    Raises
    ------
    RunError
        If the folder holds no campaign that is complete, there is no such row, or it kills whoever flies it.
    Exception
        Whatever `run_scenario` raises.
    """
    plan = read_plan(folder)
    if plan.get("kind") not in (SCENES, SWEEP):
        raise RunError(f"{folder}: holds a campaign of another version, expected one of this")
    results = _results(folder)
    stored = results.row(key)
    if stored is None:
        first, last = results[results.schema.names[0]][[0, -1]]
        raise RunError(f"{folder}: has no row {key}, expected one from {first} to {last}")
    if stored["refused"] == KILLED:
        raise RunError(f"{folder}: row {key} is not flown again: {KILLED}")
    try:
        task, batch, scenario = (_of_sweep if plan["kind"] == SWEEP else _of_scene)(folder, plan, stored)
    except (KeyError, TypeError) as error:
        raise RunError(f"{folder}: the plan of the campaign cannot be read: {error!r}") from error
    flyer = task.flyer()
    try:
        (again,) = flyer.fly(batch).to_pylist()
    finally:
        flyer.close()
    differing = {
        name: (stored[name], again[name])
        for name in stored
        if name not in _OF_THE_CLOCK and not _identical(stored[name], again[name])
    }
    run = run_scenario(scenario, out, progress=progress) if scenario is not None else None
    return Rerun(key, differing, plan.get("code_sha256") != code_digest(), run)


def _results(folder: Path) -> Results:
    if not (folder / RESULTS).exists():
        raise RunError(f"{folder}: is not complete, expected a campaign that is; its own command goes on with it")
    return Results(folder / RESULTS)


def _of_sweep(folder: Path, plan: dict[str, Any], stored: dict[str, Any]) -> tuple[Task, Any, Scenario | None]:
    """Return how a row of a sweep is flown, its batch, and the scenario that it stands for."""
    work = SweepWork(load_scenario(folder / SCENARIO), design_of(plan), plan["engine"])
    if differing := difference(
        {"scenario": plan["scenario"]}, {"scenario": json.loads(json.dumps(work.plan["scenario"]))}
    ):
        raise RunError(f"{folder / SCENARIO}: is not that of the campaign ({differing})")
    if plan["vehicle_sha256"] != work.plan["vehicle_sha256"]:
        raise RunError(f"{folder / VEHICLE_COPY}: is not that of the campaign")
    row = stored["row"]
    batch = work.batch(np.array([row]))
    if stored["refused"] is not None:
        return work.task, batch, None
    scenario = work.variation.scenario(batch.values[0].tolist(), int(batch.seeds[0]))
    return work.task, batch, dataclasses.replace(scenario, name=f"{plan['name']}-row-{row}")


def _of_scene(folder: Path, plan: dict[str, Any], stored: dict[str, Any]) -> tuple[Task, Any, Scenario | None]:
    """Return the same of a scene."""
    gains = law_named(plan["law"]).gains_type(**plan["gains"])
    return SceneTask(plan["law"], gains, Conditions(**plan["conditions"])), [stored["scene"].encode()], None


def _identical(one: Any, other: Any) -> bool:
    """Return whether two numbers are the same to the last bit; 0.0 and -0.0 are not."""
    if isinstance(one, float) and isinstance(other, float):
        return one == other and math.copysign(1.0, one) == math.copysign(1.0, other)
    return bool(one == other)
