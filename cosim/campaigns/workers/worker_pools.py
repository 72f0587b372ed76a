"""Worker pools: this process, processes on this machine, or an external executor."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import resource_tracker
from typing import Any

from cosim.campaigns.workers.work import Task
from cosim.campaigns.workers.worker import begin_worker, fly
from cosim.errors import RunError

FATAL = 3  # number of crashes after which a batch is halved
QUEUED = 2  # number of batches submitted per worker, so that no worker waits for work

Flight = Future[tuple[Any, float]]  # table with the rows of a batch, and the time that they took [s]


@dataclass(frozen=True)
class WorkerCrash:
    """Result of a batch that was under way when a worker crashed, perhaps by another batch."""

    crash_count: int = 1  # number of crashes


class WorkerPool:
    """Flies batches in this process; the other pools derive from it."""

    width: int = 1  # maximum number of batches under way

    def submit(self, task: Task, batch: Any) -> Flight:
        """Fly a batch, or submit it to a worker."""
        flight: Flight = Future()
        flight.set_result(fly(task, batch))
        return flight

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch that is done; raise an error that ends the campaign."""
        return flight.result()

    def check(self) -> None:
        """Raise an error if no batch under way can finish."""

    def close(self) -> None:
        """Stop the workers; batches under way are lost."""


class Processes(WorkerPool):
    """Worker processes on this machine; after a crash all are replaced."""

    def __init__(self, n: int, task: Task) -> None:
        self._n, self._task, self.width = n, task, QUEUED * n
        with block_interrupts():
            self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(self._n, context, initializer=begin_worker, initargs=(self._task,))

    def submit(self, task: Task, batch: Any) -> Flight:
        """Submit a batch, which may start a process."""
        with block_interrupts():
            try:
                return self._pool.submit(fly, task, batch)
            except BrokenProcessPool:
                self._start()
                return self._pool.submit(fly, task, batch)

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch."""
        try:
            return flight.result()
        except BrokenProcessPool:
            return WorkerCrash()

    def close(self) -> None:
        """Stop the processes."""
        self._pool.shutdown(wait=True, cancel_futures=True)


class ExternalExecutor(WorkerPool):
    """An executor that the caller has created, and closes."""

    def __init__(self, executor: Executor, workers: int) -> None:
        self._executor, self.width = executor, QUEUED * workers

    def submit(self, task: Task, batch: Any) -> Flight:
        """Submit a batch to the executor."""
        with lost_work("the executor takes no more work", BrokenExecutor, RuntimeError):
            return self._executor.submit(fly, task, batch)

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return the result of a batch."""
        with lost_work("the executor takes no more work", BrokenExecutor, CancelledError):
            return flight.result()


@contextlib.contextmanager
def lost_work(message: str, *errors: type[BaseException]) -> Iterator[None]:
    """Convert errors of an executor to a RunError that begins with a message."""
    try:
        yield
    except errors as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RunError(f"{message} ({reason}); what is flown is kept") from error


@contextlib.contextmanager
def block_interrupts() -> Iterator[None]:
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
