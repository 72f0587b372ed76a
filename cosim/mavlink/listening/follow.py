"""Listen to a link for a time, for a number of messages, or until interrupted."""

from __future__ import annotations

import time
from collections.abc import Iterator

from cosim.mavlink.listening.telemetry_table import TelemetryTable
from cosim.mavlink.wire.ground_end import GroundLink

_HEARTBEAT_PERIOD = 1.0  # s between two heartbeats
_MAX_WAIT = 0.1  # s, longest wait for a message


def follow(
    link: GroundLink, table: TelemetryTable, period: float, seconds: float | None = None, count: int | None = None
) -> Iterator[float]:
    """Receive messages, and yield the time [s] whenever the table is due to be shown; period, seconds [s]."""
    started = now = time.monotonic()
    due, next_heartbeat = started + period, started
    while (seconds is None or now - started < seconds) and (count is None or table.total < count):
        if now >= next_heartbeat and link.sends_first:
            link.send_heartbeat()
            next_heartbeat = now + _HEARTBEAT_PERIOD
        end = due if seconds is None else min(due, started + seconds)
        for received in link.receive(min(_MAX_WAIT, max(0.0, end - now))):
            table.add(received)
            if table.total == count:
                break
        now = time.monotonic()
        table.sample(now)
        if now >= due:
            yield now
            due = max(due + period, now)
    yield now
