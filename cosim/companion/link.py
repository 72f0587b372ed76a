"""What the companion needs of a link, and the real one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Protocol

from cosim.mavlink.wire.ground_end import GroundLink, Heard


class AutopilotLink(Protocol):
    """Carries messages to an autopilot and from it."""

    name: str
    identity: tuple[int, int]  # system and component that the companion is

    def clock(self) -> float:
        """Return the time [s]; it only goes on."""
        ...

    def receive(self, timeout: float) -> Sequence[Heard]:
        """Return what has come, waiting for the first of it for `timeout` seconds at the most."""
        ...

    def send(self, message: Any) -> bool:
        """Send a message; return whether it went out."""
        ...


class NetworkLink(GroundLink):
    """An endpoint, by the wall clock.

    Parameters
    ----------
    endpoint : Endpoint
        A network or a serial device, of `parse_endpoint`.
    key : bytes, optional
        To sign with; then only what is signed with it is heard.
    identity : (int, int)
        System and component that the companion is.

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

    def __enter__(self) -> NetworkLink:
        return self

    @staticmethod
    def clock() -> float:
        """Return `time.monotonic()` [s]."""
        return time.monotonic()
