"""Offset between the autopilot's clock and ours, estimated from TIMESYNC messages."""

from __future__ import annotations

import math
from collections import deque

_MAX_ANSWERS = 16  # latest ones; the offset is that of the one with the shortest round trip
_NANO = 1e9
_OFFSET_TOLERANCE = 0.005  # s, allowed drift of the two clocks between the fastest kept answer and a new one
_MAX_REQUESTS = 8  # latest ones, whose answers are accepted


class ClockSync:
    """Estimates the offset to add to the autopilot's time since boot to obtain our time."""

    def __init__(self) -> None:
        self._requests: deque[int] = deque(maxlen=_MAX_REQUESTS)
        self._answers: deque[tuple[float, float]] = deque(maxlen=_MAX_ANSWERS)  # round trip [s], offset [s]

    def request(self, now: float) -> int:
        """Return the field ``ts1`` [ns] of a request that is sent at our time `now` [s]."""
        stamp = max(1, round(now * _NANO))
        self._requests.append(stamp)
        return stamp

    def add_answer(self, tc1: int, ts1: int, now: float) -> None:
        """Process an answer, with its fields in ns, that arrived at our time `now` [s]."""
        # An answer without an open request is ignored. If the offset differs from that of the fastest kept answer by
        # more than their round trips explain, the answer replaces all earlier ones: the autopilot's clock has
        # restarted, or runs at another rate.
        if tc1 <= 0 or ts1 not in self._requests:
            return
        self._requests.remove(ts1)
        sent = ts1 / _NANO
        round_trip, offset = now - sent, (now + sent) / 2.0 - tc1 / _NANO
        if self._answers and abs(offset - self.offset) > 0.5 * (round_trip + self.round_trip) + _OFFSET_TOLERANCE:
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
