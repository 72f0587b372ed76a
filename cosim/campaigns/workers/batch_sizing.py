"""Cuts the rows that are left into batches, sized by the measured time of a row."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cosim.campaigns.workers.work import Rows

FIRST = 1  # number of rows of the first batch, before the time of a row is known
TARGET = 1.0  # s, desired time of a batch; one process submits and writes all batches, for any number of workers
LEAST = 0.05  # s, least time of a batch; the last ones are small, so that all workers end together
GROWTH = 4  # greatest ratio of a batch's size to the one before: the time of first batches includes compiling
GREATEST = 65536  # greatest number of rows of a batch


@dataclass(frozen=True)
class Batch:
    """Rows that one worker flies together."""

    rows: Rows  # (n,) numbers of the rows
    crash_count: int = 0  # number of worker crashes during this batch
    alone: bool = False  # True if no other batch is flown at the same time, so that a crash is certainly by this one

    def halves(self, crash_count: int) -> tuple[Batch, Batch]:
        """Split the batch into halves, each of which begins with `crash_count`."""
        middle = len(self.rows) // 2
        return Batch(self.rows[:middle], crash_count, self.alone), Batch(self.rows[middle:], crash_count, self.alone)


class Batches:
    """The batches of a campaign, cut as they are taken; rows (n,)."""

    def __init__(self, rows: Rows) -> None:
        self._rows = rows
        self._at = 0
        self._back: list[Batch] = []
        self._size = FIRST
        self._row_time = math.inf  # s, measured time of a row

    def take(self, width: int) -> Batch | None:
        """Take the next batch."""
        if self._back:
            return self._back.pop()
        left = len(self._rows) - self._at
        if not left:
            return None
        fair = max(math.ceil(LEAST / self._row_time), left // (2 * width)) if self._row_time < math.inf else FIRST
        size = min(self._size, fair)
        batch = Batch(self._rows[self._at : self._at + size])
        self._at += len(batch.rows)
        return batch

    def put_back(self, batch: Batch) -> None:
        """Put a batch back, to be taken next."""
        self._back.append(batch)

    def measured(self, rows: int, seconds: float) -> None:
        """Adapt the size by the time of a batch [s]; ignore a relatively small one: it may include start-up."""
        if rows * GROWTH < self._size:
            return
        self._row_time = max(seconds, 1e-9) / rows
        self._size = int(np.clip(TARGET / self._row_time, 1, min(GROWTH * max(rows, self._size), GREATEST)))
