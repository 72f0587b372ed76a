"""Who flies batches: this process, processes of our own, or any executor that we are given."""

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

FATAL = 3  # processes that may die of a batch before it is taken apart
_QUEUED = 2  # batches a worker, so that none waits for work

Flight = Future[tuple[Any, float]]  # table, s


@dataclass(frozen=True)
class WorkerCrash:
    """A batch did not come home, because its process died."""

    crash_count: int  # how many have died of it
    certain: bool = True  # that it was this batch


class WorkerPool(Protocol):
    """Flies batches somewhere."""

    @property
    def width(self) -> int:
        """How many batches may be under way."""

    def submit(self, task: Task, batch: Any) -> Flight:
        """Have a batch flown."""

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return what came of a batch that is done; raise what cannot be mended."""

    def check(self) -> None:
        """Raise an error if nothing that is under way will ever come home."""

    def close(self) -> None:
        """Send everybody home; what is under way is lost."""


class InProcess:
    """Nobody but this process: a batch is flown when it is submitted."""

    width = 1

    def submit(self, task: Task, batch: Any) -> Flight:
        """Fly a batch."""
        flight: Flight = Future()
        flight.set_result(fly(task, batch))
        return flight

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return what came of it."""
        return flight.result()

    def check(self) -> None:
        """Wait for nobody."""

    def close(self) -> None:
        """Nobody to send home."""


@dataclass(eq=False)
class _Worker:
    """One process. Each has a pool of its own, so that when it dies, we know of what, and the others go on."""

    pool: ProcessPoolExecutor
    under_way: list[Flight] = field(default_factory=list)  # in order of submission: the first is being flown
    fatal: Flight | None = None  # what the process has died of

    def blame(self) -> None:
        """Lay a death to the first flight that has not come home."""
        if self.fatal is None:
            self.fatal = next(flight for flight in self.under_way if not _has_finished(flight))


class Processes:
    """Processes of our own on this machine; one that dies is replaced.

    Parameters
    ----------
    n : int
        How many.
    task : Task
        What they get ready for at once, beside each other.
    """

    def __init__(self, n: int, task: Task) -> None:
        self._task = task
        self._workers = [self._free_worker() for _ in range(n)]
        self._hand_of: dict[Flight, _Worker] = {}

    @property
    def width(self) -> int:
        """How many batches may be under way."""
        return _QUEUED * len(self._workers)

    def submit(self, task: Task, batch: Any) -> Flight:
        """Have a batch flown by the process that has least to do."""
        worker = min(self._workers, key=lambda worker: len(worker.under_way))
        try:
            flight = worker.pool.submit(fly, task, batch)
        except BrokenProcessPool:  # it died, and nobody has settled that yet
            worker = self._replace(worker)
            flight = worker.pool.submit(fly, task, batch)
        worker.under_way.append(flight)
        self._hand_of[flight] = worker
        return flight

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return what came of it."""
        worker = self._hand_of.pop(flight)
        try:
            return flight.result()
        except BrokenProcessPool:
            worker.blame()
            if worker in self._workers:
                self._replace(worker)
            return WorkerCrash(1 if flight is worker.fatal else 0)
        finally:
            worker.under_way.remove(flight)

    def check(self) -> None:
        """Be sure to hear of every death."""

    def _replace(self, worker: _Worker) -> _Worker:
        new = self._free_worker()
        self._workers[self._workers.index(worker)] = new
        worker.pool.shutdown(wait=False)
        return new

    def _free_worker(self) -> _Worker:
        """Start a process, and have it get ready, which takes it a second."""
        context = multiprocessing.get_context("spawn")
        with interrupts_held():
            pool = ProcessPoolExecutor(1, mp_context=context, initializer=begin_worker)
            pool.submit(prepare, self._task)
        return _Worker(pool)

    def close(self) -> None:
        """Send everybody home."""
        for worker in self._workers:
            worker.pool.shutdown(wait=False, cancel_futures=True)
        for worker in self._workers:
            worker.pool.shutdown(wait=True)


class ExternalExecutor:
    """An executor that somebody else has made, and closes.

    Parameters
    ----------
    executor : Executor
        Threads take turns. Where processes of it die, the campaign ends, and can go on later.
    workers : int
        How many batches it flies at the same time.
    """

    def __init__(self, executor: Executor, workers: int) -> None:
        self._executor = executor
        self.width = _QUEUED * workers

    def submit(self, task: Task, batch: Any) -> Flight:
        """Have a batch flown."""
        try:
            return self._executor.submit(fly, task, batch)
        except (BrokenExecutor, RuntimeError) as error:
            raise _broken(error) from error

    def result(self, flight: Flight) -> tuple[Any, float] | WorkerCrash:
        """Return what came of it."""
        try:
            return flight.result()
        except (BrokenExecutor, CancelledError) as error:
            raise _broken(error) from error

    def check(self) -> None:
        """Believe the executor."""

    def close(self) -> None:
        """Leave the executor to whom it belongs."""


def _broken(error: BaseException) -> RunError:
    said = " ".join(str(error).split()) or type(error).__name__
    return RunError(f"the executor takes no more work ({said}); what is flown is kept")


def _has_finished(flight: Flight) -> bool:
    return flight.done() and flight.exception() is None


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C and a closed terminal back while a process is started: it inherits that, and never hears of them.

    So does the process by which Python frees what all of them share.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP})
    try:
        resource_tracker.ensure_running()  # which lets Ctrl-C through when it is started, but has its own way with it
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
