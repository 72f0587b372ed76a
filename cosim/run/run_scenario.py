"""A run from scenario to folder: set up, step, record, summarize, report."""

from __future__ import annotations

import itertools
import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from controller import Law, LawError
from cosim.errors import RunError
from cosim.results.recorder import Recorder
from cosim.results.run_result import COMMANDS_LOG, Run
from cosim.results.wording import verdict
from cosim.run.progress import ProgressBar
from cosim.run.run_folder import RunFolder, claim, conclude
from cosim.scenario.law_factory import FIND_GAINS, OwnLaw, foreign_gains, read_law, with_custom_law
from cosim.scenario.scenario import Scenario, to_scenario
from cosim.simulation.commands.sources import CommandQueue, LoggedCommands, ReplayedCommands
from cosim.simulation.master import Master, Observer
from cosim.simulation.signals import Array
from plant_fmu import PlantError

if TYPE_CHECKING:  # pymavlink and websockets are imported only for runs that need them
    from cosim.live.live_view import LiveView
    from cosim.mavlink.run_links import Mavlink
    from cosim.mavlink.thread import LinkThread
    from cosim.report.figure_process import FigureProcess

_LOG = logging.getLogger(__name__)
_PROGRESS_STEPS = 200  # updates of the bar


@dataclass(frozen=True)
class _ObserverGroup:
    """Observer that passes each row to several observers."""

    observers: Sequence[Observer]

    def observe(self, k: int, row: Array) -> None:
        for observer in self.observers:
            observer.observe(k, row)


class _Progress:
    """Observer that updates a progress bar on a terminal."""

    def __init__(self, scenario: Scenario) -> None:
        self._every = max(1, scenario.steps // _PROGRESS_STEPS)
        self._step = scenario.time.step
        self._bar = ProgressBar(
            shown=True, total=scenario.time.duration, desc=scenario.name, unit="s",
            bar_format="{desc} {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s [{elapsed}<{remaining}]",
        )  # fmt: skip

    def observe(self, k: int, row: Array) -> None:
        self.observe_block(k, row[None])

    def observe_block(self, first: int, rows: Array) -> None:
        last = first + len(rows) - 1
        if last // self._every > (first - 1) // self._every:
            self._bar.update_to(last * self._step)

    def close(self) -> None:
        self._bar.close()


def run_scenario(
    scenario: Scenario | str | Path,
    out: str | Path | None = None,
    mavlink: Mavlink | None = None,
    rate: float | None = None,
    progress: bool = False,
    report: bool = True,
    commands_log: str | Path | None = None,
    live: LiveView | None = None,
    law: Law | OwnLaw | str | None = None,
    overwrite: bool = False,
    figure_process: FigureProcess | None = None,
) -> Run:
    """Run a scenario and write its folder.

    A command to reset ends the run and begins another one in a new folder.

    Parameters
    ----------
    scenario : Scenario, str or Path
        The scenario of the run, or its name or file.
    out : str or Path, optional
        The run folder; it must not exist, or be empty. Default: a new one below ``runs``. Runs after a reset add a
        number to the name.
    mavlink : Mavlink, optional
        MAVLink setup of the run as a vehicle; default: no link.
    rate : float, optional
        Greatest number of simulated seconds per wall-clock second; default: no limit.
    progress : bool
        Show a bar, if there is a terminal.
    report : bool
        Write the report and its figures.
    commands_log : str or Path, optional
        Log of commands of an earlier run, which is replayed; link and viewers then cannot send commands.
    live : LiveView, optional
        Shows the run in browsers, and takes their commands if the scenario's commands are enabled.
    law : Law or str, optional
        Custom law instead of the scenario's: a `FunctionLaw`, or ``"file.py:name"`` of a law, a function, or a class.
        The run folder holds its name, not its code: repeating the run needs the law again.
    overwrite : bool
        Replace the run in `out`; a folder with any other content is refused.
    figure_process : FigureProcess, optional
        Process that draws the figures, as the command line has one; default: this one.

    Returns
    -------
    Run
        The last run. Its ``status`` is ``"completed"``, or ``"interrupted"`` after Ctrl-C, which leaves a readable run.

    Raises
    ------
    RunError
        If the folder cannot be written, or the log of commands cannot be read.
    TelemetryError
        If the link cannot be opened.
    ScenarioError
        If the scenario needs a feature that a custom law lacks.
    BuildError, LawError, DefinitionError
        If plant, law or arbiter cannot be set up.
    LawError
        If a custom law returns no forces; the record until then stays readable.
    PlantError
        If the FMU refuses the scenario, or fails in a step; the record until then stays readable.

    Examples
    --------
    >>> import cosim
    >>> scenario = cosim.load_scenario("paper").replace({"time.duration": 0.2})
    >>> cosim.run_scenario(scenario, "run", report=False).summary["simulated_time"]
    0.2
    """
    scenario, out = to_scenario(scenario), None if out is None else Path(out)
    own = read_law(law) if isinstance(law, str) else law if isinstance(law, OwnLaw) else None
    given = None if isinstance(law, str | OwnLaw) else law
    if own is not None:
        scenario = own.in_scenario(scenario)
    elif given is not None:
        scenario = with_custom_law(given, scenario)
    if text := foreign_gains(scenario):
        _LOG.warning("%s: %s", text, FIND_GAINS)
    replayed = None if commands_log is None else _replayed_commands(scenario, Path(commands_log))
    queue = CommandQueue()
    link: LinkThread | None = None
    try:
        for attempt in itertools.count(1):
            with Master(scenario, own.make(scenario) if own else given) as master:
                if mavlink is not None and link is None:
                    link = mavlink.open(scenario, master.signals.columns, None if replayed else queue, rate)
                folder = claim(
                    out.with_name(f"{out.name}-{attempt}") if out and attempt > 1 else out, scenario, overwrite
                )
                if link is not None and attempt == 1:
                    link.start()
                if live is not None:
                    live.begin(scenario, master.signals.columns, _viewer_queue(scenario, replayed, queue))
                with folder.writing():
                    source = LoggedCommands(
                        replayed or queue, folder.path / COMMANDS_LOG, live.show_commands if live else None
                    )
                    status, wall_time, failure = _step(master, folder, source, link, live, rate, progress)
                    queue.end_run()
                    if live is not None and report:
                        live.say("The run is over; its report is being written")
                    run = conclude(folder.path, scenario, status, wall_time, report, figure_process)
                    if live is not None:
                        live.end(status, verdict(run.summary))
            if failure:
                raise failure
            if status != "reset" or replayed:
                return run
    finally:
        if link:
            link.close()
    raise AssertionError("unreachable")


def _viewer_queue(scenario: Scenario, replayed: ReplayedCommands | None, queue: CommandQueue) -> CommandQueue | str:
    """Return the queue for viewers' commands, or the reason why they are refused."""
    if replayed:
        return "this run repeats the commands of a log and takes no others"
    return queue if scenario.commands.enabled else "commands are off: start with --commands"


def _replayed_commands(scenario: Scenario, commands_log: Path) -> ReplayedCommands:
    if not scenario.commands.enabled:
        raise RunError(f"{commands_log}: commands are given, expected a scenario with commands.enabled")
    return ReplayedCommands(commands_log)


def _step(
    master: Master,
    folder: RunFolder,
    commands_log: LoggedCommands,
    link: LinkThread | None,
    live: LiveView | None,
    rate: float | None,
    progress: bool,
) -> tuple[str, float, PlantError | LawError | None]:
    """Step through the run and close its record; return status, wall time [s] and error."""
    status = "completed"
    failure: PlantError | LawError | None = None
    recorder: Recorder | None = None
    bar: _Progress | None = None
    started = time.perf_counter()
    try:
        recorder = Recorder(folder.path, master.signals.columns)
        bar = _Progress(master.scenario) if progress else None
        viewers = [o for o in (link, live) if o is not None]
        observers: list[Observer] = [recorder, *viewers, *([bar] if bar else [])]
        started = time.perf_counter()
        master.run(observers, rate, commands_log, awaiting=_ObserverGroup(viewers))
        if master.command_handler is not None and master.command_handler.reset:
            status = "reset"
    except KeyboardInterrupt:
        status = "interrupted"
    except (PlantError, LawError) as error:
        status, failure = f"failed: {error}", error
    finally:
        wall_time = time.perf_counter() - started
        if bar:
            bar.close()
        kept = folder.keep(recorder)
    if not kept:
        raise failure or KeyboardInterrupt
    return status, wall_time, failure
