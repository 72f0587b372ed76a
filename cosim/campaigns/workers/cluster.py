"""Dask: an existing cluster, or a local one with processes on this machine."""

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
from cosim.campaigns.workers.worker_pools import QUEUED, Flight, WorkerCrash, WorkerPool, block_interrupts, lost_work
from cosim.errors import RunError
from plant_fmu.installing import install_hint

_COUNT_PERIOD = 5.0  # s between counts of the workers, which may join and leave
_WORKER_TIMEOUT = 30.0  # s, wait for the first worker, and for a new one in a cluster without workers
_SCHEDULER_TIMEOUT = 10.0  # s, wait for the scheduler of a cluster
_RELEASE_TIMEOUT = 2.0  # s, wait for a worker to end its present batch
# settings of local clusters, whose self-monitoring takes a tenth of two cores by default
_LOW_OVERHEAD: dict[str, Any] = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.admin.tick.interval": "1s",
    "distributed.scheduler.allowed-failures": 0,  # `dispatch` counts crashes itself, and finds the row
}
_LOST = "the cluster is lost"
_SETTLING = 1.0  # s, wait for new workers, so that one that crashes at once is not restarted again


def is_cluster(executor: Executor) -> bool:
    """Return True if an executor is one of Dask's ``Client.get_executor()``."""
    module: Any = sys.modules.get("distributed.cfexecutor")
    return module is not None and isinstance(executor, module.ClientExecutor)


class Cluster(WorkerPool):
    """The workers of a Dask cluster. Batches lost with a worker are flown again by another one."""

    def __init__(self, executor: Any) -> None:
        import distributed

        self._executor, self._client = executor, executor._client
        self._killed: Any = distributed.KilledWorker
        self._local = isinstance(self._client.cluster, distributed.LocalCluster)
        self._workers = self._counted = self._last_present = 0.0
        self._has_crashed = False
        self._count_workers()
        self._max_workers = self._workers

    @property
    def width(self) -> int:  # type: ignore[override]
        """Greatest number of batches under way."""
        if time.monotonic() - self._counted >= _COUNT_PERIOD:
            self._count_workers()
        return max(1, QUEUED * int(self._workers))

    def submit(self, task: Task, batch: Any) -> Flight:
        """Submit a batch; after a crash, first wait until there are as many workers as before."""
        if self._has_crashed:
            self._recover()
        with lost_work(_LOST, RuntimeError, OSError):
            flight: Flight = self._executor.submit(fly, task, batch)
        return flight

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch; after a crash Dask fails all batches that were sent to that worker."""
        with lost_work(_LOST, CancelledError, OSError):
            try:
                return flight.result()
            except self._killed as error:
                self._has_crashed = True
                return WorkerCrash(error.allowed_failures + 1)

    def check(self) -> None:
        """Raise a RunError if there have been no workers for some time."""
        self._count_workers()
        if time.monotonic() - self._last_present > _WORKER_TIMEOUT:
            raise RunError(f"the cluster has had no workers for {_WORKER_TIMEOUT:g} s; what is flown is kept")

    def _count_workers(self) -> None:
        with lost_work(_LOST, OSError, RuntimeError, TimeoutError):
            self._workers = sum(self._client.nthreads().values())
        self._counted = time.monotonic()
        if self._workers:
            self._last_present = self._counted

    def _recover(self) -> None:
        """Wait for replacements of crashed workers; restart the workers of a local cluster if none join."""
        if not self._wait(_WORKER_TIMEOUT / 3.0) and self._local:
            with block_interrupts():
                self._client.cluster.scale(0)
                self._client.cluster.scale(int(self._max_workers))
            self._wait(_WORKER_TIMEOUT)
        time.sleep(_SETTLING)
        self._has_crashed, self._max_workers = False, max(1.0, self._workers)
        self.check()

    def _wait(self, patience: float) -> bool:
        until = time.monotonic() + patience
        while self._workers < self._max_workers and time.monotonic() < until:
            time.sleep(_SETTLING / 10.0)
            self._count_workers()
        return self._workers >= self._max_workers

    def close(self) -> None:
        """Free the flyers of the workers; the cluster stays open."""
        with contextlib.suppress(Exception):  # workers that have left hold no flyer
            self._client.run(release, _RELEASE_TIMEOUT)


@contextlib.contextmanager
def _quiet(name: str) -> Iterator[None]:
    """Silence the log of a library, whose errors the campaign reports itself."""
    # Each of its loggers is silenced, since each has its own level.
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
    """Connect to a cluster, or start a local one on this machine."""
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
                stack.enter_context(dask.config.set(_LOW_OVERHEAD))
                with block_interrupts():
                    cluster = untyped.LocalCluster(
                        n_workers=workers, threads_per_worker=1, processes=True, silence_logs=logging.CRITICAL,
                        scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                    )  # fmt: skip
                stack.enter_context(cluster)
                client = untyped.Client(cluster)
            else:
                client = untyped.Client(scheduler, timeout=_SCHEDULER_TIMEOUT)
            stack.enter_context(client)
            client.wait_for_workers(1, timeout=_WORKER_TIMEOUT)
        except (OSError, ValueError, TimeoutError, RuntimeError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            raise RunError(f"the cluster {scheduler or 'on this machine'} cannot be used: {reason}") from error
        executor = client.get_executor()
        stack.callback(executor.shutdown, wait=False)  # not waiting for batches that no worker may be left to finish
        yield executor
