"""How the rows that are left are cut into batches: by the time that a row takes, as measured while it goes on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cosim.campaigns.workers.work import Rows

FIRST = 1  # rows in the first batch, before anybody knows how long a row takes
TARGET = 1.0  # s of work in a batch: it is sent, written and merged by one process, whatever the number of workers
LEAST = 0.05  # s of work in the small batches at the end, where workers would wait for each other
GROWTH = 4  # times the batch before, at the most: the first ones hold the time of compiling
EVEN = 16  # a batch of more rows is a multiple of this, for engines that fly rows side by side
GREATEST = 65536  # rows


@dataclass(frozen=True)
class Batch:
    """Rows that are flown together."""

    rows: Rows
    crash_count: int = 0  # how often a process has died of it
    alone: bool = False  # to be flown while nothing else is, so that a death can be laid to it

    def halves(self, crash_count: int) -> tuple[Batch, Batch]:
        """Return it in two parts, each of which begins with some strikes."""
        middle = len(self.rows) // 2
        return Batch(self.rows[:middle], crash_count, self.alone), Batch(self.rows[middle:], crash_count, self.alone)


class Batches:
    """The batches of a campaign, cut when they are asked for.

    Parameters
    ----------
    rows : ndarray of int, shape (n,)
        Those that are left, in rising order.
    """

    def __init__(self, rows: Rows) -> None:
        self._rows = rows
        self._at = 0
        self._back: list[Batch] = []
        self._size = FIRST
        self._row_time = math.inf  # s

    def take(self, width: int) -> Batch | None:
        """Return the next batch, None if there is none now.

        Parameters
        ----------
        width : int
            How many batches are flown at the same time.

        Returns
        -------
        Batch or None
            Those that were put back come first.
        """
        if self._back:
            return self._back.pop()
        left = len(self._rows) - self._at
        if not left:
            return None
        fair = max(math.ceil(LEAST / self._row_time), left // (2 * width)) if self._row_time < math.inf else FIRST
        size = min(self._size, fair)
        if size > EVEN:
            size -= size % EVEN
        batch = Batch(self._rows[self._at : self._at + size])
        self._at += len(batch.rows)
        return batch

    def put_back(self, batch: Batch) -> None:
        """Have a batch flown again, next."""
        self._back.append(batch)

    def measured(self, rows: int, seconds: float) -> None:
        """Take note of how long a batch took; one that is small by now may be a worker's first, and tells less."""
        if rows * GROWTH < self._size:
            return
        self._row_time = max(seconds, 1e-9) / rows
        self._size = int(np.clip(TARGET / self._row_time, 1, min(GROWTH * max(rows, self._size), GREATEST)))
