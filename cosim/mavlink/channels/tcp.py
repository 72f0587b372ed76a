"""TCP: a server with several clients, or one client that reconnects."""

from __future__ import annotations

import contextlib
import errno
import socket
import time
from collections import Counter
from collections.abc import Hashable

from cosim.errors import TelemetryError
from cosim.mavlink.channels.channel import CHUNK
from cosim.mavlink.channels.stream import WAITING, Outgoing

CLIENTS = 8
_CONNECTING = 3.0  # s, that opening waits for the other side
_AGAIN = 2.0  # s, between two attempts later on
_UNDER_WAY = (errno.EINPROGRESS, errno.EALREADY, errno.EWOULDBLOCK)


class Connection:
    """One TCP connection, with the frames that wait for it."""

    def __init__(self, made: socket.socket) -> None:
        made.setblocking(False)
        with contextlib.suppress(OSError):  # a client may have gone already
            made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = made
        self.outgoing = Outgoing(made.send)
        self.open = True

    def read(self) -> bytes | None:
        """Return what has come, None if nothing has; `open` tells whether more can come."""
        try:
            data = self._socket.recv(CHUNK)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError:
            data = b""
        self.open = bool(data)
        return data or None

    def put(self, frame: bytes) -> bool:
        """Take a frame for the other side; return whether there was room."""
        try:
            return self.outgoing.put(frame)
        except OSError:
            self.open = False
            return False

    def flush(self, now: float) -> bool:
        """Write what waits; return whether the other side takes something now and then."""
        try:
            return self.outgoing.flush(now)
        except OSError:
            self.open = False
            return True

    def close(self) -> None:
        """Close the socket."""
        self.open = False
        self._socket.close()


class TcpIn:
    """A server. Each client has frames of its own waiting; one that takes none for 5 s is closed.

    Attributes
    ----------
    port : int
        On which it listens.

    Raises
    ------
    TelemetryError
        If the port is taken.
    """

    datagrams = False

    def __init__(self, host: str, port: int) -> None:
        self.trouble: dict[str, int] = Counter()
        try:
            self._server = socket.create_server((host, port), backlog=CLIENTS)
        except OSError as error:
            raise TelemetryError(f"tcpin:{host}:{port}: {error.strerror or error}") from error
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, WAITING)  # its clients have it from it
        self._server.setblocking(False)
        self.port: int = self._server.getsockname()[1]
        self.clients: list[Connection] = []
        self._next = 0  # of the clients, to be read: they take turns

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return bytes of the next client that has some."""
        for _ in range(len(self.clients)):
            self._next = (self._next + 1) % len(self.clients)
            client = self.clients[self._next]
            data = client.read()
            if data is not None:
                return client, data
        return None

    def heard(self, peer: Hashable) -> None:
        """Send to each client, whatever it says."""

    def send(self, frame: bytes) -> bool:
        """Send to each client."""
        taken = [client.put(frame) for client in self.clients]
        return all(taken)

    def tend(self, now: float) -> None:
        """Write what waits, close clients that take none, accept new ones."""
        for client in list(self.clients):
            if not client.open:
                self._drop(client)
            elif not client.flush(now):
                self.trouble["clients closed that took nothing"] += 1
                self._drop(client)
        for _ in range(CLIENTS):
            try:
                made, _ = self._server.accept()
            except OSError:  # nobody is there, or gone again
                return
            if len(self.clients) < CLIENTS:
                self.clients.append(Connection(made))
            else:
                self.trouble["clients beyond 8 turned away"] += 1
                made.close()

    def close(self) -> None:
        """Close all sockets."""
        for client in list(self.clients):
            client.flush(0.0)
            self._drop(client)
        self._server.close()

    def _drop(self, client: Connection) -> None:
        if client.outgoing.dropped:
            self.trouble["frames dropped for slow clients"] += client.outgoing.dropped
        client.close()
        self.clients.remove(client)


class TcpOut:
    """A client; when the connection is lost, it tries again every 2 s.

    Raises
    ------
    TelemetryError
        If nobody answers at first.
    """

    datagrams = False

    def __init__(self, host: str, port: int) -> None:
        self.trouble: dict[str, int] = Counter()
        self._address = (host, port)
        self._attempt: socket.socket | None = None
        self._last = time.monotonic()
        try:
            self._connection: Connection | None = Connection(socket.create_connection((host, port), _CONNECTING))
        except OSError as error:
            raise TelemetryError(f"tcp:{host}:{port}: {error.strerror or error}") from error

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return bytes of the other side."""
        connection = self._connection
        data = None if connection is None else connection.read()
        return None if data is None else (connection, data)

    def heard(self, peer: Hashable) -> None:
        """Know the peer already."""

    def send(self, frame: bytes) -> bool:
        """Send to the other side, if it is there."""
        if self._connection is None:
            self.trouble["frames dropped while there was no server"] += 1
            return False
        return self._connection.put(frame)

    def tend(self, now: float) -> None:
        """Write what waits, or connect anew."""
        connection = self._connection
        if connection is None:
            self._connect(now)
        elif not (connection.flush(now) and connection.open):
            self._lose(connection)

    def close(self) -> None:
        """Close the socket."""
        if self._connection is not None:
            self._connection.flush(0.0)
            self._lose(self._connection)
        if self._attempt is not None:
            self._attempt.close()

    def _lose(self, connection: Connection) -> None:
        if connection.outgoing.dropped:
            self.trouble["frames dropped for a slow server"] += connection.outgoing.dropped
        connection.close()
        self._connection = None

    def _connect(self, now: float) -> None:
        """Begin an attempt, or see what became of it."""
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
        # to a port of this machine where nobody listens, a socket can connect to itself
        if code in (0, errno.EISCONN) and attempt.getsockname() != self._address:
            self._connection = Connection(attempt)
        else:
            attempt.close()
