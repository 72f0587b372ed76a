"""Summary of a sweep, computed from its rows alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cosim.batch.outcome import FIELDS
from cosim.campaigns.analysis.statistics import Facts, effect, quantiles, rate
from cosim.campaigns.analysis.worst_rows import worst_table
from cosim.campaigns.store.results import Results
from cosim.campaigns.sweeps.rows import SweepWork
from cosim.scenario.key_names import key_name
from cosim.simulation.signals import Array

FACTS = ("reached", "settled", "violated")  # columns with rates
SPREADS = ("reach_time", "settle_time", "min_clearance", "effort", "max_force", "max_speed")  # columns with quantiles
_REASONS = 5  # greatest number of listed reasons for refusing rows


def summarize_sweep(work: SweepWork, results: Results, folder: Path) -> dict[str, Any]:
    """Summarize a sweep."""
    flown, base = results.absent("refused"), work.variation.base
    return {
        "name": work.name,
        "title": base.title,
        "words": {key: key_name(key, base.table, base.vehicle).label for key in work.variation.keys},
        "rows": len(results),
        "flown": int(flown.sum()),
        "refused": int((~flown).sum()),
        "reasons": _reasons(results, flown),
        "stopped": int(np.isfinite(results.number("stopped_at")).sum()),
        **{name: rate(results.fact(name)[flown]) for name in FACTS},
        "quantiles": {name: quantiles(results.number(name)) for name in SPREADS},
        "worst": worst_table(results, folder),
        "effects": _of_keys(work, results, flown, effect),
        "rank_correlations": _of_keys(work, results, flown, _rank_correlation),
        **{key: value for key, value in work.plan.items() if key != "name"},
    }


def _reasons(results: Results, flown: Facts) -> dict[str, str]:
    """Return the reasons for refusing the first refused rows, by number."""
    first = np.flatnonzero(~flown)[:_REASONS]
    return {str(row): str(why) for row, why in zip(results["row"][first], results["refused"][first], strict=True)}


def _of_keys(
    work: SweepWork,
    results: Results,
    flown: Facts,
    measure: Callable[[Array, Array], dict[str, float] | None],
) -> dict[str, dict[str, Any]]:
    """Return a measure of each key with each outcome, over the flown rows with a finite outcome."""
    keys = {key: results.number(key) for key in work.variation.keys}
    found: dict[str, dict[str, Any]] = {key: {} for key in keys}
    for name, (kind, _, _) in FIELDS.items():
        outcome = results.fact(name).astype(float) if kind is np.bool_ else results.number(name)
        there = flown & np.isfinite(outcome)
        for key, values in keys.items():
            found[key][name] = measure(values[there], outcome[there])
    return found


def _rank_correlation(one: Array, other: Array) -> dict[str, float] | None:
    if len(one) < 3 or np.all(one == one[0]) or np.all(other == other[0]):
        return None
    from scipy.stats import spearmanr  # as in `cosim.campaigns.analysis.statistics`

    result = spearmanr(one, other)
    return {"rho": float(result.statistic), "p": float(result.pvalue)}
