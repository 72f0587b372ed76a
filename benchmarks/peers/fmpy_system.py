"""FMPy running a system structure by its `simulate_ssp`."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from fmpy.ssp.simulation import simulate_ssp

_LONG = 3000  # steps, least length of the timed run


def _simulate(setup: dict[str, Any], count: int) -> None:
    h = setup["step"]
    simulate_ssp(setup["ssp"], stop_time=(count - 0.5) * h, step_size=h)


def steps(setup: dict[str, Any]) -> Callable[[int], float]:
    """Return a function that measures the time of a number of steps [s], in a long run without the time to load."""

    def work(count: int) -> float:
        long = max(count, _LONG)
        started = time.perf_counter()
        _simulate(setup, 1)
        loaded = time.perf_counter()
        _simulate(setup, 1 + long)
        return (time.perf_counter() - loaded - (loaded - started)) * count / long

    return work


def runs(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that simulates a given number of whole runs, each with loading and unpacking."""
    whole = round(setup["duration"] / setup["step"])

    def work(count: int) -> None:
        for _ in range(count):
            _simulate(setup, whole)

    return work
