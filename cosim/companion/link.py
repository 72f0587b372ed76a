"""The interface of the companion's link, and its implementation by MAVLink."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Protocol

from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.ground_end import GroundLink, Heard, Identity

COMPANION: Identity = (255, 191)  # MAV_COMP_ID_ONBOARD_COMPUTER of the ground station's system


class AutopilotLink(Protocol):
    """Carries messages to an autopilot and from it."""

    name: str
    identity: tuple[int, int]  # system and component that the companion is

    def clock(self) -> float:
        """Return the time [s]; it only goes on."""
        ...

    def receive(self, timeout: float) -> Sequence[Heard]:
        """Return the received messages; wait at most `timeout` [s] for the first one."""
        ...

    def send(self, message: Any) -> bool:
        """Send a message; return whether it went out."""
        ...


class NetworkLink(GroundLink):
    """An endpoint, by the wall clock, or for a simulated autopilot by a faster or slower one.

    Parameters
    ----------
    endpoint : Endpoint
        A network or a serial device, of `parse_endpoint`.
    key : bytes, optional
        To sign with; then only what is signed with it is heard.
    identity : (int, int)
        System and component that the companion is.
    speedup : float
        Of a simulated autopilot: seconds of its clock a second of the wall's. A real one's is 1.

    Raises
    ------
    TelemetryError
        If it cannot be opened.

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

    def __enter__(self) -> NetworkLink:
        return self

    def clock(self) -> float:
        """Return `time.monotonic()` [s], as many times as fast as the speedup says."""
        return self._speedup * time.monotonic()

    def receive(self, timeout: float) -> list[Heard]:
        """Return the received messages as `GroundLink.receive` does, with times of this clock."""
        heard = super().receive(timeout / self._speedup)
        return [one._replace(time=self._speedup * one.time) for one in heard]
