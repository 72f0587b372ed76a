"""Run a search and write its folder: rows requested by the search, random ones for comparison, and a summary."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from cosim.campaigns.analysis.campaign_summary import LISTED, rerun_command, violated_column
from cosim.campaigns.falsification.search import minimize
from cosim.campaigns.falsification.search_work import Objective, ScenarioSearch, SceneSearch
from cosim.campaigns.falsification.splitting import estimate_probability
from cosim.campaigns.runner import Campaign, open_flights
from cosim.campaigns.store.results import Results, to_array, to_column

RANDOM = "random"  # folder of the campaign with as many random rows
_COLUMNS = {"clearance": "min_clearance", "violation": "weighted_violation", "arrival": "reach_time"}
_REFUSED = 1e9  # cost of a row that was not flown, which the search avoids
_STOPPED = -1e-6  # m, maximum clearance of a flight that the plant stopped, which counts as a violation
_APART = 0.1  # minimum distance between listed rows: root mean square over the coordinates

Search = SceneSearch | ScenarioSearch


def run_falsification(work: Search, out: Path, workers: int = 1, progress: bool = False) -> Campaign:
    """Search for the worst rows, or estimate the probability of a violation, and write results and summary."""
    settings, estimate, random = work.settings, None, None
    points: list[NDArray[np.float64]] = []  # those of all rows
    with open_flights(work, out, workers, progress=progress) as (folder, flights):
        stored = folder.rows()
        keys = to_array(stored.column(0))

        def evaluate(requested: NDArray[np.float64]) -> NDArray[np.float64]:
            """Return the costs of points, shape (n,); fly those that are not in the folder."""
            points.append(requested)
            rows = work.add(requested)
            known = stored.filter(to_column(pa.bool_(), np.isin(keys, rows)))
            flown = pa.concat_tables([known, *flights.fly(rows[~np.isin(rows, keys)])])
            return costs_of(flown.sort_by(flown.schema.names[0]), settings.objective, work.horizon)

        if settings.rare_event:
            estimate = asdict(estimate_probability(evaluate, work.dimension, settings.budget, settings.seed))
        else:
            minimize(evaluate, work.dimension, settings.budget, settings.seed)
        flights.finish()
        results = folder.join()
        if not settings.rare_event:
            random = work.fly_random(out / RANDOM, workers, progress)
        summary = _summarize(work, out, results, random, np.concatenate(points)) | {"estimate": estimate}
        return Campaign(out, results, folder.conclude(summary), flights.flown)


def costs_of(rows: Any, objective: Objective, horizon: float) -> NDArray[np.float64]:
    """Return the costs that a search minimizes, in the unit of the objective; horizon [s]."""
    values = to_array(rows[_COLUMNS[objective]]).astype(float)
    if objective == "clearance":
        values = np.where(to_array(pc.is_null(rows["stopped_at"])), values, np.fmin(values, _STOPPED))
        costs = np.nan_to_num(values, nan=_REFUSED, posinf=_REFUSED)
    else:
        costs = -np.nan_to_num(values, nan=horizon if objective == "arrival" else 0.0)
    return np.where(to_array(pc.is_null(rows["refused"])), costs, _REFUSED)


def _summarize(
    work: Search, out: Path, results: Results, random: Results | None, points: NDArray[np.float64]
) -> dict[str, Any]:
    costs = costs_of(results.table, work.settings.objective, work.horizon)
    summary = {
        "title": work.title,
        "horizon": work.horizon,
        **_counts(results, costs),
        "worst": _worst(out, results, costs, points),
        "random": None,
        **work.plan,
    }
    if random is not None:
        others = costs_of(random.table, work.settings.objective, work.horizon)
        summary["random"] = _counts(random, others) | {"worst": _worst(out / RANDOM, random, others, None)}
    return summary


def _counts(results: Results, costs: NDArray[np.float64]) -> dict[str, Any]:
    """Return the number of rows of each kind, and the rows at which the lowest cost so far decreases."""
    min_cost, flown = np.minimum.accumulate(costs), results.is_null("refused")
    falls = np.flatnonzero(np.diff(min_cost, prepend=np.inf) < 0.0)
    return {
        "flown": len(results),
        "best": [[int(i) + 1, float(min_cost[i])] for i in falls if min_cost[i] < _REFUSED],
        "violations": int((results.fact(violated_column(results)) & flown).sum()),
        "not_reached": int((~results.fact("reached") & flown).sum()),
        "refused": int((~flown).sum()),
    }


def _worst(
    folder: Path, results: Results, costs: NDArray[np.float64], points: NDArray[np.float64] | None
) -> list[dict[str, Any]]:
    """Return the worst rows, at least `_APART` from each other."""
    listed_rows: list[int] = []
    for i in np.argsort(costs, kind="stable").tolist():
        if len(listed_rows) == LISTED or costs[i] == _REFUSED:
            break
        if (
            points is None
            or not listed_rows
            or np.sqrt(np.mean((points[listed_rows] - points[i]) ** 2, axis=1)).min() > _APART
        ):
            listed_rows.append(i)
    keys = results[results.schema.names[0]].tolist()
    return [{"row": keys[i], "cost": float(costs[i]), "command": rerun_command(folder, keys[i])} for i in listed_rows]
