"""Cuts the rows that are left into batches, sized by the measured time of a row."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cosim.campaigns.workers.work import Rows

FIRST = 1  # number of rows of the first batch, before the time of a row is known
TARGET = 1.0  # s, desired time of a batch; one process submits and writes all batches, for any number of workers
MIN_TIME = 0.05  # s, least time of a batch; the last ones are small, so that all workers end together
GROWTH = 4  # maximum ratio of a batch's size to the one before: the time of first batches includes compiling
MAX_ROWS = 65536  # maximum number of rows of a batch


@dataclass(frozen=True)
class Batch:
    """Rows that one worker flies together."""

    rows: Rows  # (n,) numbers of the rows
    crash_count: int = 0  # number of worker crashes during this batch
    alone: bool = False  # True if no other batch is flown at the same time, so that a crash is certainly by this one

    def halves(self, crash_count: int) -> list[Batch]:
        """Split the batch into halves, each of which begins with `crash_count`."""
        return [Batch(rows, crash_count, self.alone) for rows in np.array_split(self.rows, 2)]


class Batches:
    """The batches of a campaign, made on demand."""

    def __init__(self) -> None:
        self._rows: Rows = np.empty(0, np.int64)  # rows that no batch has had yet
        self._returned: list[Batch] = []
        self._size = FIRST
        self._row_time = math.inf  # s, measured time of a row

    def add(self, rows: Rows) -> None:
        """Add rows, shape (n,)."""
        self._rows = np.concatenate([self._rows, rows])

    def take(self, width: int) -> Batch | None:
        """Take the next batch."""
        if self._returned:
            return self._returned.pop()
        left = len(self._rows)
        if not left:
            return None
        fair = max(math.ceil(MIN_TIME / self._row_time), left // (2 * width)) if self._row_time < math.inf else FIRST
        size = min(self._size, fair)
        batch, self._rows = Batch(self._rows[:size]), self._rows[size:]
        return batch

    def put_back(self, batch: Batch) -> None:
        """Put a batch back, to be taken next."""
        self._returned.append(batch)

    def measured(self, rows: int, seconds: float) -> None:
        """Adapt the size by the time of a batch [s]; ignore a relatively small one: it may include start-up."""
        if rows * GROWTH < self._size:
            return
        self._row_time = max(seconds, 1e-9) / rows
        self._size = int(np.clip(TARGET / self._row_time, 1, min(GROWTH * max(rows, self._size), MAX_ROWS)))
