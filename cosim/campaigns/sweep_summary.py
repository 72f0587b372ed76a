"""What a sweep comes to: numbers from its rows alone."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest, spearmanr

from cosim.campaigns.results import Results
from cosim.campaigns.sweep_rows import SweepWork
from cosim.flying.outcome import FIELDS
from cosim.signals import Array

Facts = NDArray[np.bool_]

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
FACTS = ("reached", "settled", "violated")  # whose rates are told
SPREADS = ("reach_time", "min_clearance", "effort")  # whose quantiles are told
_CONFIDENCE = 0.95
_WORST = 5  # rows of each kind
_REASONS = 5  # why rows were refused


def summarise_sweep(work: SweepWork, results: Results, folder: Path) -> dict[str, Any]:
    """Return the summary of a sweep.

    Parameters
    ----------
    work : SweepWork
        What was flown.
    results : Results
        What came of it.
    folder : Path
        Where they are, for the commands that repeat rows.

    Returns
    -------
    dict
        Ready for JSON: counts, and why the first rows were refused; rates with 95 % intervals by Wilson, of the rows
        that were flown; quantiles (None where there is nothing); the worst rows; rank correlations by Spearman of
        every key with every outcome, None where either is constant; and the plan.
        Units as in the columns of the results.
    """
    flown = results.absent("refused")
    return {
        "name": work.name,
        "rows": len(results),
        "flown": int(flown.sum()),
        "refused": int((~flown).sum()),
        "reasons": _reasons(results, flown),
        "stopped": int(np.isfinite(results.number("stopped_at")).sum()),
        **{name: _rate(results.fact(name)[flown]) for name in FACTS},
        "quantiles": {name: quantiles(results.number(name)) for name in SPREADS},
        "worst": _worst(results, flown, folder),
        "rank_correlations": _correlations(work, results, flown),
        **{key: value for key, value in work.plan.items() if key != "name"},
    }


def _reasons(results: Results, flown: Facts) -> dict[str, str]:
    """Return why the first rows were refused, by their number."""
    first = np.flatnonzero(~flown)[:_REASONS]
    return {str(row): str(why) for row, why in zip(results["row"][first], results["refused"][first], strict=True)}


def _rate(happened: Facts) -> dict[str, Any]:
    """Return how many, which share of all, and the 95 % interval of it by Wilson."""
    n, k = len(happened), int(happened.sum())
    if not n:
        return {"rows": 0, "share": None, "low": None, "high": None}
    interval = binomtest(k, n).proportion_ci(_CONFIDENCE, method="wilson")
    return {"rows": k, "share": k / n, "low": float(interval.low), "high": float(interval.high)}


def quantiles(values: Array) -> dict[str, float | None]:
    """Return quantiles of numbers that there are and that are finite.

    Parameters
    ----------
    values : ndarray, shape (n,)
        NaN where there is none.

    Returns
    -------
    dict of str to float or None
        By the quantile, such as ``"0.5"``.
    """
    values = values[np.isfinite(values)]
    found = np.quantile(values, QUANTILES) if values.size else [None] * len(QUANTILES)
    return {str(q): None if x is None else float(x) for q, x in zip(QUANTILES, found, strict=True)}


def _worst(results: Results, flown: Facts, folder: Path) -> list[dict[str, Any]]:
    """Return the rows that most deserve a look, each with why, and the command that repeats it."""
    rows, found = results["row"], []
    clearance, distance, stopped = (results.number(n) for n in ("min_clearance", "closest_to_goal", "stopped_at"))
    for why, column, order, which in (
        ("stopped early", "stopped_at", stopped, np.isfinite(stopped)),
        ("least clearance", "min_clearance", clearance, np.isfinite(clearance)),
        ("farthest from the goal", "closest_to_goal", -distance, np.isfinite(distance) & (distance > 0.0)),
    ):
        candidates = np.flatnonzero(which & flown)
        for i in candidates[np.argsort(order[candidates], kind="stable")][:_WORST]:
            value = float(abs(order[i]) if column == "closest_to_goal" else order[i])
            command = f"cosim rerun {shlex.quote(str(folder))} {rows[i]}"
            found.append({"row": int(rows[i]), "why": why, column: value, "command": command})
    return found


def _correlations(work: SweepWork, results: Results, flown: Facts) -> dict[str, dict[str, Any]]:
    keys = {key: results.number(key) for key in work.variation.keys}
    found: dict[str, dict[str, Any]] = {key: {} for key in keys}
    for name, (kind, _, _) in FIELDS.items():
        if kind is np.bool_:
            outcome, there = results.fact(name).astype(float), flown
        else:
            outcome = results.number(name)
            there = ~np.isnan(outcome)
        for key, values in keys.items():
            found[key][name] = _rank_correlation(values[there], outcome[there])
    return found


def _rank_correlation(one: Array, other: Array) -> dict[str, float] | None:
    if len(one) < 3 or np.all(one == one[0]) or np.all(other == other[0]):
        return None
    result = spearmanr(one, other)
    return {"rho": float(result.statistic), "p": float(result.pvalue)}
