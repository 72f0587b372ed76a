"""Taking times, and printing them in one table."""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """Microseconds a step over some repeats."""

    least: float
    median: float
    most: float


def time_batches(batch: Callable[[], object], steps: int, repeats: int) -> Timing:
    """Time a function that takes `steps` steps a call; one more call goes before, to compile and to warm the caches."""
    batch()
    found = []
    for _ in range(repeats):
        before = time.perf_counter()
        batch()
        found.append((time.perf_counter() - before) / steps * 1e6)
    return summary(found)


def time_calls(work: Callable[[], object], calls: int, repeats: int) -> Timing:
    """Time a function that takes one step a call."""

    def batch() -> None:
        for _ in range(calls):
            work()

    work()
    return time_batches(batch, calls, repeats)


def summary(found: Sequence[float]) -> Timing:
    """Return the least, the median and the greatest of some times."""
    return Timing(min(found), statistics.median(found), max(found))


@dataclass(frozen=True)
class Row:
    """A line of the table: what was timed, or why it was not; `base` names the row its ratio is to."""

    name: str
    timing: Timing | str
    base: str


def print_rows(rows: Sequence[Row], repeats: int, ratio: str) -> None:
    """Print the times, and under the heading `ratio` how many times the median of its base row each takes."""
    machine = platform.processor() or platform.machine()
    print(f"{machine}, Python {platform.python_version()}, {repeats} repeats")
    medians = {row.name: row.timing.median for row in rows if isinstance(row.timing, Timing)}
    width = max(len(row.name) for row in rows)
    print(f"{'microseconds a step':{width}} {'least':>8} {'median':>8} {'most':>8} {ratio:>8}")
    for row in rows:
        if isinstance(row.timing, str):
            print(f"{row.name:{width}} {row.timing}")
            continue
        t = row.timing
        figures = (t.least, t.median, t.most, t.median / medians[row.base])
        print(f"{row.name:{width}} {' '.join(map(_figure, figures))}")


def _figure(x: float) -> str:
    return f"{x:8.2f}" if x >= 0.1 else f"{x:8.2g}"
