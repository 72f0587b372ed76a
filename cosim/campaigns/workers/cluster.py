"""Dask: a cluster that exists, or one of processes on this machine."""

from __future__ import annotations

import contextlib
import logging
import sys
import time
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from typing import Any

from cosim.campaigns.workers.work import Task
from cosim.campaigns.workers.worker import fly, release
from cosim.campaigns.workers.worker_pools import Flight, WorkerCrash, interrupts_held
from cosim.errors import RunError
from plant_fmu.installing import install_hint

_QUEUED = 2  # batches a thread of a worker, so that none waits for work
_LOOK = 5.0  # s between looks at how many workers there are: they may come and go
_PATIENCE = 30.0  # s for the first worker, and without any
_PATIENCE_WITH_SCHEDULER = 10.0  # s for it to answer
_PATIENCE_WITH_WORKERS = 2.0  # s for one to end the batch that it is at
# of a cluster of ours: how its processes watch themselves, many times a second, takes a tenth of two cores
_CALM: dict[str, Any] = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.admin.tick.interval": "1s",
    "distributed.scheduler.allowed-failures": 0,  # we count deaths ourselves, and know how to lay them to a row
}
_SETTLING = 1.0  # s that a new worker is left in peace: one that dies at once is not replaced again


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
        self._workers = self._looked = self._seen = 0.0
        self._bereft = False
        self._local = isinstance(self._client.cluster, distributed.LocalCluster)
        self._look()
        self._most = self._workers

    @property
    def width(self) -> int:
        """How many batches may be under way."""
        if time.monotonic() - self._looked >= _LOOK:
            self._look()
        return max(1, _QUEUED * int(self._workers))

    def submit(self, task: Task, batch: Any) -> Flight:
        """Have a batch flown; after a death, once there are as many workers as before."""
        if self._bereft:
            self._recover()
        try:
            flight: Flight = self._executor.submit(fly, task, batch)
        except (RuntimeError, OSError) as error:
            raise _lost(error) from error
        return flight

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return what came of it; Dask lays the death of a worker to everything that had been sent there."""
        try:
            return flight.result()
        except self._killed as error:
            self._bereft = True
            return WorkerCrash(error.allowed_failures + 1, certain=False)
        except (CancelledError, OSError) as error:
            raise _lost(error) from error

    def check(self) -> None:
        """Look whether there are workers; a RunError if not."""
        self._look()
        if time.monotonic() - self._seen > _PATIENCE:
            raise RunError(f"the cluster has had no workers for {_PATIENCE:g} s; what is flown is kept")

    def _look(self) -> None:
        try:
            self._workers = sum(self._client.nthreads().values())
        except (OSError, RuntimeError, TimeoutError) as error:
            raise _lost(error) from error
        self._looked = time.monotonic()
        if self._workers:
            self._seen = self._looked

    def _recover(self) -> None:
        """Wait for workers in the place of those that died; those that do not come by themselves are sent for."""
        if not self._wait(_PATIENCE / 3.0) and self._local:
            with interrupts_held():
                self._client.cluster.scale(0)
                self._client.cluster.scale(int(self._most))
            self._wait(_PATIENCE)
        time.sleep(_SETTLING)
        self._bereft, self._most = False, max(1.0, self._workers)
        self.check()

    def _wait(self, patience: float) -> bool:
        until = time.monotonic() + patience
        while self._workers < self._most and time.monotonic() < until:
            time.sleep(_SETTLING / 10.0)
            self._look()
        return self._workers >= self._most

    def close(self) -> None:
        """Leave the cluster to whom it belongs, its workers without what they held for us."""
        with contextlib.suppress(Exception):  # whoever is gone holds nothing
            self._client.run(release, _PATIENCE_WITH_WORKERS)


def _lost(error: BaseException) -> RunError:
    said = " ".join(str(error).split()) or type(error).__name__
    return RunError(f"the cluster is lost ({said}); what is flown is kept")


@contextlib.contextmanager
def _quiet(name: str) -> Iterator[None]:
    """Leave out what a library logs: what it means for the campaign, we say.

    Its loggers have levels of their own, that of the library over them does not reach down.
    """
    names = [name, *(other for other in logging.root.manager.loggerDict if other.startswith(f"{name}."))]
    before = {logger: logger.level for logger in map(logging.getLogger, names)}
    for logger in before:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in before.items():
            logger.setLevel(level)


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
        raise RunError(f"Dask is not installed; {install_hint('distributed>=2024.5')}") from error
    untyped: Any = distributed
    with contextlib.ExitStack() as stack:
        stack.enter_context(_quiet("distributed"))
        try:
            if scheduler is None:
                stack.enter_context(dask.config.set(_CALM))
                with interrupts_held():
                    cluster = untyped.LocalCluster(
                        n_workers=workers, threads_per_worker=1, processes=True, silence_logs=logging.CRITICAL,
                        scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                    )  # fmt: skip
                stack.enter_context(cluster)
                client = untyped.Client(cluster)
            else:
                client = untyped.Client(scheduler, timeout=_PATIENCE_WITH_SCHEDULER)
            stack.enter_context(client)
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TimeoutError) as error:
            said = " ".join(str(error).split()) or type(error).__name__
            raise RunError(f"the cluster {scheduler or 'on this machine'} cannot be used: {said}") from error
        yield stack.enter_context(client.get_executor())
