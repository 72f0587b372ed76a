"""Order and times of samples: duplicates, disorder, bursts, and repeats of held values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from cosim.simulation.signals import Array

Index = NDArray[np.int64]
Keys = NDArray[np.uint64]

_QUICK = 0.2  # mean periods; samples that follow sooner are part of a burst, or come twice
_MIN_BURSTING = 0.03  # minimum fraction of samples in bursts, below which the times are left as they are
_MIN_SAMPLES = 20  # for a judgement about all of them
_WINDOWS = (10, 100)  # samples, bounds of the windows over which the rate is compared
_EVEN, _EVEN_RATE = 0.8, 0.5  # fraction of windows whose rate differs by at most this fraction: the sampling is even
_ON_LINE, _UNEVEN = 0.9, 0.3  # minimum fraction of steps that differ from the period by at most this fraction of it
_LONGEST_STALL = 5.0  # s, longest delay of a burst
_MIN_SHIFT = 0.1  # periods; a sample that moves by less is not counted
_HELD = 1.0 / 3.0  # minimum fraction of repeats, from which on they are no samples of their own
_LONGEST_HOLD = 0.95  # quantile of the lengths of holds, beyond which a value is taken as sampled again


def drop_duplicates(times: Array, keys: Keys) -> Index:
    """Return the indices of the samples without those that repeat time [s] and value; `keys` stand for values."""
    index: Index = np.arange(len(times))
    order = np.argsort(times, kind="stable")
    if (is_copy := (np.diff(times[order]) == 0.0) & (keys[order[1:]] == keys[order[:-1]])).any():
        index = np.setdiff1d(index, order[1:][is_copy], assume_unique=True)
    del order
    repeats, quick = _repeats(keys[index]), np.append(False, _is_quick(times[index]))
    changes = np.flatnonzero(~repeats[:-1])
    again = repeats & quick
    # each value comes twice, at once: where values change, the next sample is a quick repeat, and no change is quick
    if len(changes) > _MIN_SAMPLES and again[changes + 1].mean() > 0.5 and quick[changes].mean() < 0.1:
        index = index[~again]
    return index


def put_in_order(times: Array) -> tuple[Index, Array, int]:
    """Return an order of samples, their times [s], and the number of samples that bursts had delayed."""
    order: Index = np.argsort(times, kind="stable")
    if _is_bursting(times[order]) and (line := _even_times(times)) is not None:
        is_shifted = np.abs(line - times) > _MIN_SHIFT * float(np.median(np.diff(line)))
        return np.arange(len(times)), line, int(np.count_nonzero(is_shifted))
    return order, times[order], 0


def drop_held(keys: Keys) -> tuple[Index, int]:
    """Return the indices of the samples without repeats of held values, and the maximum number that is held."""
    repeats = _repeats(keys)
    begins = np.flatnonzero(~repeats)
    if len(begins) < _MIN_SAMPLES // 2 or repeats.mean() < _HELD:
        return np.arange(len(keys)), 1
    stretch = max(2, int(np.quantile(np.diff(begins, append=len(keys)), _LONGEST_HOLD)))
    age = np.arange(len(keys)) - np.repeat(begins, np.diff(begins, append=len(keys)))
    return np.flatnonzero(age % stretch == 0), stretch


def longest_freeze(keys: Keys) -> tuple[int, int]:
    """Return first sample and length of the longest run of equal values."""
    begins = np.flatnonzero(~_repeats(keys))
    lengths = np.diff(begins, append=len(keys))
    longest = int(np.argmax(lengths))
    return int(begins[longest]), int(lengths[longest])


def is_shuffled(times: Array) -> bool:
    """Return True if times [s] step back often, and are even in order: the rows are out of order."""
    steps = np.diff(times)
    ordered = np.diff(np.sort(times))
    backward = np.count_nonzero(steps < 0.0)
    return bool(backward > max(2, 0.01 * len(times)) and ordered.max(initial=0.0) < 20.0 * np.median(ordered))


def _repeats(keys: Keys) -> NDArray[np.bool_]:
    return np.append(False, keys[1:] == keys[:-1])[: len(keys)]


def _is_quick(times: Array) -> NDArray[np.bool_]:
    """Return True for each step between samples that is far below the mean one."""
    steps = np.diff(times)
    usual = steps[np.abs(steps) < _LONGEST_STALL]
    return steps < _QUICK * float(usual.mean() if usual.size else 0.0)


def _is_bursting(times: Array) -> bool:
    """Return True if many samples follow each other far too soon, at a rate that is even beyond the bursts."""
    if len(times) < _MIN_SAMPLES or _is_quick(times).mean() < _MIN_BURSTING:
        return False
    width = int(np.clip(len(times) // 8, *_WINDOWS))
    spans = times[width:] - times[:-width]
    return bool(np.mean(np.abs(spans / np.median(spans) - 1.0) < _EVEN_RATE) > _EVEN)


def _even_times(times: Array) -> Array | None:
    """Return times [s] on a line of even steps under the earliest arrivals; None if there is no such line."""
    # A sample was taken before it arrived, and one period before the next one was taken: of the bounds that the next
    # arrivals give, the earliest holds. Lost samples shift no earlier one.
    count = np.arange(len(times))
    lag = max(1, len(times) // 4)
    period = float(np.median(times[lag:] - times[:-lag])) / lag
    line = times
    for _ in range(3):
        if period <= 0.0:
            return None
        steps = np.abs(np.diff(times))
        stall = float(steps[steps < _LONGEST_STALL].max(initial=period))
        half = int(stall / period) + 5
        ahead = minimum_filter1d(times - period * count, 2 * half + 1, origin=-half, mode="nearest")
        line = ahead + period * count
        period = float(np.median(line[lag:] - line[:-lag])) / lag
    on_line = np.abs(np.diff(line) / period - 1.0) < _UNEVEN
    return line if on_line.mean() > _ON_LINE else None
