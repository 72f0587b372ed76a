"""What a campaign comes to: numbers from its rows alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim.campaigns.plan import Plan
from cosim.campaigns.results import Results
from cosim.signals import Array

MEDIANS = ("reach_time", "effort", "thrust_variation", "min_clearance", "worst_step_time")


def summarise(plan: Plan, results: Results) -> dict[str, Any]:
    """Return the summary of a campaign.

    Parameters
    ----------
    plan : Plan
        What was flown.
    results : Results
        What came of it.

    Returns
    -------
    dict
        Ready for JSON: counts, medians over the scenes that were reached (None where there are none), the seeds that
        failed, and the plan. Units as in the columns of the results.
    """
    reached, violation, seeds = results["reached"], results["violation"], results["seed"]
    stopped = ~np.isnan(results.number("stopped_at"))
    return {
        "law": plan.law,
        "scenes": len(results),
        "reached": int(reached.sum()),
        "violations": int(violation.sum()),
        "stopped": int(stopped.sum()),
        "medians": {name: median(results.number(name)[reached]) for name in MEDIANS},
        "least_clearance": _or_none(np.min, results.number("min_clearance")),
        "worst_step_time": _or_none(np.max, results.number("worst_step_time")),
        "failed": {
            "not_reached": seeds[~reached].tolist(),
            "violated": seeds[violation].tolist(),
            "stopped": seeds[stopped].tolist(),
        },
        "tell_failures": plan.conditions.tell_failures,
        **{key: value for key, value in plan.table().items() if key not in ("law", "scenes")},
    }


def median(values: Array) -> float | None:
    """Return the median of numbers, None of none, or where it is no finite number."""
    return _or_none(np.median, values[~np.isnan(values)])


def _or_none(of: Any, values: Array) -> float | None:
    values = values[~np.isnan(values)]
    result = float(of(values)) if values.size else np.nan
    return result if np.isfinite(result) else None
