"""Summary of a campaign and its worst rows, computed from its rows alone."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cosim.campaigns.analysis.statistics import Facts, quantiles, rate
from cosim.campaigns.scenes.kinds import scene_kinds
from cosim.campaigns.store.results import Results
from cosim.simulation.signals import Array

SPREADS = ("reach_time", "min_clearance", "effort", "thrust_variation")  # columns with quantiles
OF_ALL = ("min_clearance",)  # columns with quantiles over all scenes; the others over those that were reached
LISTED = 10  # maximum number of rows that summaries and pages list
_REASONS = 5  # maximum number of listed reasons for refusing rows
MEDIANS = ("reach_time", "effort", "thrust_variation", "min_clearance", "worst_step_time")  # columns with medians


def summarize_campaign(plan: Mapping[str, Any], results: Results, folder: Path) -> dict[str, Any]:
    """Summarize a campaign."""
    reached, violation, seeds = results["reached"], results["violation"], results["seed"]
    stopped = ~results.is_null("stopped_at")
    return {
        "law": plan["law"],
        "scenes": len(results),
        "reached": int(reached.sum()),
        "violations": int(violation.sum()),
        "stopped": int(stopped.sum()),
        "refused": int((~results.is_null("refused")).sum()),
        "reasons": refusal_reasons(results),
        **_spread(results, np.ones(len(results), dtype=bool)),
        "kinds": {
            name: {"scenes": int(rows.sum()), **_spread(results, rows)} for name, rows in scene_kinds(results).groups()
        },
        "medians": {name: median(results.number(name)[reached]) for name in MEDIANS},
        "least_clearance": _finite(np.min, results.number("min_clearance")),
        "mean_weighted_violation": _finite(np.mean, results.number("weighted_violation")),
        "bound_exceeded": int((results.number("bound_excess") > 0.0).sum()),
        "mean_bound_promised": _finite(np.mean, results.number("bound_promised")),
        "healthy_weakened": int(results.fact("healthy_weakened").sum()),
        "worst_step_time": _finite(np.max, results.number("worst_step_time")),
        "failed": {
            "not_reached": seeds[~reached].tolist(),
            "violated": seeds[violation].tolist(),
            "stopped": seeds[stopped].tolist(),
        },
        "worst": worst_table(results, folder),
        "report_failures": plan["conditions"]["report_failures"],
        **{key: value for key, value in plan.items() if key not in ("law", "scenes")},
    }


def rates_of(results: Results) -> dict[str, Facts]:
    """Return the masks of scenes that were completed, reached and violated, shape (scenes,) each."""
    reached, violation = results["reached"], results["violation"]
    return {"completed": reached & ~violation, "reached": reached, "violation": violation}


def _spread(results: Results, rows: Facts) -> dict[str, Any]:
    """Return rates and quantiles over a mask of scenes, shape (scenes,)."""
    reached = results["reached"]
    return {
        "rates": {name: rate(happened[rows]) for name, happened in rates_of(results).items()},
        "quantiles": {
            name: quantiles(results.number(name)[rows if name in OF_ALL else rows & reached]) for name in SPREADS
        },
    }


def refusal_reasons(results: Results) -> dict[str, str]:
    """Return the reasons for refusing the first refused rows, by key."""
    first = np.flatnonzero(~results.is_null("refused"))[:_REASONS]
    keys = results[results.schema.names[0]][first]
    return {str(key): str(reason) for key, reason in zip(keys, results["refused"][first], strict=True)}


def median(values: Array) -> float | None:
    """Return the median of numbers without NaN; None if it is not finite, or without numbers."""
    return _finite(np.median, values)


def _finite(statistic: Any, values: Array) -> float | None:
    """Return a statistic of the numbers without NaN; None if it is not finite, or without numbers."""
    values = values[~np.isnan(values)]
    result = float(statistic(values)) if values.size else np.nan
    return result if np.isfinite(result) else None


def violated_column(results: Results) -> str:
    """Return the name of the column of violations, which scenes and sweeps call differently."""
    return "violation" if "violation" in results.schema.names else "violated"


def worst_table(results: Results, folder: Path, count: int = LISTED) -> list[dict[str, Any]]:
    """Return the worst rows but refused ones, each with its key, the reason, and the command that repeats it."""
    names = results.schema.names
    keys, reached = results[names[0]], results.fact("reached")
    stopped = results.number("stopped_at")
    violated = results.fact(violated_column(results)) | np.isfinite(stopped)
    clearance, time = results.number("min_clearance"), results.number("reach_time")
    depth = np.where(np.isfinite(clearance), np.maximum(-clearance, 0.0), 0.0)
    shortfall = results.number("closest_to_goal", 0.0) if "closest_to_goal" in names else np.zeros(len(keys))
    group = np.where(violated, 0, np.where(reached, 2, 1))
    badness = np.select([group == 0, group == 1], [depth, shortfall], np.nan_to_num(time))
    flown = np.flatnonzero(results.is_null("refused"))
    order = flown[np.lexsort((keys[flown], -badness[flown], group[flown]))][: max(count, 0)]
    worst = []
    for i in order:
        if np.isfinite(stopped[i]):
            why = f"stopped at {stopped[i]:.2f} s"
        elif violated[i]:
            why = f"violated, {depth[i]:.3f} m deep" if depth[i] > 0.0 else "violated"
        elif not reached[i]:
            why = f"not reached, {shortfall[i]:.2f} m short" if shortfall[i] > 0.0 else "not reached"
        else:
            why = f"reached at {time[i]:.2f} s"
        worst.append({"row": int(keys[i]), "why": why, "command": rerun_command(folder, int(keys[i]))})
    return worst


def rerun_command(folder: Path, key: int) -> str:
    """Return the command that repeats a row."""
    return f"cosim rerun {shlex.quote(str(folder))} {key}"
