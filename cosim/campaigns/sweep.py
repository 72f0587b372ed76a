"""A sweep from its scenario to its folder: many rows, each with numbers of its own."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.campaigns.runner import carry_out
from cosim.campaigns.store.folder import SUMMARY
from cosim.campaigns.store.results import Results
from cosim.campaigns.sweeps.design import Design
from cosim.campaigns.sweeps.rows import SweepWork
from cosim.campaigns.sweeps.summary import summarise_sweep
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text
from cosim.scenario.scenario import Scenario


@dataclass(frozen=True)
class Sweep:
    """Where a sweep was written, and what it came to.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> design = cosim.Design(cosim.vary_from(["initial.position.1=-4:-2"]), samples=2)
    >>> scenario = cosim.load_scenario("paper", ["time.duration=0.2", "arbiter.engine=closed"])
    >>> sweep = cosim.run_sweep(scenario, design, Path("sweep"))
    >>> sweep.results["initial.position.1"].shape
    (2,)
    """

    folder: Path
    results: Results
    summary: dict[str, Any]
    flown: int  # rows, by this call; the rest had been flown before


def run_sweep(
    scenario: Scenario,
    design: Design,
    out: Path,
    engine: str = "fused",
    workers: int = 1,
    executor: Executor | None = None,
    progress: bool = False,
) -> Sweep:
    """Fly a scenario with every row of a design, or with those that are left, and write results and summary.

    Parameters
    ----------
    scenario : Scenario
        What stays.
    design : Design
        What varies.
    out : Path
        A folder that does not exist, is empty, or holds the same sweep: as a whole, which writes its summary again,
        or as a part, which goes on.
    engine : str
        ``"fused"``, the compiled loop around the FMU; or ``"lanes"``, several vehicles side by side without one.
    workers : int
        Processes; rows are the same for any number. Of an executor: how much it does at the same time.
    executor : concurrent.futures.Executor, optional
        That flies the rows, in the place of processes of our own, such as ``Client(...).get_executor()`` of Dask. It
        is not closed. Threads take turns.
    progress : bool
        Show a bar, if there is a terminal.

    Returns
    -------
    Sweep
        With every row.

    Raises
    ------
    ScenarioError
        If a key is unknown, or what it names is no number.
    RunError
        If the engine cannot fly the scenario, the folder holds something else or cannot be written, or processes die
        whatever they fly.
    BuildError, PlantError
        If there is no FMU of the vehicle.
    KeyboardInterrupt
        After Ctrl-C; what is done is kept.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> design = cosim.Design(cosim.vary_from(["initial.position.1=-4:-2"]), samples=2)
    >>> scenario = cosim.load_scenario("paper", ["time.duration=0.2", "arbiter.engine=closed"])
    >>> sweep = cosim.run_sweep(scenario, design, Path("sweep"))
    >>> sweep.flown
    2
    """
    work = SweepWork(scenario, design, engine)
    summary: dict[str, Any] = {}

    def conclude(results: Results) -> None:
        summary.update(summarise_sweep(work, results, out))
        write_atomic(out / SUMMARY, json_text(summary))

    done = carry_out(work, out, workers, executor, progress, conclude)
    return Sweep(out, done.results, summary, done.flown)
