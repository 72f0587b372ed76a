"""Dispatches batches to a worker pool until every row is finished, or refused because it crashes its worker."""

from __future__ import annotations

import logging
from collections.abc import Generator
from concurrent.futures import FIRST_COMPLETED, wait
from typing import Any

from cosim.campaigns.workers.batch_sizing import Batch, Batches
from cosim.campaigns.workers.work import Work
from cosim.campaigns.workers.worker_pools import FATAL, Flight, WorkerCrash, WorkerPool
from cosim.errors import RunError

log = logging.getLogger(__name__)

KILLED = "the process that flew it crashed each time (killed, or out of memory)"
_CHECK_PERIOD = 5.0  # s between checks of the pool while no batch finishes
_MAX_CRASHES = 30  # maximum number of crashes without a finished batch in between: with more, the cause is not a row


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
                    batches.measured(len(batch.rows), received[1])
                    yield received[0]
                    yield from refused
                    refused.clear()
                    continue
                crashes += batch.alone
                if crashes > _MAX_CRASHES:
                    raise RunError(f"{crashes} processes crashed in a row, with any rows; what is flown is kept")
                refused += _retry(work, batches, batch, received)
    finally:
        for flight in under_way:  # after an error: whoever closes the executor may wait for them
            flight.cancel()
    if refused and not n_finished:
        raise RunError("every process crashed, with any rows (killed, or out of memory)")
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
        return [work.refused(int(batch.rows[0]), KILLED)]
    return []
