"""Batches, shared out until every row has come home or is known to kill whoever flies it."""

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

KILLED = "the process that flew it died each time (killed, or out of memory)"
_LOOK = 5.0  # s between looks at the crew, where nothing comes home
_DEATHS = 30  # in a row, with nothing that came home between them: it is not the rows


def fly_all(work: Work, batches: Batches, pool: WorkerPool) -> Generator[Any, None, None]:
    """Fly batches, and yield the rows of each as it comes home, in whatever order that is.

    A batch that processes die of is flown again; the third time it is taken apart, down to the row that is to blame,
    which is refused. The first batch is flown alone: whatever has to be compiled is, and the others find it on disk.

    Parameters
    ----------
    work : Work
        What is flown.
    batches : Batches
        What is left of it.
    pool : WorkerPool
        By whom.

    Yields
    ------
    pyarrow.Table
        Of one batch.

    Raises
    ------
    RunError
        If processes die whatever they fly, or the crew cannot go on.
    """
    under_way: dict[Flight, Batch] = {}
    condemned: list[Any] = []  # rows that are refused, once it is seen that others can be flown
    home, deaths = 0, 0

    def send() -> None:
        width = pool.width if home else 1
        while len(under_way) < width and not any(batch.alone for batch in under_way.values()):
            batch = batches.take(width)
            if batch is None:
                return
            if batch.alone and under_way:
                batches.put_back(batch)
                return
            under_way[pool.submit(work.task, work.batch(batch.rows))] = batch

    while True:
        send()
        if not under_way:
            break
        done = wait(under_way, _LOOK, FIRST_COMPLETED).done
        if not done:
            pool.check()
        for flight in done:
            batch, received = under_way.pop(flight), pool.result(flight)
            if not isinstance(received, WorkerCrash):
                home, deaths = home + 1, 0
                batches.measured(len(batch.rows), received[1])
                yield received[0]
                yield from condemned
                condemned.clear()
                continue
            deaths += received.crash_count > 0
            if deaths > _DEATHS:
                raise RunError(
                    f"{deaths} processes died one after the other, whatever they flew; what is flown is kept"
                )
            condemned += _again(work, batches, batch, received)
    if condemned and not home:
        raise RunError("every process died, whatever it flew (killed, or out of memory)")
    yield from condemned


def _again(work: Work, batches: Batches, batch: Batch, crash: WorkerCrash) -> list[Any]:
    """Put back a batch that did not come home, whole or in halves; return the table of its row if that is to blame."""
    if not crash.crash_count:
        batches.put_back(batch)
    elif not (crash.certain or batch.alone):
        log.warning("a process died; what it may have died of is flown again alone")
        batches.put_back(Batch(batch.rows, batch.crash_count, alone=True))
    elif (crash_count := batch.crash_count + crash.crash_count) < FATAL:
        log.warning("a process died (killed, or out of memory); its %d rows are flown again", len(batch.rows))
        batches.put_back(Batch(batch.rows, crash_count, batch.alone))
    elif len(batch.rows) > 1:
        for half in reversed(batch.halves(FATAL - 1)):
            batches.put_back(half)
    else:
        return [work.refused(int(batch.rows[0]), KILLED)]
    return []
