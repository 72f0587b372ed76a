"""A sweep: a scenario flown with many rows of varied numbers."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path

from cosim.campaigns.runner import Campaign, carry_out
from cosim.campaigns.sweeps.design import Design
from cosim.campaigns.sweeps.rows import SweepWork
from cosim.campaigns.sweeps.summary import summarize_sweep
from cosim.scenario.scenario import Scenario, to_scenario


def run_sweep(
    scenario: Scenario | str | Path,
    design: Design,
    out: str | Path,
    *,
    workers: int = 1,
    executor: Executor | None = None,
    progress: bool = False,
) -> Campaign:
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
    workers : int
        Number of processes, which does not change the rows. With an executor: number of batches at the same time.
    executor : concurrent.futures.Executor, optional
        Executor that flies the rows, instead of processes started here, such as ``Client(...).get_executor()`` of
        Dask. It is not closed. Its threads take turns.
    progress : bool
        True to show a bar, if there is a terminal.

    Returns
    -------
    Campaign
        Folder, rows and summary, with all rows of the design.

    Raises
    ------
    ScenarioError
        If a key is unknown, or not one of a number.
    RunError
        If the compiled loop does not support the scenario, the folder holds something else or cannot be written, or
        processes crash with any row.
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
    work, out = SweepWork(to_scenario(scenario), design), Path(out)
    return carry_out(work, out, lambda results: summarize_sweep(work, results, out), workers, executor, progress)
