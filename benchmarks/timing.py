"""Taking times: of calls, of batches, and of contestants that take turns."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

_MOST = 10**9  # items a batch


class NotMeasuredError(Exception):
    """Says why something could not be timed."""


@dataclass(frozen=True)
class Timing:
    """Seconds an item (a step, a call, a run), one figure for each repeat."""

    samples: tuple[float, ...]

    @property
    def least(self) -> float:
        """The least [s]."""
        return min(self.samples)

    @property
    def median(self) -> float:
        """The median [s]."""
        return statistics.median(self.samples)

    @property
    def most(self) -> float:
        """The greatest [s]."""
        return max(self.samples)


class Contestant(Protocol):
    """What can be timed in turn with others, in this process or another one."""

    def seconds(self, count: int) -> float:
        """Do `count` items, and return what they took [s]; NotMeasuredError says why it cannot."""
        ...


class Own:
    """A contestant in this process.

    Parameters
    ----------
    work : callable
        Does as many items as it is told.
    """

    def __init__(self, work: Callable[[int], object]) -> None:
        self._work = work

    def seconds(self, count: int) -> float:
        """Do `count` items, and return what they took [s]."""
        before = time.perf_counter()
        self._work(count)
        return time.perf_counter() - before


def each(work: Callable[[], object]) -> Callable[[int], None]:
    """Return a function that does an item so many times, of one that does it once."""

    def batch(count: int) -> None:
        for _ in range(count):
            work()

    return batch


def timed(contestant: Contestant, count: int, repeats: int) -> Timing:
    """Time so many items a repeat; one more repeat goes before, to compile and to warm the caches."""
    contestant.seconds(count)
    return Timing(tuple(contestant.seconds(count) / count for _ in range(repeats)))


def time_batches(batch: Callable[[], object], items: int, repeats: int) -> Timing:
    """Time a function that does `items` items a call."""
    return timed(Own(lambda _: batch()), items, repeats)


def time_calls(work: Callable[[], object], calls: int, repeats: int) -> Timing:
    """Time a function that does one item a call."""
    return timed(Own(each(work)), calls, repeats)


def take_turns(
    contestants: Sequence[Contestant | str], budget: float, repeats: int, count: int | None = None
) -> list[Timing | str]:
    """Time contestants in turn, so that what else the machine does meets all of them alike.

    Parameters
    ----------
    contestants : sequence of Contestant or str
        Where a word stands in place of one, it is returned.
    budget : float
        What a repeat shall take [s], at least: the items of each contestant are counted for that.
    repeats : int
        How often each has its turn.
    count : int, optional
        Items a repeat, in place of the budget; then nothing goes before to warm up.

    Returns
    -------
    list of Timing or str
        In their order; a word where one failed on the way.
    """
    found: list[list[float] | str] = [[] if not isinstance(one, str) else one for one in contestants]
    counts = [0] * len(contestants)
    for repeat in range(repeats):
        for i, one in enumerate(contestants):
            samples = found[i]
            if isinstance(one, str) or isinstance(samples, str):
                continue
            try:
                if not repeat:
                    counts[i] = count or count_for(one, budget)
                samples.append(one.seconds(counts[i]) / counts[i])
            except NotMeasuredError as why:
                found[i] = str(why)
    return [one if isinstance(one, str) else Timing(tuple(one)) for one in found]


def count_for(contestant: Contestant, budget: float) -> int:
    """Return how many items take a contestant so many seconds; it is warm then."""
    contestant.seconds(1)
    count = 1
    while (taken := contestant.seconds(count)) < budget and count < _MOST:
        # what is fast is mostly overhead at first, so go up in helpings
        count = min(max(2 * count, int(1.1 * count * budget / max(taken, 1e-9))), 100 * count, _MOST)
    return count


def growth(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Return the exponent k of cost = c size^k, by least squares in logarithms."""
    import numpy as np

    slope, _ = np.polyfit(np.log(sizes), np.log(costs), 1)
    return float(slope)


def straight(sizes: Sequence[float], costs: Sequence[float]) -> tuple[float, float, float]:
    """Return a and b of cost = a + b size, neither below 0, by least squares of relative errors, and the greatest."""
    import numpy as np
    from scipy.optimize import nnls

    per_cost = np.c_[np.ones(len(sizes)), np.asarray(sizes, dtype=float)] / np.array(costs)[:, None]
    (fixed, each), _ = nnls(per_cost, np.ones(len(costs)))
    return float(fixed), float(each), float(np.abs(per_cost @ (fixed, each) - 1.0).max())
