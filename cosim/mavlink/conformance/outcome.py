"""A check, what it is done to, and what comes of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from cosim.mavlink.conformance.client import Client
from cosim.mavlink.wire.ground_end import Heard

Status = Literal["pass", "fail", "skip", "differs"]  # the last: as this autopilot is known to


@dataclass(frozen=True)
class Outcome:
    """What came of a check, in a line."""

    status: Status
    received: str
    expected: str = ""


def passed(received: str) -> Outcome:
    """Return that what came is right."""
    return Outcome("pass", received)


def failed(received: str, expected: str) -> Outcome:
    """Return that something else was expected."""
    return Outcome("fail", received, expected)


def skipped(why: str) -> Outcome:
    """Return that there was nothing to check."""
    return Outcome("skip", why)


def judged(good: bool, received: str, expected: str) -> Outcome:
    """Return what came, and what was expected unless it is good."""
    return passed(received) if good else failed(received, expected)


@dataclass(frozen=True)
class Subject:
    """The vehicle that is checked, and what it sent of its own accord."""

    client: Client
    unasked: tuple[Heard, ...]  # what came before anything was asked of it
    seconds: float  # of the wall clock, in which that came
    writes: bool  # whether it may be armed, steered, and given another mission

    @property
    def mavlink(self) -> Any:
        """The dialect."""
        return self.client.mavlink

    @property
    def ardupilot(self) -> bool:
        """Whether it shows itself as ArduPilot."""
        vehicle = self.client.vehicle
        return vehicle is not None and bool(vehicle.autopilot == self.mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)

    @property
    def speed(self) -> float:
        """Seconds of the vehicle's clock that went by in a second."""
        return speed_of(self.unasked)

    def rates(self) -> dict[str, float]:
        """Return how often each message came, in a second of the vehicle's clock [Hz]."""
        counts = Counter(heard.kind for heard in self.unasked)
        return {kind: n / (self.seconds * self.speed) for kind, n in counts.items()}


def speed_of(heard: tuple[Heard, ...]) -> float:
    """Return how many seconds of the vehicle's clock go by in one of ours; 1 if it shows none.

    Parameters
    ----------
    heard : tuple of Heard
        In their order.

    Returns
    -------
    float
        From the boot times in the messages.
    """
    clocked = [(h.time, h.message.time_boot_ms * 1e-3) for h in heard if hasattr(h.message, "time_boot_ms")]
    if len(clocked) < 2 or clocked[-1][0] <= clocked[0][0] or clocked[-1][1] <= clocked[0][1]:
        return 1.0
    return float((clocked[-1][1] - clocked[0][1]) / (clocked[-1][0] - clocked[0][0]))


@dataclass(frozen=True)
class Check:
    """A named check, and whose way of working needs it."""

    name: str
    clients: tuple[str, ...]
    run: Callable[[Subject], Outcome]
    writes: bool = False  # it arms, steers, or changes the mission
