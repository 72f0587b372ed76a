"""A run of a system of FMUs from its file to a folder."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from pathlib import Path

from cosim.errors import RunError
from cosim.report.system_report import write_system_report
from cosim.results.recorder import Recorder
from cosim.results.run_result import SYSTEM
from cosim.results.system_run import SystemRun, load_system_run
from cosim.run.run_folder import claim_folder, write_summary
from cosim.scenario.toml_file import split_change
from cosim.ssp.stepped_system import SteppedSystem
from cosim.ssp.structure import identifier
from cosim.ssp.system_description import SystemDescription, read_system
from plant_fmu import PlantError
from plant_fmu.archive import temporary_folder

_MAX_STEPS = 10**9


def run_system(
    path: Path, out: Path | None = None, changes: Sequence[str] = (), overwrite: bool = False, report: bool = True
) -> SystemRun:
    """Run an SSP file; write record, summary and report into a folder."""
    system = read_system(path)
    step, steps = _times(path, system, changes)
    with temporary_folder("cosim-") as scratch, SteppedSystem(path, system, step, scratch) as stepped:
        folder = claim_folder(out, identifier(path.stem), {SYSTEM: path.read_bytes()}, overwrite)
        status, failure, started, recorder = "completed", None, time.perf_counter(), None
        try:
            recorder = Recorder(folder.path, stepped.columns)
            recorder.observe(0, stepped.row)
            for k in range(steps):
                stepped.step()
                recorder.observe(k + 1, stepped.row)
        except KeyboardInterrupt:
            status = "interrupted"
        except PlantError as error:
            status, failure = f"failed: {error}", error
        finally:
            wall_time = time.perf_counter() - started
            kept = folder.keep(recorder)
        if not kept or recorder is None:
            raise failure or KeyboardInterrupt
        summary = {"system": system.name, "status": status, "step": step, "steps": recorder.rows - 1,
                   "simulated_time": (recorder.rows - 1) * step, "wall_time": wall_time}  # fmt: skip
        write_summary(folder.path, summary)
    if failure:
        raise failure
    run = load_system_run(folder.path)
    if report:
        write_system_report(run, ["html"])
    return run


def _times(path: Path, system: SystemDescription, changes: Sequence[str]) -> tuple[float, int]:
    """Return the length of a step [s] and the number of steps."""
    times = {"time.step": system.step, "time.duration": system.stop_time}
    for change in changes:
        key, text = split_change(change)
        if key not in times:
            raise RunError(f"--set {key}: expected time.step or time.duration with {path.name}")
        try:
            times[key] = float(text)
        except ValueError:
            raise RunError(f"--set {key}={text}: expected seconds") from None
    for key, value in times.items():
        if not 0.0 < value < math.inf:
            stated = "not stated" if math.isnan(value) else f"{value:g} s"
            raise RunError(f"{path}: {key} is {stated}, expected seconds above 0, such as by --set {key}=0.01")
    if system.start_time != 0.0:
        raise RunError(f"{path}: startTime is {system.start_time:g} s, expected 0")
    step, steps = times["time.step"], round(times["time.duration"] / times["time.step"])
    if not 1 <= steps <= _MAX_STEPS:
        raise RunError(f"{path}: time.duration is {steps} steps of time.step = {step:g} s, expected 1 to {_MAX_STEPS}")
    return step, steps
