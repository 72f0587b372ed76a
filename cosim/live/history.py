"""Rows of a live run: all recent ones, and a thinned selection of old ones for viewers that connect late."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from cosim.simulation.signals import Array

_MAX_BYTES = 8_000_000  # bound of the memory of old rows
_MAX_NEW = 256  # number of recent rows, which are all kept


class History:
    """Rows of a run, of which the old ones are thinned to bound the memory."""

    def __init__(self, columns: int, max_old: int | None = None) -> None:
        self.count = 0
        self._columns = columns
        self._max_old = max_old or max(2, _MAX_BYTES // (8 * columns))
        self._rows: list[Array] = []
        self._numbers: list[int] = []  # of each kept row, from 1
        self._stride = 1  # of the old rows every n-th is kept

    def add(self, row: Array) -> None:
        """Add the next row, shape (columns,)."""
        self.count += 1
        self._rows.append(row.copy())  # a view would keep its whole block in memory
        self._numbers.append(self.count)
        oldest_new = len(self._rows) - _MAX_NEW
        if oldest_new > 0 and (self._numbers[oldest_new - 1] - 1) % self._stride:
            del self._rows[oldest_new - 1], self._numbers[oldest_new - 1]
        elif oldest_new > self._max_old:
            self._stride *= 2
            self._rows[:oldest_new] = self._rows[:oldest_new:2]
            self._numbers[:oldest_new] = self._numbers[:oldest_new:2]

    def since(self, number: int, max_rows: int) -> tuple[Array, int]:
        """Return the rows after that of a number; returns (rows, columns)."""
        first = bisect_right(self._numbers, number)
        rows = self._rows[first : first + max_rows]
        last = self._numbers[first + len(rows) - 1] if rows else number
        return np.array(rows).reshape(len(rows), self._columns), last
