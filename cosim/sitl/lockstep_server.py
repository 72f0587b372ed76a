"""A socket on which an autopilot flies runs in lockstep with the plant."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from cosim.errors import RunError
from cosim.sitl.sitl_session import FrameCounts, Outcome, SitlSession

log = logging.getLogger(__name__)

POLL = 0.25  # s of the wall clock, timeout of a socket, after which the silence is checked


@dataclass(eq=False)
class LockstepServer:
    """Server of one kind of autopilot; it opens its socket at once."""

    kind: ClassVar[socket.SocketKind]
    flights: SitlSession
    address: tuple[str, int]  # of the open socket; port 0 requests a free one
    timeout: float | None = None  # s of the wall clock, silence of the autopilot that ends the session
    report: Callable[[str], None] = log.info  # receives a line for each run

    def __post_init__(self) -> None:
        self.counts = FrameCounts()
        self._socket = socket.socket(socket.AF_INET, self.kind)
        is_stream = self.kind == socket.SOCK_STREAM
        try:
            if is_stream:
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind(self.address)
            if is_stream:
                self._socket.listen(1)
        except OSError as error:
            self._socket.close()
            host, port = self.address
            raise RunError(f"{'TCP' if is_stream else 'UDP'} {host}:{port}: {error.strerror or error}") from error
        self._socket.settimeout(POLL if self.timeout is None else min(POLL, self.timeout))
        self.address = self._socket.getsockname()
        self._received = time.monotonic()

    def serve(self) -> Outcome:
        """Fly until the scenario's end, a timeout, or Ctrl-C, as `SitlSession.fly`."""
        try:
            return self.flights.fly(self._serve, self.counts)
        finally:
            self.close()

    def _serve(self) -> str:
        """Serve the autopilot; return the status of the last run."""
        raise NotImplementedError

    def close(self) -> None:
        """Close the socket. May be called twice."""
        self._socket.close()

    def _silence(self) -> str:
        """Return the status of a session whose autopilot was silent for longer than the timeout; else an empty text."""
        is_silent = self.timeout is not None and time.monotonic() - self._received > self.timeout
        return f"ended: silence for {self.timeout:g} s" if is_silent else ""
