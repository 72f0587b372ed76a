"""A check, its subject, and its outcome."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from cosim.mavlink.wire.ground_end import ReceivedMessage
from tests.cosim.mavlink.conformance.client import Client

Status = Literal["pass", "fail", "skip"]


@dataclass(frozen=True)
class Outcome:
    """The outcome of a check, with one line of what was received and expected."""

    status: Status
    received: str
    expected: str = ""


def passed(received: str) -> Outcome:
    """Return a passed outcome."""
    return Outcome("pass", received)


def failed(received: str, expected: str) -> Outcome:
    """Return a failed outcome with what was expected."""
    return Outcome("fail", received, expected)


def skipped(why: str) -> Outcome:
    """Return a skipped outcome with its reason."""
    return Outcome("skip", why)


def judged(good: bool, received: str, expected: str) -> Outcome:
    """Return a passed outcome if `good`, else a failed one with what was expected."""
    return passed(received) if good else failed(received, expected)


@dataclass(frozen=True)
class Subject:
    """The checked vehicle, and the messages that it streams unasked."""

    client: Client
    unasked: tuple[ReceivedMessage, ...]  # messages before the first request
    seconds: float  # s of the wall clock, in which these were received

    @property
    def mavlink(self) -> Any:
        """The dialect."""
        return self.client.mavlink

    @property
    def ardupilot(self) -> bool:
        """True if its heartbeat is ArduPilot's."""
        vehicle = self.client.vehicle
        return vehicle is not None and bool(vehicle.autopilot == self.mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)

    @property
    def speed(self) -> float:
        """Seconds of the vehicle's clock per second of the wall clock."""
        return speed_of(self.unasked)

    def rates(self) -> dict[str, float]:
        """Return the rate of each unasked message by the vehicle's clock [Hz]."""
        counts = Counter(heard.name for heard in self.unasked)
        return {kind: n / (self.seconds * self.speed) for kind, n in counts.items()}


def speed_of(heard: tuple[ReceivedMessage, ...]) -> float:
    """Return the seconds of the vehicle's clock per second of the wall clock; 1 if it sends no time."""
    clocked = [(h.time, h.message.time_boot_ms * 1e-3) for h in heard if hasattr(h.message, "time_boot_ms")]
    if len(clocked) < 2 or clocked[-1][0] <= clocked[0][0] or clocked[-1][1] <= clocked[0][1]:
        return 1.0
    return float((clocked[-1][1] - clocked[0][1]) / (clocked[-1][0] - clocked[0][0]))


@dataclass(frozen=True)
class Check:
    """A named check, and the ground stations that need it."""

    name: str
    clients: tuple[str, ...]
    run: Callable[[Subject], Outcome]
