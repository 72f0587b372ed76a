"""Measure the time of every engine for a system, one sample at a time and in batches."""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines import ENGINES
from fuzzy_arbiter.engines.firing import Array, Firing
from fuzzy_arbiter.errors import ArbiterError, EngineError

REPEATS = 5
_SECONDS = 0.06  # s, approximate duration of a repeat
_MOST_ROWS = 100_000


@dataclass(frozen=True, slots=True)
class Cost:
    """Times of one engine for one system."""

    engine: str  # name of the engine
    # median time of a call and of a row of a batch [us]; None if the engine cannot evaluate the system
    call: float | None
    # median time of a call and of a row of a batch [us]; None if the engine cannot evaluate the system
    row: float | None
    rows: int = 0  # rows of the batch
    reason: str = ""  # reason why there are no times


def bench(system: System) -> list[Cost]:
    """Measure the time of every engine for a system, over random samples that do not repeat in a row."""
    samples = _samples(system)
    if len(samples) == 0:
        raise ArbiterError("bench: at all random samples some output is undefined")
    costs = []
    for name in ENGINES:
        if name == "auto":
            continue
        try:
            arbiter = Arbiter(system=system, engine=name)
        except EngineError as error:
            costs.append(Cost(name, None, None, reason=str(error)))
            continue
        except ImportError as error:
            costs.append(Cost(name, None, None, reason=f"{error.name} is not installed"))
            continue
        row, rows = _median(_batch(arbiter, samples), len(samples))
        costs.append(Cost(name, _median(_calls(arbiter, samples), _MOST_ROWS)[0], row, rows))
    return costs


def _calls(arbiter: Arbiter, samples: Array) -> Callable[[int], object]:
    each = itertools.cycle(map(tuple, samples[:-20_001:-1].tolist()))  # not those that batches begin with

    def work(n: int) -> None:
        for inputs in itertools.islice(each, n):
            arbiter(inputs)

    return work


def _batch(arbiter: Arbiter, samples: Array) -> Callable[[int], object]:
    start = 0

    def work(n: int) -> None:
        nonlocal start  # the scikit-fuzzy engine caches results, so that each call gets new rows
        start = start + n if start + 2 * n <= len(samples) else 0
        arbiter.batch(samples[start : start + n])

    return work


def _median(work: Callable[[int], object], max_count: int) -> tuple[float, int]:
    """Return the median time of one of n things [us], and the n that takes about a repeat's time."""
    work(min(4, max_count))  # warm up: caches and lazy imports
    n, spent = 1, 0.0
    while True:
        spent = _timed(work, n)
        if spent > _SECONDS / 4.0 or n >= max_count:
            break
        n = min(max_count, n * 4)
    n = max(1, min(max_count, int(n * _SECONDS / max(spent, 1e-9))))
    return statistics.median(_timed(work, n) for _ in range(REPEATS)) / n * 1e6, n


def _timed(work: Callable[[int], object], n: int) -> float:
    before = time.perf_counter()
    work(n)
    return time.perf_counter() - before


def table(costs: list[Cost]) -> str:
    """Return costs as a table, with ratios to the engine that takes the least."""
    calls = [cost.call for cost in costs if cost.call is not None]
    rows = [cost.row for cost in costs if cost.row is not None]
    lines = [f"{'engine':8} {'call [us]':>12} {'ratio':>9}   {'batch [us a row]':>16} {'ratio':>9} {'rows':>8}"]
    for cost in costs:
        if cost.call is None or cost.row is None:
            lines.append(f"{cost.engine:8} {cost.reason}")
            continue
        lines.append(
            f"{cost.engine:8} {cost.call:12.3f} {cost.call / min(calls):9.1f}   "
            f"{cost.row:16.4f} {cost.row / min(rows):9.1f} {cost.rows:8}"
        )
    return "\n".join(lines)


def _samples(system: System) -> Array:
    """Return random samples of the universes at which every output has a default, or a rule that fires."""
    low, high = np.array([v.universe for v in system.inputs]).T
    samples: Array = np.random.default_rng(0).uniform(low, high, (_MOST_ROWS, len(system.inputs)))
    firing, defined = Firing(system), np.ones(_MOST_ROWS, dtype=np.bool_)
    for output, cuts in zip(system.outputs, firing.cuts(firing.strengths(samples)), strict=True):
        if output.default is None:
            defined &= cuts.any(axis=0)
    return samples[defined]
