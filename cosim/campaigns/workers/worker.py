"""What happens in the process that flies rows: this one, a worker of ours, or one of a cluster."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from cosim.campaigns.workers.work import Flyer, Task


@dataclass
class _Held:
    """The flyer of this process. Making one loads the FMU and compiles the loop, so it stays from batch to batch."""

    lock: threading.Lock = field(default_factory=threading.Lock)  # a flyer is no thing for two threads
    task: Task | None = None
    flyer: Flyer | None = None

    def of(self, task: Task) -> Flyer:
        if self.flyer is None or self.task != task:
            self.free()
            self.flyer, self.task = task.flyer(), task
        return self.flyer

    def free(self) -> None:
        flyer, self.flyer, self.task = self.flyer, None, None
        if flyer is not None:
            flyer.close()


_held = _Held()


def fly(task: Task, batch: Any) -> tuple[Any, float]:
    """Fly a batch; threads of one process do so by turns.

    Parameters
    ----------
    task : Task
        How.
    batch : object
        Of the work.

    Returns
    -------
    pyarrow.Table, float
        Its rows, and how long they took [s].
    """
    with _held.lock:
        flyer = _held.of(task)
        started = time.perf_counter()
        table = flyer.fly(batch)
        return table, time.perf_counter() - started


def prepare(task: Task) -> None:
    """Make the flyer of a task; if that fails, its first batch says so.

    Parameters
    ----------
    task : Task
        How batches will be flown.
    """
    with _held.lock:
        _held.of(task)


def release(patience: float) -> None:
    """Free the flyer of this process.

    Parameters
    ----------
    patience : float
        How long to wait for the batch that is being flown [s]; after that the flyer stays.
    """
    if _held.lock.acquire(timeout=patience):
        try:
            _held.free()
        finally:
            _held.lock.release()


@contextlib.contextmanager
def flyer_held(task: Task) -> Iterator[None]:
    """Hold a flyer in this process: it says what it cannot do, and what has to be built once is built."""
    prepare(task)
    try:
        yield
    finally:
        _held.free()


def begin_worker() -> None:
    """Leave Ctrl-C and a closed terminal to the parent, and end when it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end_worker)
    threading.Thread(target=_follow_parent, name="follow-parent", daemon=True).start()


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)


def _end_worker(*_: object) -> None:
    """End at once, whatever lock another worker took with it when it died, but leave no files."""
    _held.free()
    os._exit(1)
