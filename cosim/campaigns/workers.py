"""Batches of scenes, flown in this process or in workers of their own."""

from __future__ import annotations

import contextlib
import functools
import logging
import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any

from cosim.campaigns.results import Row, refused_row, row_of
from cosim.errors import RunError, ScenarioError
from cosim.scene import decode_scene
from cosim.scene_run import Conditions, SceneFlyer
from plant_fmu import PlantError

log = logging.getLogger(__name__)

_QUEUED = 2  # batches a worker, so that none waits for work


@dataclass(frozen=True)
class Task:
    """What all scenes of a campaign have in common. It can be pickled."""

    law: str
    gains: Any  # NamedTuple of the law's gains_type
    conditions: Conditions

    def flyer(self) -> SceneFlyer:
        """Return a flyer of its own."""
        return SceneFlyer(self.law, self.conditions, self.gains)


def fly_all(
    flyer: SceneFlyer, task: Task, batches: Iterable[list[bytes]], workers: int
) -> Generator[list[Row], None, None]:
    """Fly batches, and yield the rows of each as it is done, in whatever order that is.

    Parameters
    ----------
    flyer : SceneFlyer
        Of the task, in this process.
    task : Task
        How.
    batches : iterable of list of bytes
        A scene each, as `decode_scene` reads it; drawn as they are needed.
    workers : int
        Processes; 1 for this one alone.

    Yields
    ------
    list of Row
        Of one batch.

    Raises
    ------
    RunError
        If a worker dies.
    """
    if workers == 1:
        for lines in batches:
            yield fly_batch(flyer, lines)
        return
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin_worker)
    try:
        yield from _fly_in(pool, task, _compiling(flyer, batches), workers)
    except BrokenProcessPool as error:
        raise RunError(
            "a worker died (killed, or out of memory); the same command goes on from what is done"
        ) from error
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def fly_batch(flyer: SceneFlyer, lines: list[bytes]) -> list[Row]:
    """Fly scenes one after the other.

    Parameters
    ----------
    flyer : SceneFlyer
        Of the task.
    lines : list of bytes
        A scene each, as `decode_scene` reads it.

    Returns
    -------
    list of Row
        In the same order. What the plant refuses has a row that says so.
    """
    rows = []
    for line in lines:
        scene = decode_scene(line)
        try:
            score, _ = flyer.fly(scene)
        except (PlantError, ScenarioError) as error:
            log.warning("seed %d: refused by the plant: %s", scene.seed, error)
            rows.append(refused_row(scene.seed))
        else:
            rows.append(row_of(scene.seed, score, flyer.conditions.plant_step))
    return rows


def _compiling(flyer: SceneFlyer, batches: Iterable[list[bytes]]) -> Iterator[list[bytes]]:
    """Pass batches on, once the first scene was flown here: the loop is compiled then, and workers find it on disk."""
    for i, lines in enumerate(batches):
        if i == 0:
            with contextlib.suppress(PlantError, ScenarioError):
                flyer.fly(decode_scene(lines[0]))
        yield lines


def _fly_in(pool: Executor, task: Task, batches: Iterable[list[bytes]], workers: int) -> Iterator[list[Row]]:
    """Keep a few batches a worker under way, and yield what is done."""
    under_way: set[Future[list[Row]]] = set()
    coming = iter(batches)
    while True:
        while len(under_way) < _QUEUED * workers and (lines := next(coming, None)) is not None:
            with _interrupts_held():
                under_way.add(pool.submit(_fly_in_worker, task, lines))
        if not under_way:
            return
        done, under_way = wait(under_way, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()


# ---- in a worker ----


def _fly_in_worker(task: Task, lines: list[bytes]) -> list[Row]:
    return fly_batch(_flyer(task), lines)


@functools.lru_cache(maxsize=1)
def _flyer(task: Task) -> SceneFlyer:
    """Return this process's flyer of a task: the FMU is loaded once, and reset between scenes."""
    flyer = task.flyer()
    signal.signal(signal.SIGTERM, lambda *_: _end_worker(flyer))
    return flyer


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back while a worker is started: it inherits that, and so never hears of it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker() -> None:
    """Leave Ctrl-C to the parent, and end when the parent does, however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, name="follow-parent", daemon=True).start()


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)


def _end_worker(flyer: SceneFlyer) -> None:
    """End at once, whatever lock another worker took with it when it died, but leave no files."""
    flyer.close()
    os._exit(1)
