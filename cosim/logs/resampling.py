"""Resample topics at the times of rows: states interpolated, others held, NaN in gaps."""

from __future__ import annotations

import numpy as np

from cosim.logs.cleaning.topics import Topic
from cosim.logs.spool import BLOCK
from cosim.simulation.signals import Array

_EXACT = 1e-6  # s, tolerance of equal times; for seconds since 1970, float64 resolves a quarter of it


class TopicReader:
    """Read a topic forward, and keep only the present window in memory."""

    def __init__(self, topic: Topic) -> None:
        self.topic = topic
        self._file = topic.path.open("rb")
        self._width = 1 + topic.size
        self._rows: Array = np.empty((0, self._width))
        self._more = True

    def close(self) -> None:
        """Close the topic's file."""
        self._file.close()

    def window(self, start: float, end: float) -> tuple[Array, Array]:
        """Return times [s] and components from the last sample before `start` to the first one after `end`."""
        # The `start` must not decrease between calls.
        while self._more and not (len(self._rows) and self._rows[-1, 0] > end):
            block = np.fromfile(self._file, count=BLOCK * self._width).reshape(-1, self._width)
            self._more = len(block) > 0
            self._rows = np.vstack([self._rows, block])
        first = max(0, int(np.searchsorted(self._rows[:, 0], start, "right")) - 1)
        self._rows = self._rows[first:]
        last = int(np.searchsorted(self._rows[:, 0], end, "right")) + 1
        return self._rows[:last, 0], self._rows[:last, 1:]

    def interpolate(self, query: Array) -> Array:
        """Interpolate the components at rising times, shape (n,); return shape (n, size), NaN in gaps."""
        times, values = self.window(float(query[0]), float(query[-1]))
        result = np.full((len(query), self.topic.size), np.nan)
        if not len(times):
            return result
        i = np.searchsorted(times, query + _EXACT, "right") - 1
        j = np.minimum(i + 1, len(times) - 1)
        i = np.maximum(i, 0)
        on = np.abs(times[i] - query) <= _EXACT
        inside = (times[i] <= query) & (query <= times[j]) & (times[j] - times[i] <= self.topic.longest)
        span = np.where(times[j] > times[i], times[j] - times[i], 1.0)
        part = np.where(on, 0.0, (query - times[i]) / span)[:, None]
        valid = inside | on
        a, b = values[i], values[j]
        if self.topic.quantity == "attitude":  # the shorter rotation; normalized linear interpolation of close samples
            b = np.where((a * b).sum(axis=1, keepdims=True) < 0.0, -b, b)
        mixed = a + part * (b - a)
        if self.topic.quantity == "attitude":
            mixed /= np.linalg.norm(mixed, axis=1, keepdims=True)
        result[valid] = mixed[valid]
        return result

    def hold(self, query: Array) -> tuple[Array, Array]:
        """Return components and time of the last sample at rising times, shapes (n, size) and (n,); NaN in gaps."""
        times, values = self.window(float(query[0]), float(query[-1]))
        result, when = np.full((len(query), self.topic.size), np.nan), np.full(len(query), np.nan)
        if not len(times):
            return result, when
        i = np.searchsorted(times, query + _EXACT, "right") - 1
        known = (i >= 0) & (query - times[np.maximum(i, 0)] <= self.topic.longest)
        result[known], when[known] = values[i[known]], times[i[known]]
        return result, when
