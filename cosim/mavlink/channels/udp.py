"""UDP: to one address, or to each peer that sends to a local port.

The frames of a turn of the thread share a datagram, as those of autopilots do: each system call delays the stepper,
since it releases the interpreter lock.
"""

from __future__ import annotations

import socket
import time
from collections import Counter
from collections.abc import Callable, Hashable

from cosim.errors import TelemetryError
from cosim.mavlink.channels.channel import DATAGRAM

PEERS = 8
SILENCE = 10.0  # s without a frame, after which a peer is removed
_BUFFER = 1 << 18  # bytes of the kernel's receive buffer; what exceeds it is lost in the kernel

_NOT_TAKEN = "datagrams not taken by the kernel"
_PACKET = 1000  # bytes of frames in a datagram: the limit of small receivers


class UdpOut:
    """One fixed peer; the kernel drops datagrams of others.

    Raises
    ------
    TelemetryError
        If there is no route to the peer.
    """

    datagrams = True

    def __init__(self, host: str, port: int) -> None:
        self.trouble: dict[str, int] = Counter()
        self._packet = b""  # frames of the next datagram
        self._version = 0  # the greatest received; 0 for none yet
        self._socket = _socket(f"udpout:{host}:{port}", lambda s: s.connect((host, port)))

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a datagram, or None if there is none."""
        try:
            return 0, self._socket.recv(DATAGRAM)
        except OSError:  # nothing was received, or an earlier datagram was refused
            return None

    def record_version(self, peer: Hashable, version: int) -> None:
        """Record the MAVLink version of the peer."""
        self._version = max(self._version, version)

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Queue a frame for the next datagram; a missing listener is no failure."""
        frame = (old or b"") if self._version == 1 else frame
        if len(self._packet) + len(frame) > _PACKET:
            self._flush()
        self._packet += frame
        return True

    def tend(self, now: float) -> None:
        """Send the queued datagram."""
        self._flush()

    def close(self) -> None:
        """Send the queued datagram, and close the socket."""
        self._flush()
        self._socket.close()

    def _flush(self) -> None:
        packet, self._packet = self._packet, b""
        for _ in range(2 if packet else 0):
            try:
                self._socket.send(packet)
                return
            except ConnectionRefusedError:  # the error of an earlier datagram, and this one was not sent: send it again
                continue
            except OSError:
                self.trouble[_NOT_TAKEN] += 1
                return


class UdpIn:
    """A server. Each address that sent an accepted frame within the last 10 s is a peer, up to 8 of them.

    Attributes
    ----------
    port : int
        Port on which it listens.

    Raises
    ------
    TelemetryError
        If the port is in use.
    """

    datagrams = True

    def __init__(self, host: str, port: int) -> None:
        self.trouble: dict[str, int] = Counter()
        self._socket = _socket(f"udpin:{host}:{port}", lambda s: s.bind((host, port)))
        self.port: int = self._socket.getsockname()[1]
        self._packets = {1: b"", 2: b""}  # by version
        self._heard: dict[tuple[str, int], float] = {}  # time of the last accepted frame, by address
        self._version: dict[tuple[str, int], int] = {}  # the greatest received from each

    @property
    def peers(self) -> list[tuple[str, int]]:
        """Addresses of the peers."""
        return list(self._heard)

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a datagram and its sender, or None if there is none."""
        try:
            data, address = self._socket.recvfrom(DATAGRAM)
        except OSError:
            return None
        return address, data

    def record_version(self, peer: Hashable, version: int) -> None:
        """Add this address to the peers, or renew it; count the frame if there are 8 already."""
        assert isinstance(peer, tuple)
        if peer in self._heard or len(self._heard) < PEERS:
            self._heard[peer] = time.monotonic()
            self._version[peer] = max(self._version.get(peer, 1), version)
        else:
            self.trouble["frames of peers beyond 8"] += 1

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Queue a frame for the next datagram to each peer; having no peers is no failure."""
        if len(self._packets[2]) + len(frame) > _PACKET:
            self._flush()
        self._packets[2] += frame
        self._packets[1] += old or b""  # about the same length: fewer messages, whose trailing zeros are not cut
        return True

    def tend(self, now: float) -> None:
        """Send the queued datagrams, and remove silent peers."""
        self._flush()
        for peer in [peer for peer, last in self._heard.items() if now - last > SILENCE]:
            del self._heard[peer], self._version[peer]

    def close(self) -> None:
        """Send the queued datagrams, and close the socket."""
        self._flush()
        self._socket.close()

    def _flush(self) -> None:
        packets, self._packets = self._packets, {1: b"", 2: b""}
        for peer in self._heard:
            try:
                if packet := packets[self._version[peer]]:
                    self._socket.sendto(packet, peer)
            except OSError:
                self.trouble[_NOT_TAKEN] += 1


def _socket(name: str, prepare: Callable[[socket.socket], None]) -> socket.socket:
    """Return a prepared, non-blocking UDP socket."""
    try:
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    except OSError as error:
        raise TelemetryError(f"{name}: no UDP socket: {error.strerror or error}") from error
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
        made.setblocking(False)
        prepare(made)
    except OSError as error:
        made.close()
        raise TelemetryError(f"{name}: {error.strerror or error}") from error
    return made
