"""Dask: a cluster that exists, or one of processes on this machine."""

from __future__ import annotations

import contextlib
import sys
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from typing import Any

from cosim.campaigns.crews import Death, Flight, interrupts_held
from cosim.campaigns.work import Task
from cosim.campaigns.worker import fly
from cosim.errors import RunError

_QUEUED = 2  # batches a thread of a worker, so that none waits for work
_LOOK = 5.0  # s between looks at how many workers there are: they may come and go
_PATIENCE = 30.0  # s for a scheduler to answer, and for the first worker


def is_cluster(executor: Executor) -> bool:
    """Return whether an executor is what ``Client.get_executor()`` of Dask gives."""
    module: Any = sys.modules.get("distributed.cfexecutor")
    return module is not None and isinstance(executor, module.ClientExecutor)


class Cluster:
    """The workers of a Dask cluster. What is lost with a worker is flown again by another.

    Parameters
    ----------
    executor : distributed.cfexecutor.ClientExecutor
        Of its client.
    """

    def __init__(self, executor: Any) -> None:
        import distributed

        self._executor, self._client = executor, executor._client
        self._killed: Any = distributed.KilledWorker
        self._width, self._looked = 1, -_LOOK

    @property
    def width(self) -> int:
        """How many batches may be under way."""
        if time.monotonic() - self._looked >= _LOOK:
            self._width = max(1, _QUEUED * sum(self._client.nthreads().values()))
            self._looked = time.monotonic()
        return self._width

    def submit(self, task: Task, batch: Any) -> Flight:
        """Have a batch flown."""
        try:
            flight: Flight = self._executor.submit(fly, task, batch)
        except (RuntimeError, OSError) as error:
            raise _lost(error) from error
        return flight

    def settle(self, flight: Flight) -> tuple[Any, float] | Death:
        """Return what came of it; Dask lays the death of a worker to everything that had been sent there."""
        try:
            return flight.result()
        except self._killed as error:
            return Death(error.allowed_failures + 1, certain=False)
        except (CancelledError, OSError) as error:
            raise _lost(error) from error

    def close(self) -> None:
        """Leave the cluster to whom it belongs."""


def _lost(error: BaseException) -> RunError:
    said = " ".join(str(error).split()) or type(error).__name__
    return RunError(f"the cluster is lost ({said}); what is flown is kept")


@contextlib.contextmanager
def cluster_executor(scheduler: str | None, workers: int) -> Iterator[Executor]:
    """Connect to a cluster, or make one of processes on this machine.

    Parameters
    ----------
    scheduler : str or None
        Address such as ``tcp://10.0.0.1:8786``; None for one on this machine.
    workers : int
        Processes of one on this machine, a thread each.

    Yields
    ------
    concurrent.futures.Executor
        Closed when it is left, and so is a cluster on this machine.

    Raises
    ------
    RunError
        If Dask is not installed, or the cluster cannot be reached or has no workers.
    """
    try:
        import dask
        import distributed
    except ImportError as error:
        raise RunError("Dask is not installed; expected: pip install 'subreach[dask]'") from error
    untyped: Any = distributed
    with contextlib.ExitStack() as stack:
        try:
            if scheduler is None:
                # we count deaths ourselves, and know how to lay them to a row
                stack.enter_context(dask.config.set({"distributed.scheduler.allowed-failures": 0}))
                with interrupts_held():
                    cluster = untyped.LocalCluster(
                        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
                    )
                stack.enter_context(cluster)
                client = untyped.Client(cluster)
            else:
                client = untyped.Client(scheduler, timeout=_PATIENCE)
            stack.enter_context(client)
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError) as error:
            said = " ".join(str(error).split()) or type(error).__name__
            raise RunError(f"the cluster {scheduler or 'on this machine'} cannot be used: {said}") from error
        yield stack.enter_context(client.get_executor())
