"""Run a search and write its folder: rows requested by the search, random ones for comparison, and a summary."""

from __future__ import annotations

import contextlib
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from cosim.campaigns.analysis.worst_rows import rerun_command, violated_column
from cosim.campaigns.falsification.search import minimize
from cosim.campaigns.falsification.splitting import estimate_probability
from cosim.campaigns.falsification.work import Objective, ScenarioSearch, SceneSearch
from cosim.campaigns.runner import open_pool, progress_bar, warn_refused
from cosim.campaigns.store.columns import to_array
from cosim.campaigns.store.folder import SUMMARY, CampaignFolder
from cosim.campaigns.store.results import Results
from cosim.campaigns.workers.batch_sizing import Batches
from cosim.campaigns.workers.dispatch import fly_all
from cosim.campaigns.workers.worker import flyer_held
from cosim.campaigns.workers.worker_pools import WorkerPool
from cosim.errors import RunError
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text

RANDOM = "random"  # folder of the campaign with as many random rows
LISTED = 10  # greatest number of worst rows that are listed
_COLUMNS = {"clearance": "min_clearance", "violation": "weighted_violation", "arrival": "reach_time"}
_REFUSED = 1e9  # cost of a row that was not flown, which the search avoids
_STOPPED = -1e-6  # m, greatest clearance of a flight that the plant stopped, which counts as a violation
_APART = 0.1  # least distance between listed rows: root mean square over the coordinates

Search = SceneSearch | ScenarioSearch


@dataclass(frozen=True)
class Falsification:
    """Folder, results and summary of a search."""

    folder: Path
    results: Results
    summary: dict[str, Any]
    flown: int  # number of rows flown by this call; the others were in the folder


class _Flights:
    """Fly the rows that a search requests, and store them in the folder."""

    def __init__(self, work: Search, folder: CampaignFolder, pool: WorkerPool, bar: Any) -> None:
        self._work, self._folder, self._pool, self._bar = work, folder, pool, bar
        self._known = folder.rows()
        self._keys = to_array(self._known.column(0))
        self._time, self.flown, self._refused = 0.0, 0, 0
        self.points = np.empty((0, work.dimension))

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the costs of points, shape (n,); fly those that are not in the folder."""
        rows = self._work.add(points)
        self.points = np.concatenate([self.points, points])
        known = np.isin(rows, self._keys)
        tables = [self._known.filter(pa.array(np.isin(self._keys, rows)))]
        if not known.all():
            batches, started = Batches(rows[~known]), time.perf_counter()
            if self.flown:
                batches.measured(self.flown, self._time)
            for table in fly_all(self._work, batches, self._pool):
                self._folder.add(table)
                self._bar.update(len(table))
                self._refused = warn_refused(table, self._refused)
                tables.append(table)
            self.flown, self._time = self.flown + int((~known).sum()), self._time + time.perf_counter() - started
        flown = pa.concat_tables(tables)
        return costs_of(flown.sort_by(flown.schema.names[0]), self._work.settings.objective, self._work.horizon)


def run_falsification(work: Search, out: Path, workers: int = 1, progress: bool = False) -> Falsification:
    """Search for the worst rows, or estimate the probability of a violation, and write results and summary."""
    settings = work.settings
    estimate = None
    with flyer_held(work.task), CampaignFolder(out, work) as folder:
        with (
            contextlib.closing(open_pool(work.task, workers)) as pool,
            progress_bar(work, len(folder.rows()), progress) as bar,
        ):
            flights = _Flights(work, folder, pool, bar)
            if settings.rare_event:
                estimate = estimate_probability(flights, work.dimension, settings.budget, settings.seed)
            else:
                minimize(flights, work.dimension, settings.budget, settings.seed)
        results = folder.results() if folder.complete else folder.join()
        folder.remove_parts()
        random = None if settings.rare_event else work.fly_random(out / RANDOM, workers, progress)
        try:
            summary = _summarize(work, out, results, random, flights.points)
            summary["estimate"] = estimate and asdict(estimate)
            write_atomic(out / SUMMARY, json_text(summary))
        except OSError as error:
            raise RunError(f"{out}: {error.strerror or error}; what is flown is kept") from error
    return Falsification(out, results, summary, flights.flown)


def costs_of(rows: Any, objective: Objective, horizon: float) -> NDArray[np.float64]:
    """Return the costs that a search minimizes; horizon [s], returns (rows,) [m]."""
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
    """Return the number of rows of each kind, and the rows at which the least cost so far decreases."""
    least = np.minimum.accumulate(costs)
    falls = np.flatnonzero(np.diff(least, prepend=np.inf) < 0.0)
    return {
        "flown": len(results),
        "best": [[int(i) + 1, float(least[i])] for i in falls if least[i] < _REFUSED],
        "violations": int((results.fact(violated_column(results)) & results.absent("refused")).sum()),
        "not_reached": int((~results.fact("reached") & results.absent("refused")).sum()),
        "refused": int((~results.absent("refused")).sum()),
    }


def _worst(
    folder: Path, results: Results, costs: NDArray[np.float64], points: NDArray[np.float64] | None
) -> list[dict[str, Any]]:
    """Return the worst rows, at least `_APART` from each other."""
    found: list[int] = []
    for i in np.argsort(costs, kind="stable").tolist():
        if len(found) == LISTED or costs[i] == _REFUSED:
            break
        if points is None or not found or _distance(points[found] - points[i]).min() > _APART:
            found.append(i)
    keys = results[results.schema.names[0]]
    return [
        {"row": int(keys[i]), "cost": float(costs[i]), "command": rerun_command(folder, int(keys[i]))} for i in found
    ]


def _distance(differences: NDArray[np.float64]) -> NDArray[np.float64]:
    found: NDArray[np.float64] = np.sqrt(np.mean(differences**2, axis=1))
    return found
