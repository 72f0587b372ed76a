"""The autopilot's clock beside ours, by TIMESYNC."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

_KEPT = 16  # answers; the quickest of them is believed
_NANO = 1e9
_SLACK = 0.005  # s, of both clocks between two answers
_OPEN = 8  # requests whose answers still count


class ClockSync:
    """Estimates what is to be added to the autopilot's time since boot to have ours.

    Examples
    --------
    >>> from cosim.companion.clock_sync import ClockSync
    >>> sync = ClockSync()
    >>> sent = sync.request(100.0)
    >>> sync.take(7_005_000_000, sent, 100.01)  # it was 7.005 s there in the middle
    >>> round(sync.offset, 6)
    93.0
    """

    def __init__(self) -> None:
        self._asked: deque[int] = deque(maxlen=_OPEN)
        self._answers: deque[tuple[float, float]] = deque(maxlen=_KEPT)  # round trip [s], offset [s]

    def request(self, now: float) -> int:
        """Return the field ``ts1`` of a request that is sent at our time `now` [s]."""
        stamp = max(1, round(now * _NANO))
        self._asked.append(stamp)
        return stamp

    def take(self, tc1: int, ts1: int, now: float) -> None:
        """Take an answer that came at our time `now` [s].

        One that was not asked for counts as nothing. One that no earlier answer can be reconciled with ends these: the
        autopilot's clock began anew, or goes at another pace.
        """
        if tc1 <= 0 or ts1 not in self._asked:
            return
        self._asked.remove(ts1)
        sent = ts1 / _NANO
        round_trip, offset = now - sent, (now + sent) / 2.0 - tc1 / _NANO
        if self._answers and abs(offset - self.offset) > 0.5 * (round_trip + self.round_trip) + _SLACK:
            self._answers.clear()
        self._answers.append((round_trip, offset))

    @property
    def offset(self) -> float:
        """Our time less the autopilot's time since boot [s]; NaN before there is an answer."""
        return min(self._answers)[1] if self._answers else math.nan

    @property
    def round_trip(self) -> float:
        """Round-trip time of the fastest kept answer [s]; NaN before the first answer."""
        return min(self._answers)[0] if self._answers else math.nan


def timesync(mavlink: Any, ts1: int) -> Any:
    """Return the request."""
    return mavlink.MAVLink_timesync_message(0, ts1)
