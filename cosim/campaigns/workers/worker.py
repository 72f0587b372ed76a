"""Code that runs in the process that flies rows: this process, a worker process, or one of a cluster."""

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
class _FlyerSlot:
    """The flyer of this process, kept between batches: creating one loads the FMU and compiles the loop."""

    lock: threading.Lock = field(default_factory=threading.Lock)  # a flyer is not thread-safe
    task: Task | None = None
    flyer: Flyer | None = None

    def flyer_of(self, task: Task) -> Flyer:
        if self.flyer is None or self.task != task:
            self.free()
            self.flyer, self.task = task.flyer(), task
        return self.flyer

    def free(self) -> None:
        flyer, self.flyer, self.task = self.flyer, None, None
        if flyer is not None:
            flyer.close()


_slot = _FlyerSlot()


def fly(task: Task, batch: Any) -> tuple[Any, float]:
    """Fly a batch, and return its table and the wall time [s]; threads of one process take turns."""
    with _slot.lock:
        flyer = _slot.flyer_of(task)
        started = time.perf_counter()
        table = flyer.fly(batch)
        return table, time.perf_counter() - started


def release(patience: float) -> None:
    """Free the flyer of this process; patience [s]."""
    if _slot.lock.acquire(timeout=patience):
        try:
            _slot.free()
        finally:
            _slot.lock.release()


@contextlib.contextmanager
def hold_flyer(task: Task) -> Iterator[None]:
    """Hold a flyer in this process during a block: it raises errors of the task, and builds what is built once."""
    with _slot.lock:
        _slot.flyer_of(task)
    try:
        yield
    finally:
        _slot.free()


def begin_worker(task: Task) -> None:
    """Set up a worker process: ignore Ctrl-C and SIGHUP, which the parent handles, and end with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _end_worker)
    threading.Thread(target=_follow_parent, name="follow-parent", daemon=True).start()
    with contextlib.suppress(Exception):  # after a failure the first batch raises the error
        _slot.flyer_of(task)


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)


def _end_worker(*_: object) -> None:
    """Free the flyer and its files, and exit without cleanup: another worker may have crashed holding a lock."""
    _slot.free()
    os._exit(1)
