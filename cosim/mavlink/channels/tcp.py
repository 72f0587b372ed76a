"""TCP: a server with several clients, or one client that reconnects."""

from __future__ import annotations

import contextlib
import errno
import logging
import math
import socket
from collections.abc import Hashable

from cosim.errors import TelemetryError
from cosim.mavlink.channels.stream import QUEUE_SIZE, SinglePeer, Stream, StreamChannel

log = logging.getLogger(__name__)

MAX_CLIENTS = 8
_CONNECT_TIMEOUT = 3.0  # s, of the first connection
_RETRY_PERIOD = 0.2  # s, between two later attempts
_IN_PROGRESS = (errno.EINPROGRESS, errno.EALREADY, errno.EWOULDBLOCK)


def make_stream(connection: socket.socket) -> Stream:
    """Return a stream that owns the connection."""
    connection.setblocking(False)
    with contextlib.suppress(OSError):  # a client may have gone already
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return Stream(connection.recv, connection.send, connection.close)


class TcpIn(StreamChannel):
    """A server. Each client has its own queue of frames; a client that accepts none for 5 s is closed."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__()
        try:
            self._server = socket.create_server((host, port), backlog=MAX_CLIENTS)
        except OSError as error:
            raise TelemetryError(f"tcpin:{host}:{port}: {error.strerror or error}") from error
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, QUEUE_SIZE)  # inherited by the clients' sockets
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

    def send(self, frame: bytes, frame_v1: bytes | None = None) -> bool:
        """Queue a frame for each client; return False if a queue was full."""
        results = [client.put(frame, frame_v1) for client in self.clients]
        return all(results)

    def poll(self, now: float) -> None:
        """Write queued frames, close stalled clients, accept new ones."""
        for client in list(self.clients):
            if not client.is_open:
                self._drop(client)
            elif not client.flush(now):
                self.losses["clients closed that took nothing"] += 1
                self._drop(client)
        for _ in range(MAX_CLIENTS):
            try:
                connection, _ = self._server.accept()
            except OSError:  # no client waits, or it has closed again
                return
            if len(self.clients) < MAX_CLIENTS:
                self.clients.append(make_stream(connection))
            else:
                self.losses["clients beyond 8 turned away"] += 1
                connection.close()

    def close(self) -> None:
        """Close all sockets."""
        for client in list(self.clients):
            client.flush(0.0)
            self._drop(client)
        self._server.close()

    def _drop(self, client: Stream) -> None:
        self._close(client, "for slow clients")
        self.clients.remove(client)


class TcpOut(SinglePeer):
    """A client; while there is no server, at first or later, it tries to connect five times a second."""

    def __init__(self, host: str, port: int) -> None:
        self._address = (host, port)
        self._attempt: socket.socket | None = None
        self._attempted_at = -math.inf
        stream = None
        with contextlib.suppress(OSError):
            stream = make_stream(socket.create_connection((host, port), _CONNECT_TIMEOUT))
        if stream is None:
            log.warning("MAVLink: tcp:%s:%s: no server yet; waiting", host, port)
        super().__init__(stream, peer="server", slow="for a slow server")

    def poll(self, now: float) -> None:
        """Write queued frames, or reconnect."""
        connection = self._stream
        if connection is None:
            self._connect(now)
        elif not (connection.flush(now) and connection.is_open):
            self._drop(connection)

    def close(self) -> None:
        """Close the connection, and the attempt under way."""
        super().close()
        if self._attempt is not None:
            self._attempt.close()

    def _connect(self, now: float) -> None:
        """Start a connection attempt, or check the one under way."""
        if self._attempt is None:
            if now - self._attempted_at < _RETRY_PERIOD:
                return
            self._attempted_at = now
            self._attempt = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            self._attempt.setblocking(False)
        attempt, code = self._attempt, self._attempt.connect_ex(self._address)
        if code in _IN_PROGRESS:
            return
        self._attempt = None
        # a socket can connect to itself on a local port without a listener
        if code in (0, errno.EISCONN) and attempt.getsockname() != self._address:
            self._stream = make_stream(attempt)
        else:
            attempt.close()
