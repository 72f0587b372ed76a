"""Pace of simulated time against the wall clock."""

from __future__ import annotations

import time
from collections.abc import Callable

_MAX_LAG = 0.1  # s of the wall clock: lag that is caught up; beyond it the schedule shifts
_MAX_SLEEP = 3600.0  # s of the wall clock, longest sleep between two periods


class Pace:
    """Schedule of periods that begin no earlier than the wall clock says; period [s], clock [s], sleep [s]."""

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period, self._clock, self._sleep = period, clock, sleep
        self._due = clock()

    def wait(self) -> None:
        """Wait until the next period begins. A delay of more than 0.1 s, such as loading, is not caught up."""
        now = self._clock()
        self._due = max(self._due + self._period, now - _MAX_LAG)
        if self._due > now:
            self._sleep(min(self._due - now, _MAX_SLEEP))
