"""Measure times: of calls, of batches, and of contestants that take turns."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

_MAX_ITEMS = 10**9  # maximum number of items of a repeat


class NotMeasuredError(Exception):
    """Raised for a contestant that could not be timed; the text is the reason."""


@dataclass(frozen=True)
class Timing:
    """Times of an item (a step, a call, a run), one sample for each repeat."""

    samples: tuple[float, ...]  # s

    @property
    def min(self) -> float:
        """Minimum time of an item [s]."""
        return min(self.samples)

    @property
    def median(self) -> float:
        """Median time of an item [s]."""
        return statistics.median(self.samples)

    @property
    def max(self) -> float:
        """Maximum time of an item [s]."""
        return max(self.samples)


class Contestant(Protocol):
    """Work that can be timed in turn with others, in this process or another one."""

    def seconds(self, count: int) -> float:
        """Run `count` items, and return their time [s]; raise NotMeasuredError with the reason for a failure."""
        ...


class InProcess:
    """A contestant in this process."""

    def __init__(self, work: Callable[[int], object]) -> None:
        self._work = work

    def seconds(self, count: int) -> float:
        """Run `count` items, and return their time [s]."""
        before = time.perf_counter()
        self._work(count)
        return time.perf_counter() - before


def repeat_call(work: Callable[[], object]) -> Callable[[int], None]:
    """Return a function that calls `work` a given number of times."""

    def batch(count: int) -> None:
        for _ in range(count):
            work()

    return batch


def time_contestant(contestant: Contestant, count: int, repeats: int) -> Timing:
    """Time `count` items per repeat, after one more repeat that compiles and warms the caches."""
    contestant.seconds(count)
    return Timing(tuple(contestant.seconds(count) / count for _ in range(repeats)))


def time_batches(batch: Callable[[], object], items: int, repeats: int) -> Timing:
    """Time a function that runs `items` items per call."""
    return time_contestant(InProcess(lambda _: batch()), items, repeats)


def time_calls(work: Callable[[], object], calls: int, repeats: int) -> Timing:
    """Time a function that runs one item per call."""
    return time_contestant(InProcess(repeat_call(work)), calls, repeats)


def take_turns(
    contestants: Sequence[Contestant | str], budget: float, repeats: int, count: int | None = None
) -> list[Timing | str]:
    """Time contestants in turn, which load affects alike; budget [s] of a repeat, or `count` without a warm-up."""
    all_samples: list[list[float] | str] = [[] if not isinstance(one, str) else one for one in contestants]
    counts = [0] * len(contestants)
    for repeat in range(repeats):
        for i, one in enumerate(contestants):
            samples = all_samples[i]
            if isinstance(one, str) or isinstance(samples, str):
                continue
            try:
                if not repeat:
                    counts[i] = count or count_for(one, budget)
                samples.append(one.seconds(counts[i]) / counts[i])
            except NotMeasuredError as why:
                all_samples[i] = str(why)
    return [one if isinstance(one, str) else Timing(tuple(one)) for one in all_samples]


def count_for(contestant: Contestant, budget: float) -> int:
    """Return the number of items that take a contestant at least `budget` [s]; its caches are warm afterwards."""
    contestant.seconds(1)
    count = 1
    while (elapsed := contestant.seconds(count)) < budget and count < _MAX_ITEMS:
        # a fast item is mostly overhead at first, so increase the count in steps
        count = min(max(2 * count, int(1.1 * count * budget / max(elapsed, 1e-9))), 100 * count, _MAX_ITEMS)
    return count


def fit_exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Return the exponent k of cost = c size^k, by least squares in logarithms."""
    import numpy as np

    slope, _ = np.polyfit(np.log(sizes), np.log(costs), 1)
    return float(slope)


def fit_line(sizes: Sequence[float], costs: Sequence[float]) -> tuple[float, float, float]:
    """Fit cost = a + b size, a, b >= 0, by least squares of relative errors; return a, b and the maximum error."""
    import numpy as np
    from scipy.optimize import nnls

    per_cost = np.c_[np.ones(len(sizes)), np.asarray(sizes, dtype=float)] / np.array(costs)[:, None]
    (fixed, per_item), _ = nnls(per_cost, np.ones(len(costs)))
    return float(fixed), float(per_item), float(np.abs(per_cost @ (fixed, per_item) - 1.0).max())
