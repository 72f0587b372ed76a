"""Sweeps of the closed loop by workers, processes or a Dask cluster, that have started and compiled before."""

from __future__ import annotations

import itertools
import multiprocessing
import tempfile
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import ExitStack
from pathlib import Path

from benchmarks.contest import Entry
from benchmarks.contests.closed_loop import CHANGES, RUN, SCENARIO
from benchmarks.timing import Contestant
from cosim.scenario.scenario import load_scenario

_VARIED = ("initial.position.0=-0.2:0.2",)  # m, varied key and its range
_WARMING = 64  # rows per worker, of each of two sweeps before the timing


def sweep(pool: str, workers: int) -> Entry:
    """Return the entry of a sweep by ``processes`` or ``Dask``, whose items are runs; with its folder and summary."""

    def entry(stack: ExitStack) -> Contestant:
        contestant = _Sweep(stack.enter_context(_executor(pool, workers)), workers, stack)
        for _ in range(2):  # so that each worker has compiled
            contestant.seconds(_WARMING * workers)
        return contestant

    return entry


def _executor(pool: str, workers: int) -> Executor:
    if pool == "processes":
        return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))
    from cosim.campaigns.workers.cluster import cluster_executor

    executor: Executor = cluster_executor(None, workers)
    return executor


class _Sweep:
    """Sweeps, each into a folder of its own."""

    def __init__(self, executor: Executor, workers: int, stack: ExitStack) -> None:
        self._executor, self._workers = executor, workers
        self._scenario = load_scenario(SCENARIO, [*CHANGES, f"time.duration={RUN}"])
        self._folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="benchmark-")))
        self._numbers = itertools.count()

    def seconds(self, count: int) -> float:
        """Fly `count` rows, and return the time [s]."""
        from cosim.campaigns.parameter_sweep import run_sweep
        from cosim.campaigns.sweeps.design import Design, vary_from

        design = Design(vary_from(_VARIED), "random", count, 0)
        before = time.perf_counter()
        out = self._folder / str(next(self._numbers))
        run_sweep(self._scenario, design, out, workers=self._workers, executor=self._executor)
        return time.perf_counter() - before
