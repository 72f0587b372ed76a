"""Cuts rows into batches, and dispatches them until each row is finished, or refused because it crashes its worker."""

from __future__ import annotations

import logging
import math
from collections.abc import Generator
from concurrent.futures import FIRST_COMPLETED, wait
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.campaigns.workers.work import Rows, Work
from cosim.campaigns.workers.worker_pools import FATAL, Flight, WorkerCrash, WorkerPool
from cosim.errors import RunError

log = logging.getLogger(__name__)

KILLED = "the process that flew it crashed each time (killed, or out of memory)"
_CHECK_PERIOD = 5.0  # s between checks of the pool while no batch finishes
_MAX_CRASHES = 30  # maximum number of crashes without a finished batch in between: with more, the cause is not a row
FIRST = 1  # number of rows of the first batch, before the time of a row is known
TARGET = 1.0  # s, desired time of a batch; one process submits and writes all batches, for any number of workers
MIN_TIME = 0.05  # s, minimum time of a batch; the last ones are small, so that all workers end together
GROWTH = 4  # maximum ratio of a batch's size to the one before: the time of first batches includes compiling
MAX_ROWS = 65536  # maximum number of rows of a batch


@dataclass(frozen=True)
class Batch:
    """Rows that one worker flies together."""

    rows: Rows  # (n,) numbers of the rows
    crash_count: int = 0  # number of worker crashes during this batch
    alone: bool = False  # True if no other batch is flown at the same time, so that a crash is certainly by this one

    def halves(self, crash_count: int) -> list[Batch]:
        """Split the batch into halves, each of which begins with `crash_count`."""
        return [Batch(rows, crash_count, self.alone) for rows in np.array_split(self.rows, 2)]


class Batches:
    """The batches of a campaign, made on demand."""

    def __init__(self) -> None:
        self._rows: Rows = np.empty(0, np.int64)  # rows that no batch has had yet
        self._returned: list[Batch] = []
        self._size = FIRST
        self._row_time = math.inf  # s, measured time of a row

    def add(self, rows: Rows) -> None:
        """Add rows, shape (n,)."""
        self._rows = np.concatenate([self._rows, rows])

    def take(self, width: int) -> Batch | None:
        """Take the next batch."""
        if self._returned:
            return self._returned.pop()
        left = len(self._rows)
        if not left:
            return None
        fair = max(math.ceil(MIN_TIME / self._row_time), left // (2 * width)) if self._row_time < math.inf else FIRST
        size = min(self._size, fair)
        batch, self._rows = Batch(self._rows[:size]), self._rows[size:]
        return batch

    def put_back(self, batch: Batch) -> None:
        """Put a batch back, to be taken next."""
        self._returned.append(batch)

    def adapt_size(self, rows: int, seconds: float) -> None:
        """Adapt the size by the time of a batch [s]; ignore a relatively small one: it may include start-up."""
        if rows * GROWTH < self._size:
            return
        self._row_time = max(seconds, 1e-9) / rows
        self._size = int(np.clip(TARGET / self._row_time, 1, min(GROWTH * max(rows, self._size), MAX_ROWS)))


def fly_all(work: Work, batches: Batches, pool: WorkerPool) -> Generator[Any, None, None]:
    """Fly batches, and yield the table of each as it finishes, in any order."""
    # Batches that are under way when a worker crashes are flown again, each alone. One that crashes its worker again is
    # halved after three crashes, down to the row that causes them, which is refused. The first batch is alone too: it
    # compiles the code that the others load from disk.
    under_way: dict[Flight, Batch] = {}
    refused: list[Any] = []  # tables of rows to be refused, once another batch has finished
    n_finished, crashes = 0, 0

    def submit_batches() -> None:
        width = pool.width if n_finished else 1
        while len(under_way) < width and not any(batch.alone for batch in under_way.values()):
            batch = batches.take(width)
            if batch is None:
                return
            if batch.alone and under_way:
                batches.put_back(batch)
                return
            under_way[pool.submit(work.task, work.batch(batch.rows))] = batch

    try:
        while True:
            submit_batches()
            if not under_way:
                break
            done = wait(under_way, _CHECK_PERIOD, FIRST_COMPLETED).done
            if not done:
                pool.check()
            for flight in done:
                batch, received = under_way.pop(flight), pool.result(flight)
                if not isinstance(received, WorkerCrash):
                    n_finished, crashes = n_finished + 1, 0
                    batches.adapt_size(len(batch.rows), received[1])
                    yield received[0]
                    yield from refused
                    refused.clear()
                    continue
                crashes += batch.alone
                if crashes > _MAX_CRASHES:
                    raise RunError(f"{crashes} processes crashed in a row, whatever they flew; what is flown is kept")
                refused += _retry(work, batches, batch, received)
    finally:
        for flight in under_way:  # after an error: whoever closes the executor may wait for them
            flight.cancel()
    if refused and not n_finished:
        raise RunError("every process crashed, whatever it flew (killed, or out of memory)")
    yield from refused


def _retry(work: Work, batches: Batches, batch: Batch, crash: WorkerCrash) -> list[Any]:
    """Put back a batch whose worker crashed, whole or in halves; return the table of its row if that is the cause."""
    if not batch.alone:
        log.warning("a process crashed; its %d rows are flown again, apart from others", len(batch.rows))
        batches.put_back(Batch(batch.rows, batch.crash_count, alone=True))
    elif (crash_count := batch.crash_count + crash.crash_count) < FATAL:
        log.warning("a process crashed (killed, or out of memory); its %d rows are flown again", len(batch.rows))
        batches.put_back(Batch(batch.rows, crash_count, alone=True))
    elif len(batch.rows) > 1:
        for half in reversed(batch.halves(FATAL - 1)):
            batches.put_back(half)
    else:
        return [work.refused_table(int(batch.rows[0]), KILLED)]
    return []
