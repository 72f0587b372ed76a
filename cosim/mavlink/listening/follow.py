"""Listen to a link for a time, for a number of messages, or until interrupted."""

from __future__ import annotations

import time
from collections.abc import Iterator

from cosim.mavlink.listening.telemetry_table import Watch
from cosim.mavlink.wire.ground_end import GroundLink

_BEAT = 1.0  # s between two heartbeats
_SLICE = 0.1  # s, longest wait for a message


def follow(
    link: GroundLink, watch: Watch, period: float, seconds: float | None = None, count: int | None = None
) -> Iterator[float]:
    """Receive messages, and yield whenever the table is due to be shown.

    Parameters
    ----------
    link : GroundLink
        Link to listen on. A link that speaks first also sends a heartbeat once a second.
    watch : Watch
        Watch that records the messages.
    period : float
        Time between two yields [s].
    seconds : float, optional
        Duration [s]; default: until interrupted.
    count : int, optional
        Number of messages after which listening ends; default: no limit.

    Yields
    ------
    float
        Monotonic time [s], once per period, and at the end.
    """
    started = now = time.monotonic()
    due, beat = started + period, started
    while (seconds is None or now - started < seconds) and (count is None or watch.total < count):
        if now >= beat and link.sends_first:
            link.send_heartbeat()
            beat = now + _BEAT
        end = due if seconds is None else min(due, started + seconds)
        for heard in link.receive(min(_SLICE, max(0.0, end - now))):
            watch.add(heard)
            if watch.total == count:
                break
        now = time.monotonic()
        watch.sample(now)
        if now >= due:
            yield now
            due = max(due + period, now)
    yield now
