"""A run from scenario to folder: set up, step, record, summarise, report."""

from __future__ import annotations

import json
import logging
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from cosim.errors import PlantError, RunError
from cosim.master import Master, Observer
from cosim.record import Recorder, load_record
from cosim.report import write_report
from cosim.scenario import VEHICLE_COPY, Scenario
from cosim.signals import Array
from cosim.summary import summarise
from cosim.telemetry import Telemetry

log = logging.getLogger(__name__)

_PROGRESS_STEPS = 200  # times that the bar moves


@dataclass(frozen=True)
class Run:
    """Where a run was written, and what it came to."""

    folder: Path
    summary: dict[str, Any]


class _Progress:
    """Observer that moves a bar on a terminal, and is quiet elsewhere."""

    def __init__(self, scenario: Scenario) -> None:
        self._every = max(1, scenario.steps // _PROGRESS_STEPS)
        self._step = scenario.time.step
        self._bar = tqdm(
            total=round(scenario.time.duration, 3), desc=scenario.name, unit="s", disable=None,
            bar_format="{desc} {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s [{elapsed}<{remaining}]",
        )  # fmt: skip

    def observe(self, k: int, row: Array) -> None:
        if k and k % self._every == 0:
            self._bar.update(self._every * self._step)

    def close(self) -> None:
        self._bar.close()


def run_scenario(
    scenario: Scenario,
    out: Path,
    mavlink: tuple[str, int] | None = None,
    rate: float | None = None,
    progress: bool = False,
    report: bool = True,
) -> Run:
    """Run a scenario and write its folder.

    Parameters
    ----------
    scenario : Scenario
        What to run.
    out : Path
        The run folder; it must not exist, or be empty.
    mavlink : (str, int), optional
        Where to stream telemetry.
    rate : float, optional
        Simulated seconds a wall-clock second at the most.
    progress : bool
        Show a bar, if there is a terminal.
    report : bool
        Write the report and its figures.

    Returns
    -------
    Run
        Its ``status`` is ``"completed"``, or ``"interrupted"`` after Ctrl-C, which leaves a readable run.

    Raises
    ------
    RunError
        If the folder cannot be written.
    PlantError
        If the FMU refuses the scenario, or fails in a step; what was recorded until then is left readable.
    """
    with Master(scenario) as master:
        telemetry = Telemetry(mavlink, master.signals, scenario.time.step) if mavlink else None
        try:
            _make_folder(out, scenario)
            return _step_and_write(master, out, telemetry, rate, progress, report)
        except OSError as error:
            raise RunError(f"{out}: {error.strerror or error}") from error
        finally:
            if telemetry:
                telemetry.close()


def _make_folder(out: Path, scenario: Scenario) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            raise RunError(f"{out}: exists and is not empty; expected a new folder")
    except OSError as error:
        raise RunError(f"{out}: {error.strerror or error}") from error
    (out / "scenario.toml").write_text(scenario.toml(), encoding="utf-8")
    if scenario.vehicle_file:
        shutil.copyfile(scenario.vehicle_file, out / VEHICLE_COPY)


def _step_and_write(
    master: Master, out: Path, telemetry: Telemetry | None, rate: float | None, progress: bool, report: bool
) -> Run:
    scenario = master.scenario
    recorder = Recorder(out, master.signals.columns)
    bar = _Progress(scenario) if progress else None
    observers: list[Observer] = [o for o in (recorder, telemetry, bar) if o is not None]
    failure: PlantError | None = None
    status = "completed"
    started = time.perf_counter()
    try:
        master.run(observers, rate)
    except KeyboardInterrupt:
        status = "interrupted"
    except PlantError as error:
        status, failure = f"failed: {error}", error
    wall_time = time.perf_counter() - started
    if bar:
        bar.close()
    if recorder.rows == 0:  # nothing to read: leave nothing behind
        shutil.rmtree(out)
        raise failure or KeyboardInterrupt
    recorder.close()
    record = load_record(out)
    summary = summarise(scenario, record, status, wall_time)
    _write_whole(out / "summary.json", lambda path: path.write_text(json.dumps(summary, indent=2) + "\n", "utf-8"))
    if report:
        write_report(out, scenario, record, summary)
    if failure:
        raise failure
    return Run(out, summary)


def _write_whole(path: Path, write: Callable[[Path], Any]) -> None:
    scratch = path.with_name(f".{path.name}")
    write(scratch)
    scratch.replace(path)
