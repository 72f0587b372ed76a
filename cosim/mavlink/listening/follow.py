"""Listening for as long as it is wanted."""

from __future__ import annotations

import time
from collections.abc import Iterator

from cosim.mavlink.listening.watch import Watch
from cosim.mavlink.wire.ground_end import GroundLink

_BEAT = 1.0  # s
_SLICE = 0.1  # s


def follow(
    link: GroundLink, watch: Watch, period: float, seconds: float | None = None, count: int | None = None
) -> Iterator[float]:
    """Listen, and say when a picture is due.

    Parameters
    ----------
    link : GroundLink
        Where to listen. Where a vehicle has to be spoken to before it speaks, our heartbeat goes out once a second.
    watch : Watch
        Takes what is heard.
    period : float
        Between pictures [s].
    seconds : float, optional
        For how long; default: until it is interrupted.
    count : int, optional
        Messages after which to end.

    Yields
    ------
    float
        Monotonic time [s], once a period, and at the end.
    """
    started = now = time.monotonic()
    due, beat = started + period, started
    while (seconds is None or now - started < seconds) and (count is None or watch.total < count):
        if now >= beat and link.speaks_first:
            link.beat()
            beat = now + _BEAT
        end = due if seconds is None else min(due, started + seconds)
        for heard in link.receive(min(_SLICE, max(0.0, end - now))):
            watch.take(heard)
            if watch.total == count:
                break
        now = time.monotonic()
        watch.sample(now)
        if now >= due:
            yield now
            due = max(due + period, now)
    yield now
