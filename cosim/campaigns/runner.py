"""Run a campaign: fly the missing rows, join them in a folder, and write their summary."""

from __future__ import annotations

import contextlib
import logging
import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.compute as pc

from cosim.campaigns.store.folder import CampaignFolder, campaign_folder
from cosim.campaigns.store.results import Results
from cosim.campaigns.workers.dispatch import Batches, fly_all
from cosim.campaigns.workers.work import Rows, Task, Work
from cosim.campaigns.workers.worker import hold_flyer
from cosim.campaigns.workers.worker_pools import ExternalExecutor, Processes, WorkerPool
from cosim.errors import RunError
from cosim.run.progress import ProgressBar

log = logging.getLogger(__name__)

_MAX_WARNINGS = 3  # maximum number of refused rows that are logged one by one


@dataclass(frozen=True)
class Campaign:
    r"""Folder, rows and summary of a campaign, a sweep, or a search.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> campaign = cosim.run_campaign(Path("scenes.jsonl"), "pd", Path("pd"))
    >>> campaign.flown, len(campaign.results)
    (2, 2)
    """

    folder: Path
    results: Results
    summary: dict[str, Any]
    flown: int  # number of rows flown by this call


class Flights:
    """Flies rows of a work by a pool, and stores them in the work's folder."""

    def __init__(self, work: Work, folder: CampaignFolder, pool: WorkerPool, bar: ProgressBar) -> None:
        self._work, self._folder, self._pool, self._bar = work, folder, pool, bar
        self._batches = Batches()
        self.flown = self._refused = 0

    def fly(self, rows: Rows) -> Iterator[Any]:
        """Fly rows, shape (n,), and yield their tables as they finish."""
        self._batches.add(rows)
        with contextlib.closing(fly_all(self._work, self._batches, self._pool)) as tables:
            for table in tables:
                self._folder.log.add(table)
                self.flown += len(table)
                self._bar.update(len(table))
                self._warn_refused(table)
                yield table

    def _warn_refused(self, table: Any) -> None:
        """Log the reasons of the first refused rows."""
        rows = table.filter(pc.is_valid(table["refused"]))
        for row in rows.slice(0, max(0, _MAX_WARNINGS - self._refused)).to_pylist():
            key = table.schema.names[0]
            log.warning("%s %d: refused: %s", key, row[key], row["refused"])
        self._refused += len(rows)

    def finish(self) -> None:
        """Stop the workers, and log how many rows were refused, if not each has been logged."""
        self._pool.close()
        if self._refused > _MAX_WARNINGS:
            log.warning("%d %ss were refused; why is in their column 'refused'", self._refused, self._work.unit)


@contextlib.contextmanager
def open_flights(
    work: Work, out: Path, workers: int = 1, executor: Executor | None = None, progress: bool = False
) -> Iterator[tuple[CampaignFolder, Flights]]:
    """Claim the folder of a work, and start its workers, for a block."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # as multiprocessing itself checks
        raise RunError(
            "a worker process runs the script again, and reached this call; "
            "expected it below: if __name__ == '__main__':"
        )
    if workers < 1:
        raise RunError(f"workers is {workers}, expected 1 or more")
    with hold_flyer(work.task), campaign_folder(out, work) as folder:
        done = len(work) if folder.complete else len(folder.log.keys())
        with (
            contextlib.closing(open_pool(work.task, workers, executor) if done < len(work) else WorkerPool()) as pool,
            ProgressBar(
                progress, total=len(work), initial=done, desc=work.name, unit=work.unit,
                bar_format="{desc} {percentage:3.0f}%|{bar}| {n}/{total} [{elapsed}<{remaining}, {rate_fmt}]",
            ) as bar,
        ):  # fmt: skip
            yield folder, Flights(work, folder, pool, bar)


def carry_out(
    work: Work,
    out: Path,
    summarize: Callable[[Results], dict[str, Any]],
    workers: int = 1,
    executor: Executor | None = None,
    progress: bool = False,
) -> Campaign:
    """Fly the missing rows of a campaign, join all to one file, and write their summary."""
    with open_flights(work, out, workers, executor, progress) as (folder, flights):
        if not folder.complete:
            left, keys = np.ones(len(work), dtype=bool), folder.log.keys()
            rows = work.rows_of(keys)
            if (rows < 0).any():
                key = keys[np.argmin(rows)]
                raise RunError(f"{out}: holds the {work.unit} {key}, which is not of this campaign")
            left[rows] = False
            for _ in flights.fly(np.flatnonzero(left)):
                pass
        flights.finish()
        results = folder.join()
        return Campaign(out, results, folder.conclude(summarize(results)), flights.flown)


def open_pool(task: Task, workers: int, executor: Executor | None = None) -> WorkerPool:
    """Open the worker pool: this process, worker processes, or an executor."""
    if executor is not None:
        from cosim.campaigns.workers.cluster import Cluster, is_cluster

        return Cluster(executor) if is_cluster(executor) else ExternalExecutor(executor, workers)
    return Processes(workers, task) if workers > 1 else WorkerPool()
