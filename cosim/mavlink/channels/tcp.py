"""TCP: a server with several clients, or one client that reconnects."""

from __future__ import annotations

import contextlib
import errno
import logging
import socket
import time
from collections import Counter
from collections.abc import Hashable

from cosim.errors import TelemetryError
from cosim.mavlink.channels.stream import WAITING, OneStream, Stream

log = logging.getLogger(__name__)

CLIENTS = 8
_CONNECTING = 3.0  # s, timeout of the first connection
_AGAIN = 2.0  # s, between two attempts later on
_UNDER_WAY = (errno.EINPROGRESS, errno.EALREADY, errno.EWOULDBLOCK)


def stream_of(made: socket.socket) -> Stream:
    """Return a stream that owns the connection."""
    made.setblocking(False)
    with contextlib.suppress(OSError):  # a client may have gone already
        made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return Stream(made.recv, made.send, made.close)


class TcpIn:
    """A server. Each client has its own queue of frames; a client that accepts none for 5 s is closed.

    Attributes
    ----------
    port : int
        Port on which it listens.

    Raises
    ------
    TelemetryError
        If the port is in use.
    """

    datagrams = False

    def __init__(self, host: str, port: int) -> None:
        self.trouble: dict[str, int] = Counter()
        try:
            self._server = socket.create_server((host, port), backlog=CLIENTS)
        except OSError as error:
            raise TelemetryError(f"tcpin:{host}:{port}: {error.strerror or error}") from error
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, WAITING)  # inherited by the clients' sockets
        self._server.setblocking(False)
        self.port: int = self._server.getsockname()[1]
        self.clients: list[Stream] = []
        self._next = 0  # index of the client to read: round robin

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return the next client with received bytes, and these; None if there are none."""
        for _ in range(len(self.clients)):
            self._next = (self._next + 1) % len(self.clients)
            client = self.clients[self._next]
            data = client.read()
            if data is not None:
                return client, data
        return None

    def record_version(self, peer: Hashable, version: int) -> None:
        """Record the MAVLink version of a client; all clients are sent to, even if they never send."""
        assert isinstance(peer, Stream)
        peer.version = max(peer.version, version)

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Queue a frame for each client; return False if a queue was full."""
        taken = [client.put(frame, old) for client in self.clients]
        return all(taken)

    def tend(self, now: float) -> None:
        """Write queued frames, close stalled clients, accept new ones."""
        for client in list(self.clients):
            if not client.open:
                self._drop(client)
            elif not client.flush(now):
                self.trouble["clients closed that took nothing"] += 1
                self._drop(client)
        for _ in range(CLIENTS):
            try:
                made, _ = self._server.accept()
            except OSError:  # no client waits, or it has closed again
                return
            if len(self.clients) < CLIENTS:
                self.clients.append(stream_of(made))
            else:
                self.trouble["clients beyond 8 turned away"] += 1
                made.close()

    def close(self) -> None:
        """Close all sockets."""
        for client in list(self.clients):
            client.flush(0.0)
            self._drop(client)
        self._server.close()

    def _drop(self, client: Stream) -> None:
        if client.outgoing.dropped:
            self.trouble["frames dropped for slow clients"] += client.outgoing.dropped
        client.close()
        self.clients.remove(client)


class TcpOut(OneStream):
    """A client; while there is no server, at first or later, it tries to connect every 2 s."""

    def __init__(self, host: str, port: int) -> None:
        self._address = (host, port)
        self._attempt: socket.socket | None = None
        self._last = time.monotonic()
        stream = None
        with contextlib.suppress(OSError):
            stream = stream_of(socket.create_connection((host, port), _CONNECTING))
        if stream is None:
            log.warning("MAVLink: tcp:%s:%s: no server yet; waiting", host, port)
        super().__init__(stream, gone="server", slow="for a slow server")

    def tend(self, now: float) -> None:
        """Write queued frames, or reconnect."""
        connection = self._stream
        if connection is None:
            self._connect(now)
        elif not (connection.flush(now) and connection.open):
            self._lose(connection)

    def close(self) -> None:
        """Close the connection, and the attempt under way."""
        super().close()
        if self._attempt is not None:
            self._attempt.close()

    def _connect(self, now: float) -> None:
        """Start a connection attempt, or check the one under way."""
        if self._attempt is None:
            if now - self._last < _AGAIN:
                return
            self._last = now
            self._attempt = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            self._attempt.setblocking(False)
        attempt, code = self._attempt, self._attempt.connect_ex(self._address)
        if code in _UNDER_WAY:
            return
        self._attempt = None
        # a socket can connect to itself on a local port without a listener
        if code in (0, errno.EISCONN) and attempt.getsockname() != self._address:
            self._stream = stream_of(attempt)
        else:
            attempt.close()
