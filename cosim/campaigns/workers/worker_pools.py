"""Worker pools: this process, processes on this machine, or an external executor."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from typing import Any, Protocol

from cosim.campaigns.workers.work import Task
from cosim.campaigns.workers.worker import begin_worker, fly, prepare
from cosim.errors import RunError

FATAL = 3  # number of crashes after which a batch is halved
_QUEUED = 2  # number of batches submitted per worker, so that no worker waits for work

Flight = Future[tuple[Any, float]]  # table with the rows of a batch, and the time that they took [s]


@dataclass(frozen=True)
class WorkerCrash:
    """Result of a batch whose worker process crashed."""

    crash_count: int  # number of crashes by this batch; 0 if another batch of the worker was the cause
    certain: bool = True  # False if another batch may be the cause


class WorkerPool(Protocol):
    """Flies batches in workers."""

    @property
    def width(self) -> int:
        """Greatest number of batches under way."""

    def submit(self, task: Task, batch: Any) -> Flight:
        """Submit a batch to a worker."""

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch that is done; raise an error that ends the campaign."""

    def check(self) -> None:
        """Raise an error if no batch under way can finish."""

    def close(self) -> None:
        """Stop the workers; batches under way are lost."""


class InProcess:
    """Pool without workers: `submit` flies the batch in this process."""

    width = 1

    def submit(self, task: Task, batch: Any) -> Flight:
        """Fly a batch in this process."""
        flight: Flight = Future()
        flight.set_result(fly(task, batch))
        return flight

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch."""
        return flight.result()

    def check(self) -> None:
        """Do nothing: a submitted batch is finished."""

    def close(self) -> None:
        """Do nothing: there are no workers."""


@dataclass(eq=False)
class _Worker:
    """One process in its own executor, so that a crash can be attributed to a batch and leaves the others running."""

    pool: ProcessPoolExecutor
    under_way: list[Flight] = field(default_factory=list)  # in order of submission: the first is being flown
    crashed_flight: Flight | None = None  # flight during which the process crashed

    def attribute_crash(self) -> None:
        """Attribute a crash to the first flight that has not finished."""
        if self.crashed_flight is None:
            self.crashed_flight = next(flight for flight in self.under_way if not _has_finished(flight))


class Processes:
    """Worker processes on this machine; one that crashes is replaced."""

    def __init__(self, n: int, task: Task) -> None:
        self._task = task
        self._workers = [self._start_worker() for _ in range(n)]
        self._worker_of: dict[Flight, _Worker] = {}

    @property
    def width(self) -> int:
        """Greatest number of batches under way."""
        return _QUEUED * len(self._workers)

    def submit(self, task: Task, batch: Any) -> Flight:
        """Submit a batch to the process with the fewest batches."""
        worker = min(self._workers, key=lambda worker: len(worker.under_way))
        try:
            flight = worker.pool.submit(fly, task, batch)
        except BrokenProcessPool:  # it crashed, and `result` has not replaced it yet
            worker = self._replace(worker)
            flight = worker.pool.submit(fly, task, batch)
        worker.under_way.append(flight)
        self._worker_of[flight] = worker
        return flight

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch; replace its worker after a crash."""
        worker = self._worker_of.pop(flight)
        try:
            return flight.result()
        except BrokenProcessPool:
            worker.attribute_crash()
            if worker in self._workers:
                self._replace(worker)
            return WorkerCrash(1 if flight is worker.crashed_flight else 0)
        finally:
            worker.under_way.remove(flight)

    def check(self) -> None:
        """Do nothing: each executor reports a crash of its process."""

    def _replace(self, worker: _Worker) -> _Worker:
        new = self._start_worker()
        self._workers[self._workers.index(worker)] = new
        worker.pool.shutdown(wait=False)
        return new

    def _start_worker(self) -> _Worker:
        """Start a process that creates its flyer, which takes about a second."""
        context = multiprocessing.get_context("spawn")
        with interrupts_held():
            pool = ProcessPoolExecutor(1, mp_context=context, initializer=begin_worker)
            pool.submit(prepare, self._task)
        return _Worker(pool)

    def close(self) -> None:
        """Stop the processes."""
        for worker in self._workers:
            worker.pool.shutdown(wait=False, cancel_futures=True)
        for worker in self._workers:
            worker.pool.shutdown(wait=True)


class ExternalExecutor:
    """An executor that the caller has created, and closes."""

    def __init__(self, executor: Executor, workers: int) -> None:
        self._executor = executor
        self.width = _QUEUED * workers

    def submit(self, task: Task, batch: Any) -> Flight:
        """Submit a batch to the executor."""
        try:
            return self._executor.submit(fly, task, batch)
        except (BrokenExecutor, RuntimeError) as error:
            raise _broken(error) from error

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch."""
        try:
            return flight.result()
        except (BrokenExecutor, CancelledError) as error:
            raise _broken(error) from error

    def check(self) -> None:
        """Do nothing: the executor reports failures itself."""

    def close(self) -> None:
        """Do nothing: the caller closes the executor."""


def _broken(error: BaseException) -> RunError:
    said = " ".join(str(error).split()) or type(error).__name__
    return RunError(f"the executor takes no more work ({said}); what is flown is kept")


def _has_finished(flight: Flight) -> bool:
    return flight.done() and flight.exception() is None


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Block SIGINT and SIGHUP while a process is started, which inherits the blocked signals."""
    # Python's resource tracker inherits them too.
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP})
    try:
        resource_tracker.ensure_running()  # its start unblocks SIGINT, which it ignores itself
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
