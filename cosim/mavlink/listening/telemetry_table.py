"""Received messages by kind and sender, in bounded memory for any input."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.ground_end import ReceivedMessage

MAX_ROWS = 300  # kinds of messages that have a row
MAX_TEXTS = 5  # status texts
_MAX_SAMPLES = 40  # samples of the count, for the rate
_SAMPLE_PERIOD = 0.25  # s between two samples
_NAMED = ("NAMED_VALUE_FLOAT", "NAMED_VALUE_INT", "DEBUG_VECT", "DEBUG_FLOAT_ARRAY")


class Key(NamedTuple):
    """Key of a row: sender and kind of message."""

    system: int
    component: int
    label: str  # the message's name, or NAME:name for named values


@dataclass
class Row:
    """Messages of one kind from one sender."""

    message: Any  # newest message
    last: float  # s, time of its reception
    count: int = 0
    samples: deque[tuple[float, int]] = field(default_factory=lambda: deque(maxlen=_MAX_SAMPLES))

    def rate(self, now: float) -> float:
        """Return the rate over the last 10 s, or since the first message [Hz]."""
        then, count = self.samples[0]
        return (self.count - count) / (now - then) if now > then else 0.0


class TelemetryTable:
    """Rows of messages, recent texts, and the vehicle's identity."""

    def __init__(self) -> None:
        self.rows: dict[Key, Row] = {}
        # time of reception [s] and message of recent STATUSTEXTs
        self.texts: deque[tuple[float, Any]] = deque(maxlen=MAX_TEXTS)
        self.vehicle: tuple[int, int] | None = None
        self.modes: dict[int, str] = {}
        self.total = self.omitted = 0
        self._mavlink = dialect()
        self._sampled_at = 0.0

    def add(self, received: ReceivedMessage) -> None:
        """Add a received message."""
        self.total += 1
        label, message = received.name, received.message
        if label in _NAMED:
            label = f"{label}:{printable(message.name)}"
        key = Key(received.system, received.component, label)
        row = self.rows.get(key)
        if row is None:
            if len(self.rows) >= MAX_ROWS:
                self.omitted += 1
                return
            row = self.rows[key] = Row(message, received.time)
            row.samples.append((received.time, 0 if received.name == "STATUSTEXT" else 1))
        row.message, row.last = message, received.time
        row.count += 1
        if received.name == "STATUSTEXT":
            self.texts.append((received.time, message))
        elif received.name == "HEARTBEAT" and self.vehicle is None and self._is_autopilot(message):
            self.vehicle = (received.system, received.component)
        elif received.name == "AVAILABLE_MODES" and len(self.modes) < MAX_ROWS:
            self.modes[message.custom_mode] = printable(message.mode_name)

    def sample(self, now: float) -> None:
        """Sample the counts for the rates at time `now` [s], at most every 0.25 s."""
        if now - self._sampled_at < _SAMPLE_PERIOD:
            return
        self._sampled_at = now
        for row in self.rows.values():
            row.samples.append((now, row.count))

    def last(self, kind: str) -> Any:
        """Return the vehicle's newest message of a kind, or None."""
        row = self.rows.get(Key(*self.vehicle, kind)) if self.vehicle else None
        return None if row is None else row.message

    def silence(self, now: float) -> float | None:
        """Return the time since the vehicle's last heartbeat [s] at time `now`; None before the first."""
        row = self.rows.get(Key(*self.vehicle, "HEARTBEAT")) if self.vehicle else None
        return None if row is None else now - row.last

    def _is_autopilot(self, heartbeat: Any) -> bool:
        m = self._mavlink
        return bool(heartbeat.type != m.MAV_TYPE_GCS and heartbeat.autopilot != m.MAV_AUTOPILOT_INVALID)


def printable(text: object) -> str:
    """Replace unprintable characters by "?", so that received text cannot control a terminal."""
    return "".join(c if c.isprintable() else "?" for c in str(text).rstrip("\0 "))
