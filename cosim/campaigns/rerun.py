"""Rerun of a row of a campaign: with the same engine, bit for bit, and step by step with full record."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from controller import ControllerError
from controller.regions.region_set import of_attitude
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.law_gains import AnyLaw, FmuGains, digest_of_law, gains_of_plan
from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.campaigns.scenes.scene_rows import SCHEMA
from cosim.campaigns.scenes.scene_work import SceneTask
from cosim.campaigns.store.folder import PLAN, RESULTS, read_plan
from cosim.campaigns.store.plan import SCENES, SWEEP, code_digest, difference
from cosim.campaigns.store.results import Results
from cosim.campaigns.sweeps.design import design_of
from cosim.campaigns.sweeps.sweep_rows import SweepWork, schema_of
from cosim.campaigns.workers.dispatch import KILLED
from cosim.campaigns.workers.work import Task
from cosim.errors import CosimError, RunError
from cosim.io.strict_json import understood
from cosim.results.file_copies import VEHICLE_COPY
from cosim.results.run_result import SCENARIO, Run
from cosim.results.spans import spans
from cosim.run.run_scenario import run_scenario
from cosim.scenario.law_factory import OwnLaw
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.scenario.toml_file import rename_former_keys
from plant_fmu import PlantError, PlantFmuError
from plant_fmu.toml_tables import decode

Outcome = dict[str, Any]  # values of some columns of a row
_ROUNDING = 1e-6  # relative and absolute tolerance between two flights of one scenario
_OF_THE_CLOCK = ("worst_step_time",)  # columns of wall-clock times, which differ in a rerun


@dataclass(frozen=True)
class Repeat:
    """Task, batch and scenario that repeat a row."""

    stored: dict[str, Any]  # stored row
    task: Task  # task that flies the row
    batch: Any  # batch with this row alone
    scenario: Scenario | None  # equivalent to the row; None if the row was refused
    outcome: Callable[[Run], Outcome]  # columns of the row from a recorded run
    law: OwnLaw | None = None  # Python code that is the law

    def differences(self, run: Run) -> dict[str, tuple[Any, Any]]:
        """Return stored and recorded values of the columns that differ by more than rounding; none of a partial run."""
        if run.summary["status"] != "completed":
            return {}
        step = 1.5 * run.scenario.time.step
        return {
            name: (self.stored[name], now)
            for name, now in self.outcome(run).items()
            if not _close(self.stored[name], now, step if name.endswith("_time") else _ROUNDING)
        }


def repeat_of(folder: Path, key: int, laws: Sequence[OwnLaw] = ()) -> Repeat:
    """Prepare the repetition of a row; a law that is Python code is one of those given."""
    plan = read_plan(folder)
    if plan.get("kind") not in (SCENES, SWEEP):
        raise RunError(f"{folder}: holds a campaign of another version, expected one of this")
    with understood(folder / PLAN):
        schema = SCHEMA if plan["kind"] == SCENES else schema_of(tuple(plan["vary"].keys()))
    results = complete_results(folder, schema)
    stored = results.row(key)
    if stored is None:
        keys = results[schema.names[0]]
        known = f"one from {keys[0]} to {keys[-1]}" if len(keys) else "a campaign that has rows"
        raise RunError(f"{folder}: has no row {key}, expected {known}")
    if stored["refused"] == KILLED:
        raise RunError(f"{folder}: row {key} is not flown again: {KILLED}")
    try:
        with understood(folder / PLAN):
            repeat = _sweep_repeat if plan["kind"] == SWEEP else _scene_repeat
            return repeat(folder, plan, stored, _own_law(plan, laws))
    except (CosimError, PlantFmuError, ControllerError) as error:
        if str(folder) in str(error):
            raise
        raise RunError(f"{folder}: row {key}: {error}") from error


def _own_law(plan: dict[str, Any], laws: Sequence[OwnLaw]) -> OwnLaw | None:
    """Return the law of a plan, if it is Python code, which no folder holds."""
    name = plan["scenario"]["law"]["name"] if plan["kind"] == SWEEP else plan["law"]
    if ":" not in name or name.endswith((".fmu", ".toml")):
        return None
    for law in laws:
        if law.name == name:
            if law.digest != plan["law_sha256"]:
                raise RunError(f"law {name} is not that of the campaign: its code has changed")
            return law
    raise RunError(f"law {name} is Python code, which no folder holds, expected --law FILE.py:NAME")


def complete_results(folder: Path, schema: Any) -> Results:
    """Open the rows of a complete campaign."""
    require_complete(folder)
    return Results(folder / RESULTS, schema)


def require_complete(folder: Path) -> None:
    """Raise `RunError` if a folder holds no complete campaign."""
    if not (folder / RESULTS).exists():
        raise RunError(f"{folder}: is not complete, expected a campaign that is; repeat its command to resume it")


def _sweep_repeat(folder: Path, plan: dict[str, Any], stored: dict[str, Any], own: OwnLaw | None) -> Repeat:
    work = SweepWork(load_scenario(folder / SCENARIO), design_of(plan), own)
    scenario_before = rename_former_keys(plan["scenario"])
    if differences := difference({"scenario": scenario_before}, {"scenario": work.plan["scenario"]}):
        raise RunError(f"{folder / SCENARIO}: is not that of the campaign ({differences})")
    if plan["vehicle_sha256"] != work.plan["vehicle_sha256"]:
        raise RunError(f"{folder / VEHICLE_COPY}: is not that of the campaign")
    row = stored["row"]
    batch = work.batch(np.array([row]))
    if "search" in plan:  # its values depend on earlier rows, and are stored in the rows only
        batch = batch._replace(values=np.array([[stored[key] for key in work.variation.keys]]))
    scenario = None
    if stored["refused"] is None:
        scenario = work.variation.scenario(batch.values[0].tolist(), int(batch.seeds[0]))
        scenario = dataclasses.replace(scenario, name=f"{plan['name']}-row-{row}")
    return Repeat(stored, work.task, batch, scenario, _row_outcome, own)


def _scene_repeat(folder: Path, plan: dict[str, Any], stored: dict[str, Any], own: OwnLaw | None) -> Repeat:
    law: AnyLaw = own or plan["law"]
    gains = FmuGains() if own else gains_of_plan(plan)
    if plan.get("law_sha256") != digest_of_law(law).get("law_sha256"):
        raise RunError(f"{law}: is not that of the campaign")
    conditions: Conditions = decode(plan["conditions"], Conditions, "conditions")
    line = stored["scene"].encode()
    scenario = None
    if stored["refused"] is None:
        scenario = scene_scenario(decode_scene(line), law, gains, conditions)

    task = SceneTask(law, gains, conditions)
    return Repeat(stored, task, [line], scenario, lambda run: _scene_outcome(run, conditions), own)


def _row_outcome(run: Run) -> Outcome:
    """Return the columns of a sweep's row from a recorded run."""
    same = ("reached", "reach_time", "settled", "closest_to_goal", "effort", "max_force", "max_speed")
    return {name: run.summary[name] for name in same} | {
        "violated": bool(run.summary["hard_violated"]),
        "min_clearance": _min_clearance(run),
    }


def _scene_outcome(run: Run, conditions: Conditions) -> Outcome:
    """Return the columns of a row of a campaign of scenes from a recorded run."""
    time, inside = run.record["time"], run.record["goal.clearance"] >= 0.0
    entered = spans(inside, time)[-1][0] if inside[-1] else math.inf
    reached = bool(time[-1] - entered >= conditions.settled - 0.5 * conditions.plant_step)
    clearance = _min_clearance(run)
    return {
        "reached": reached,
        "violation": clearance < 0.0,
        "min_clearance": clearance if math.isfinite(clearance) else None,
        "reach_time": entered if reached else None,
    }


def _min_clearance(run: Run) -> float:
    """Return the minimum clearance of hard regions of position [m], inf where there is none."""
    hard = [r.region.name for r in run.scenario.regions if r.region.hard and not of_attitude(r.region.shape)]
    return min((run.summary["min_clearance"][name] for name in hard), default=math.inf)


def _close(one: Any, other: Any, tolerance: float) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_ROUNDING, abs_tol=tolerance)
    return bool(one == other)


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


def rerun(folder: Path, key: int, out: Path | None = None, progress: bool = False, law: OwnLaw | None = None) -> Rerun:
    """Fly a row again with its engine, and once more step by step with full record and report."""
    repeat = repeat_of(folder, key, [law] if law else [])
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
            run = run_scenario(repeat.scenario, out, progress=progress, law=repeat.law)
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
