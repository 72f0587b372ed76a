"""Rows of a live run: all recent ones, and a thinned selection of old ones for viewers that connect late."""

from __future__ import annotations

from collections import deque

import numpy as np

from cosim.simulation.signals import Array

_MAX_BYTES = 8_000_000  # bound of the memory of old rows
_MAX_NEW = 256  # number of recent rows, which are all kept


class History:
    """Rows of a run, of which the old ones are thinned to bound the memory."""

    def __init__(self, columns: int, max_old: int | None = None) -> None:
        max_old = max_old or max(2, _MAX_BYTES // (8 * columns))
        self.count = 0
        self._columns = columns
        self._old: Array = np.empty((max_old, columns))
        self._numbers = np.zeros(max_old, dtype=np.int64)
        self._old_count = 0
        self._stride = 1  # of the old rows every n-th is kept
        self._new: deque[Array] = deque()

    def add(self, row: Array) -> None:
        """Add the next row, shape (columns,)."""
        self._new.append(row)
        self.count += 1
        if len(self._new) > _MAX_NEW:
            self._age(self._new.popleft(), self.count - _MAX_NEW)

    def _age(self, row: Array, number: int) -> None:
        if (number - 1) % self._stride:
            return
        if self._old_count == len(self._old):
            half = (self._old_count + 1) // 2
            self._old[:half], self._numbers[:half] = self._old[::2].copy(), self._numbers[::2].copy()
            self._old_count = half
            self._stride *= 2
            if (number - 1) % self._stride:
                return
        self._old[self._old_count], self._numbers[self._old_count] = row, number
        self._old_count += 1

    def since(self, number: int, max_rows: int) -> tuple[Array, int]:
        """Return the rows after that of a number; returns (rows, columns)."""
        first_new = self.count - len(self._new)  # rows up to this number are old
        if number < first_new:
            first = int(np.searchsorted(self._numbers[: self._old_count], number, side="right"))
            end = min(self._old_count, first + max_rows)
            if end > first:
                return self._old[first:end].copy(), int(self._numbers[end - 1])
            number = first_new
        rows = [self._new[i] for i in range(number - first_new, min(len(self._new), number - first_new + max_rows))]
        return np.array(rows).reshape(len(rows), self._columns), number + len(rows)
