"""The interface of the companion's link, and its implementation by MAVLink."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Protocol

from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.ground_end import GroundLink, Identity, ReceivedMessage

COMPANION: Identity = (255, 191)  # MAV_COMP_ID_ONBOARD_COMPUTER of the ground station's system


class AutopilotLink(Protocol):
    """Carries messages to and from an autopilot."""

    name: str
    identity: tuple[int, int]  # the companion's own system id and component id

    def clock(self) -> float:
        """Return the time [s] of a monotonic clock."""
        ...

    def receive(self, timeout: float) -> Sequence[ReceivedMessage]:
        """Return the received messages; wait at most `timeout` [s] for the first one."""
        ...

    def send(self, message: Any) -> bool:
        """Send a message; return True if it was sent."""
        ...


class NetworkLink(GroundLink):
    """MAVLink over an endpoint, timed by the wall clock, or for a simulated autopilot by a faster or slower clock.

    Parameters
    ----------
    endpoint : Endpoint
        Network address or serial device, from `parse_endpoint`.
    key : bytes, optional
        Signing key; with it, only messages signed with the same key are received.
    identity : (int, int)
        The companion's own system id and component id.
    speedup : float
        Seconds of a simulated autopilot's clock per second of the wall clock; 1 for a real one.

    Raises
    ------
    TelemetryError
        If the endpoint cannot be opened.

    Examples
    --------
    >>> import cosim
    >>> with cosim.NetworkLink(cosim.parse_endpoint("udpout:127.0.0.1:14599"), identity=(255, 191)) as link:
    ...     link.receive(0.0)
    []
    """

    def __init__(
        self, endpoint: Endpoint, key: bytes | None = None, identity: Identity = COMPANION, speedup: float = 1.0
    ) -> None:
        super().__init__(endpoint, key, identity)
        self._speedup = speedup

    def clock(self) -> float:
        """Return `time.monotonic()` times the speedup [s]."""
        return self._speedup * time.monotonic()

    def receive(self, timeout: float) -> list[ReceivedMessage]:
        """Return the received messages, stamped with times of this clock; wait at most `timeout` [s] of it."""
        messages = super().receive(timeout / self._speedup)
        return [message._replace(time=self._speedup * message.time) for message in messages]
