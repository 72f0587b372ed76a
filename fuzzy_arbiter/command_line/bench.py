"""Measure the time of every engine for a system, one sample at a time and in batches."""

from __future__ import annotations

import itertools
import statistics
import timeit
from collections.abc import Callable
from functools import partial

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines import ENGINES
from fuzzy_arbiter.errors import EngineError

REPEATS = 5
_SECONDS = 0.06  # s, approximate duration of a repeat
_MAX_COUNT = 100_000  # maximum number of calls, and of rows of a batch


def bench(system: System) -> str:
    """Measure the times of every engine over random samples; return a table with ratios to the fastest engine."""
    low, high = np.array([v.universe for v in system.inputs]).T
    samples = np.random.default_rng(0).uniform(low, high, (_MAX_COUNT, len(low)))
    rows = [tuple(row) for row in samples[:20_000].tolist()]
    costs: dict[str, tuple[float, float, int] | str] = {}  # of a call and of a row [us], rows; or why there are none
    for name in ENGINES[1:]:
        try:
            arbiter = Arbiter(system, engine=name)
        except EngineError as error:
            costs[name] = str(error)
            continue
        call, _ = _median(lambda n, a=arbiter: [a(row) for row in itertools.islice(itertools.cycle(rows), n)])  # type: ignore[misc]
        row, count = _median(lambda n, a=arbiter: a.batch(samples[:n]))  # type: ignore[misc]
        costs[name] = call, row, count
    fastest = [
        min(column) for column in zip(*(cost for cost in costs.values() if not isinstance(cost, str)), strict=True)
    ]
    lines = [f"{'engine':8} {'call [us]':>12} {'ratio':>9}   {'batch [us a row]':>16} {'ratio':>9} {'rows':>8}"]
    for name, cost in costs.items():
        if isinstance(cost, str):
            lines.append(f"{name:8} {cost}")
        else:
            call, row, count = cost
            ratios = call / fastest[0], row / fastest[1]
            lines.append(f"{name:8} {call:12.3f} {ratios[0]:9.1f}   {row:16.4f} {ratios[1]:9.1f} {count:8}")
    return "\n".join(lines)


def _median(work: Callable[[int], object]) -> tuple[float, int]:
    """Return the median time of one of n things [us], and the n that takes about a repeat's time."""
    n, seconds = 4, timeit.timeit(partial(work, 4), number=1)  # which warms caches and lazy imports up, too
    while seconds < _SECONDS / 4.0 and n < _MAX_COUNT:
        n = min(_MAX_COUNT, n * 4)
        seconds = timeit.timeit(partial(work, n), number=1)
    return statistics.median(timeit.repeat(partial(work, n), number=1, repeat=REPEATS)) / n * 1e6, n
