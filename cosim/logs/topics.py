"""Cleaning of samples: remove late ones and repeats of held values, spread bursts in time, count gaps."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cosim.errors import ImportLogError
from cosim.logs.quantities import QUANTITIES
from cosim.logs.spool import Source
from cosim.simulation.signals import Array

Convert = Callable[[Array], Array]

_EDGES = np.logspace(-6, 5, 4401)  # s, edges of the histogram of periods; neighbors differ by 0.6 %
_AROUND = 8  # number of bins on either side of the median whose mean is the period
_GAP_PERIODS, _MIN_GAP = 3.0, 0.3  # periods, s: a pause longer than both is a gap
_MAX_LISTED = 100  # maximum number of listed gaps
_RUNS, _REGULAR = 10, 0.6  # held values have at least so many runs of equal ones, and this fraction of similar lengths
_LONGEST_RUN = 1000  # samples, length from which on runs count as equally long
_QUICK, _BURSTING = 0.2, 0.3  # bursts: maximum distance of samples in mean periods; minimum fraction of such samples


@dataclass
class Topic:
    """A cleaned quantity of a log: its file has a time [s] and the components of each sample."""

    quantity: str
    name: str  # name of the source
    path: Path
    size: int  # number of components
    count: int = 0  # number of samples
    start: float = 0.0  # s, time of the first sample
    end: float = 0.0  # s, time of the last sample
    period: float = 0.0  # s, median time between samples
    held: int = 0  # number of removed repeats of held values
    burst: int = 0  # number of samples of bursts, moved in time
    late: int = 0  # number of removed samples out of order
    broken: int = 0  # number of omitted samples with a number that is not finite
    gap_count: int = 0
    gaps: list[tuple[float, float]] = field(default_factory=list)  # s, start and end of the longest gaps

    @property
    def longest(self) -> float:
        """Longest time between samples [s] that is not a gap."""
        return max(_GAP_PERIODS * self.period, _MIN_GAP)

    @property
    def rate(self) -> float:
        """Rate of the samples [Hz]; 0 if the period is unknown."""
        return 1.0 / self.period if self.period else 0.0


def clean(source: Source, times: Callable[[Array, Array], Array], convert: Convert | None, folder: Path) -> Topic:
    """Clean a source's samples, and write them as a topic; times (n,) [s], convert (n, size)."""
    topic = Topic(source.quantity, source.name, folder / f"{source.quantity}.topic", 0, broken=source.broken)
    stretch, bursts = _survey(source, times)
    spread = _spread(_timed(source, times), bursts, topic) if bursts else _timed(source, times)
    periods, heap, last, first = _Periods(), list[tuple[float, float]](), -np.inf, True
    previous, repeats = np.full(source.size, np.nan), 0
    with topic.path.open("wb") as file:
        for stamps, values in spread:
            highest = np.maximum.accumulate(np.concatenate([[last], stamps]))[:-1]
            rising = stamps > highest
            topic.late += int(np.count_nonzero(~rising))
            stamps, values = stamps[rising], values[rising]
            if not stamps.size:
                continue
            last = float(stamps[-1])
            fresh, repeats = _fresh(values, previous, repeats, stretch)
            previous = values[-1]
            topic.held += int(np.count_nonzero(~fresh))
            stamps, values = stamps[fresh], values[fresh]
            if not stamps.size:
                continue
            values = values if convert is None else convert(values)
            _require_plausible(source, values)
            steps = np.diff(stamps, prepend=np.nan if first else topic.end)
            for i in np.flatnonzero(steps > _MIN_GAP):
                push = heapq.heappush if len(heap) < 10 * _MAX_LISTED else heapq.heappushpop
                push(heap, (float(steps[i]), float(stamps[i])))
            periods.add(steps)
            topic.start = float(stamps[0]) if first else topic.start
            first, topic.end, topic.size = False, float(stamps[-1]), values.shape[1]
            topic.count += len(stamps)
            np.column_stack([stamps, values]).tofile(file)
    topic.period = periods.median()
    topic.gap_count = periods.above(topic.longest)
    topic.gaps = sorted((end - size, end) for size, end in heapq.nlargest(_MAX_LISTED, heap) if size > topic.longest)
    return topic


class _Periods:
    """A histogram of the times between samples."""

    def __init__(self) -> None:
        self.counts: NDArray[np.int64] = np.zeros(len(_EDGES) + 1, np.int64)
        self.sums: Array = np.zeros(len(_EDGES) + 1)

    def add(self, steps: Array) -> None:
        steps = steps[steps > 0.0]
        bins = np.searchsorted(_EDGES, steps)
        self.counts += np.bincount(bins, minlength=len(self.counts))
        self.sums += np.bincount(bins, steps, minlength=len(self.sums))

    def median(self) -> float:
        total = int(self.counts.sum())
        if not total:
            return 0.0
        middle = int(np.searchsorted(np.cumsum(self.counts), 0.5 * total))
        near = slice(max(0, middle - _AROUND), middle + _AROUND + 1)
        return float(self.sums[near].sum() / self.counts[near].sum())

    def above(self, size: float) -> int:
        return int(self.counts[np.searchsorted(_EDGES, size) + 1 :].sum())


def _timed(source: Source, times: Callable[[Array, Array], Array]) -> Iterator[tuple[Array, Array]]:
    for block in source.blocks():
        yield times(block[:, 0], block[:, 1]), block[:, 2:]


def _survey(source: Source, times: Callable[[Array, Array], Array]) -> tuple[int, float]:
    """Return the number of samples for which a value is held, 1 for none; and the mean period [s] of bursts, or 0."""
    runs: NDArray[np.int64] = np.zeros(_LONGEST_RUN + 1, np.int64)
    steps_all, run = _Periods(), 1
    previous, last, counted = np.full(source.size, np.nan), np.nan, 0
    spans: list[float] = []
    for stamps, values in _timed(source, times):
        same = (values == np.vstack([previous, values[:-1]])).all(axis=1)
        changes = np.flatnonzero(~same)
        lengths = np.diff(np.concatenate([[-run], changes]))
        lengths = lengths[1:] if counted == 0 else lengths
        runs += np.bincount(np.minimum(lengths, _LONGEST_RUN), minlength=len(runs))
        run = len(values) - int(changes[-1]) if changes.size else run + len(values)
        steps = np.diff(stamps, prepend=last)
        steps_all.add(steps)
        spans.append(float(steps[(steps > 0.0) & (steps < 2.0)].sum()))
        counted += int(np.count_nonzero(steps < 2.0))
        previous, last = values[-1], stamps[-1]
    stretch = _hold_length(runs) if QUANTITIES[source.quantity].kind in ("sensor", "state") else 1
    mean = sum(spans) / counted if counted else 0.0
    quick_count = source.count - 1 - steps_all.above(_QUICK * mean) if mean else 0
    bursting = mean > 0.0 and quick_count > _BURSTING * source.count and _is_grouped(source, times, 0.5 * mean)
    return stretch, mean if bursting else 0.0


def _is_grouped(source: Source, times: Callable[[Array, Array], Array], apart: float) -> bool:
    """Return True if most groups, more than `apart` [s] from each other, have several samples: these are bursts."""
    groups = alone = 0
    last = -np.inf
    for at, _ in _timed(source, times):
        begins = np.diff(at, prepend=last) > apart
        groups += int(np.count_nonzero(begins))
        alone += int(np.count_nonzero(begins[:-1] & begins[1:]))
        last = at[-1]
    return alone < 0.5 * groups


def _hold_length(runs: NDArray[np.int64]) -> int:
    """Return the number of samples for which a value is held, from counts of run lengths; 1 if it is not held."""
    total = int(runs.sum())
    if total < _RUNS:
        return 1
    middle = int(np.searchsorted(np.cumsum(runs), 0.5 * total))
    alike = int(runs[max(1, middle - 1) : middle + 2].sum())
    return middle + 1 if middle >= 2 and alike >= _REGULAR * total else 1  # one more, since lengths differ by one


def _fresh(values: Array, previous: Array, repeats: int, stretch: int) -> tuple[NDArray[np.bool_], int]:
    """Return a mask of new samples, (n,), and the number of repeats of the last value so far."""
    # A sample is new if its value changes, and at every `stretch`-th repeat.
    if stretch <= 1:
        return np.ones(len(values), bool), 0
    same = (values == np.vstack([previous, values[:-1]])).all(axis=1)
    index = np.arange(len(values))
    began = np.maximum.accumulate(np.where(same, -1 - repeats, index))  # start of the run of equal values
    age = index - began
    fresh: NDArray[np.bool_] = age % stretch == 0
    return fresh, int(age[-1])


def _spread(samples: Iterator[tuple[Array, Array]], period: float, topic: Topic) -> Iterator[tuple[Array, Array]]:
    """Spread the samples of each burst evenly in time before its last one, which alone was not delayed."""
    buffered, values = np.empty(0), None
    before = np.nan
    for more_at, more_values in samples:
        buffered = np.concatenate([buffered, more_at])
        values = more_values if values is None else np.vstack([values, more_values])
        ends = np.flatnonzero(np.diff(buffered) > 0.5 * period)
        if ends.size:
            done = int(ends[-1]) + 1
            yield _evenly(buffered[:done], before, period, topic), values[:done]
            before, buffered, values = float(buffered[done - 1]), buffered[done:], values[done:]
    if values is not None and buffered.size:
        yield _evenly(buffered, before, period, topic), values


def _evenly(at: Array, before: float, period: float, topic: Topic) -> Array:
    ends = np.append(np.flatnonzero(np.diff(at) > 0.5 * period), len(at) - 1)
    sizes = np.diff(ends, prepend=-1)
    since = np.diff(at[ends], prepend=before)
    with np.errstate(invalid="ignore"):
        spacing = np.where(since < 2.0 * sizes * period, since / sizes, period)  # NaN for the first one
    back = np.repeat(ends, sizes) - np.arange(len(at))
    topic.burst += int(np.count_nonzero(back))
    evened: Array = np.repeat(at[ends], sizes) - back * np.repeat(spacing, sizes)
    return evened


def _require_plausible(source: Source, values: Array) -> None:
    quantity, size = QUANTITIES[source.quantity], float(np.abs(values).max(initial=0.0))
    if not size <= quantity.max:
        raise ImportLogError(
            f"{source.name}: {source.quantity} reaches {size:.4g} {quantity.unit}".rstrip()
            + f", expected at most {quantity.max:.4g}: check its unit and frame"
        )
