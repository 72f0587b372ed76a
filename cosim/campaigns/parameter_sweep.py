"""A sweep: a scenario flown with many rows of varied numbers."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from controller import Law
from cosim.batch.outcome import FIELDS
from cosim.campaigns.analysis.campaign_summary import refusal_reasons, rerun_command, worst_table
from cosim.campaigns.analysis.statistics import Facts, effect, quantiles, rate
from cosim.campaigns.runner import Campaign, carry_out
from cosim.campaigns.store.results import Results
from cosim.campaigns.sweeps.design import Design
from cosim.campaigns.sweeps.sweep_rows import SweepWork
from cosim.scenario.key_names import key_name
from cosim.scenario.law_factory import OwnLaw, own_law, read_law
from cosim.scenario.scenario import Scenario, to_scenario
from cosim.simulation.signals import Array

FACTS = ("reached", "settled", "violated")  # columns with rates
SPREADS = ("reach_time", "settle_time", "min_clearance", "effort", "max_force", "max_speed")  # columns with quantiles


def run_sweep(
    scenario: Scenario | str | Path,
    design: Design,
    out: str | Path,
    *,
    law: str | Law | OwnLaw | None = None,
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
    law : Law or str, optional
        Custom law instead of the scenario's: ``"file.py:name"`` of a law, a function, or a class; or a law, such as a
        `FunctionLaw`. Each flight has a copy.
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
    own = read_law(law) if isinstance(law, str) else None if law is None else own_law(law)
    work, out = SweepWork(to_scenario(scenario), design, own), Path(out)
    return carry_out(work, out, lambda results: summarize_sweep(work, results, out), workers, executor, progress)


def summarize_sweep(work: SweepWork, results: Results, folder: Path) -> dict[str, Any]:
    """Summarize a sweep."""
    is_flown, base = results.is_null("refused"), work.variation.base
    return {
        "name": work.name,
        "title": base.title,
        "words": {key: key_name(key, base.table, base.vehicle).label for key in work.variation.keys},
        "rows": len(results),
        "flown": int(is_flown.sum()),
        "refused": int((~is_flown).sum()),
        "reasons": refusal_reasons(results),
        "stopped": int(np.isfinite(results.number("stopped_at")).sum()),
        **{name: rate(results.fact(name)[is_flown]) for name in FACTS},
        "quantiles": {name: quantiles(results.number(name)) for name in SPREADS},
        "worst": worst_table(results, folder),
        "best": _best(work, results, folder),
        "effects": _measure_keys(work, results, is_flown, effect),
        "rank_correlations": _measure_keys(work, results, is_flown, _rank_correlation),
        **{key: value for key, value in work.plan.items() if key != "name"},
    }


def _best(work: SweepWork, results: Results, folder: Path) -> dict[str, Any] | None:
    """Return the row that settled first, of those without a violation, where keys of law and arbiter vary alone."""
    time = results.number("settle_time")
    sound = results.fact("settled") & ~results.fact("violated") & np.isfinite(time)
    if not sound.any() or not all(key.startswith(("law.", "arbiter.")) for key in work.variation.keys):
        return None
    i = int(np.where(sound, time, np.inf).argmin())
    row = int(results.number("row")[i])
    changes = " ".join(f"--set {key}={results.number(key)[i]:.4g}" for key in work.variation.keys)
    return {"row": row, "settle_time": time[i], "changes": changes, "command": rerun_command(folder, row)}


def _measure_keys(
    work: SweepWork, results: Results, flown: Facts, measure: Callable[[Array, Array], dict[str, float] | None]
) -> dict[str, dict[str, Any]]:
    """Return a measure of each key with each outcome, over the flown rows with a finite outcome."""
    keys = {key: results.number(key) for key in work.variation.keys}
    measures: dict[str, dict[str, Any]] = {key: {} for key in keys}
    for name, (kind, _, _) in FIELDS.items():
        outcome = results.fact(name).astype(float) if kind is np.bool_ else results.number(name)
        rows = flown & np.isfinite(outcome)
        for key, values in keys.items():
            measures[key][name] = measure(values[rows], outcome[rows])
    return measures


def _rank_correlation(values: Array, outcome: Array) -> dict[str, float] | None:
    if len(values) < 3 or np.ptp(values) == 0.0 or np.ptp(outcome) == 0.0:
        return None
    from scipy.stats import spearmanr  # as in `cosim.campaigns.analysis.statistics`

    result = spearmanr(values, outcome)
    return {"rho": float(result.statistic), "p": float(result.pvalue)}
