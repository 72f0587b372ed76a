"""A sweep: a scenario flown with many rows of varied numbers."""

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
from cosim.campaigns.sweeps.summary import summarize_sweep
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text
from cosim.scenario.scenario import Scenario, to_scenario


@dataclass(frozen=True)
class Sweep:
    """Folder, rows and summary of a sweep.

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
    flown: int  # number of rows flown by this call


def run_sweep(
    scenario: Scenario | str | Path,
    design: Design,
    out: str | Path,
    engine: str = "fused",
    workers: int = 1,
    executor: Executor | None = None,
    progress: bool = False,
) -> Sweep:
    """Fly a scenario with the rows of a design, skipping finished ones, and write results and summary.

    Parameters
    ----------
    scenario : Scenario, str or Path
        The base scenario, or its name or file.
    design : Design
        Values of the keys that vary, row by row.
    out : str or Path
        A folder that does not exist, is empty, or holds the same sweep. A complete one gets its summary again, a
        partial one is continued.
    engine : str
        ``"fused"``, the compiled loop around the FMU.
    workers : int
        Number of processes, which does not change the rows. With an executor: number of batches at the same time.
    executor : concurrent.futures.Executor, optional
        Executor that flies the rows, instead of processes started here, such as ``Client(...).get_executor()`` of
        Dask. It is not closed. Its threads take turns.
    progress : bool
        True to show a bar, if there is a terminal.

    Returns
    -------
    Sweep
        Folder, rows and summary, with all rows of the design.

    Raises
    ------
    ScenarioError
        If a key is unknown, or not one of a number.
    RunError
        If the engine does not support the scenario, the folder holds something else or cannot be written, or processes
        crash with any row.
    BuildError, PlantError
        If there is no FMU of the vehicle.
    KeyboardInterrupt
        After Ctrl-C; finished rows are kept.

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
    work, out = SweepWork(to_scenario(scenario), design, engine), Path(out)
    summary: dict[str, Any] = {}

    def conclude(results: Results) -> None:
        summary.update(summarize_sweep(work, results, out))
        write_atomic(out / SUMMARY, json_text(summary))

    done = carry_out(work, out, workers, executor, progress, conclude)
    return Sweep(out, done.results, summary, done.flown)
