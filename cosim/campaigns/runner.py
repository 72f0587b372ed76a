"""Runs the work of a campaign: flies the rows that are left, and joins them in its folder."""

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

from cosim.campaigns.store.folder import CampaignFolder
from cosim.campaigns.store.results import Results
from cosim.campaigns.workers.batch_sizing import Batches
from cosim.campaigns.workers.dispatch import fly_all
from cosim.campaigns.workers.work import Task, Work
from cosim.campaigns.workers.worker import flyer_held
from cosim.campaigns.workers.worker_pools import ExternalExecutor, InProcess, Processes, WorkerPool
from cosim.errors import RunError
from cosim.run.progress import ProgressBar

log = logging.getLogger(__name__)

_MAX_WARNINGS = 3  # greatest number of refused rows that are logged one by one


@dataclass(frozen=True)
class Done:
    """Results of a complete campaign."""

    results: Results
    flown: int  # number of rows flown by this call


def carry_out(
    work: Work,
    out: Path,
    workers: int = 1,
    executor: Executor | None = None,
    progress: bool = False,
    conclude: Callable[[Results], None] = lambda results: None,
) -> Done:
    """Fly the rows of a campaign that are left, and join them all to one file."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):  # as multiprocessing itself checks
        raise RunError(
            "a worker process runs the script again, and reached this call; "
            "expected it below: if __name__ == '__main__':"
        )
    if workers < 1:
        raise RunError(f"workers is {workers}, expected 1 or more")
    with flyer_held(work.task), CampaignFolder(out, work) as folder:
        flown = 0
        try:
            if folder.complete:
                folder.remove_parts()
                results = folder.results()
            else:
                for table in _flown(work, folder, workers, executor, progress):
                    folder.add(table)
                    flown += len(table)
                results = folder.join()
                folder.remove_parts()
            conclude(results)
        except OSError as error:
            raise RunError(
                f"{out}: {error.strerror or error}; what is flown is kept, and the same command goes on"
            ) from error
    return Done(results, flown)


def _flown(
    work: Work, folder: CampaignFolder, workers: int, executor: Executor | None, progress: bool
) -> Iterator[Any]:
    """Fly the rows that are not in the folder yet, yield their tables, and show progress."""
    left = np.ones(len(work), dtype=bool)
    keys = folder.keys()
    rows = work.rows_of(keys)
    if (rows < 0).any():
        key = keys[np.argmin(rows)]
        raise RunError(f"{folder.path}: a part holds the {work.unit} {key}, which is not of this campaign")
    left[rows] = False
    batches, n, refused = Batches(np.flatnonzero(left)), int(left.sum()), 0
    with (
        contextlib.closing(open_pool(work.task, workers, executor) if n else InProcess()) as pool,
        progress_bar(work, len(work) - n, progress) as bar,
        contextlib.closing(fly_all(work, batches, pool)) as tables,
    ):
        for table in tables:
            yield table
            bar.update(len(table))
            refused = warn_refused(table, refused)
    if refused > _MAX_WARNINGS:
        log.warning("%d %ss were refused; why is in their column 'refused'", refused, work.unit)


def open_pool(task: Task, workers: int, executor: Executor | None = None) -> WorkerPool:
    """Open the worker pool: this process, worker processes, or an executor."""
    if executor is not None:
        from cosim.campaigns.workers.cluster import Cluster, is_cluster

        return Cluster(executor) if is_cluster(executor) else ExternalExecutor(executor, workers)
    return Processes(workers, task) if workers > 1 else InProcess()


def warn_refused(table: Any, before: int) -> int:
    """Log the reasons of the first refused rows; return the number of refused rows so far."""
    rows = table.filter(pc.is_valid(table["refused"]))
    for row in rows.slice(0, max(0, _MAX_WARNINGS - before)).to_pylist():
        key = table.schema.names[0]
        log.warning("%s %d: refused: %s", key, row[key], row["refused"])
    return before + len(rows)


def progress_bar(work: Work, done: int, progress: bool) -> ProgressBar:
    """Create a progress bar over the rows of a work, `done` of which are finished."""
    return ProgressBar(
        progress, total=len(work), initial=done, desc=work.name, unit=work.unit,
        bar_format="{desc} {percentage:3.0f}%|{bar}| {n}/{total} [{elapsed}<{remaining}, {rate_fmt}]",
    )  # fmt: skip
