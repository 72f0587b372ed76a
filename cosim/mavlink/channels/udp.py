"""UDP: to one address, or to each peer that sends to a local port.

The frames of a turn of the thread share a datagram, as those of autopilots do: each system call delays the stepper,
since it releases the interpreter lock.
"""

from __future__ import annotations

import math
import socket
import time
from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import dataclass

from cosim.errors import TelemetryError
from cosim.mavlink.channels.channel import DATAGRAM

PEERS = 8
SILENCE = 10.0  # s without a frame, after which a peer is sent no more
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


@dataclass
class _Peer:
    """When accepted frames of an address were received, and their greatest version."""

    first: float  # s, monotonic
    last: float
    version: int


class UdpIn:
    """A server. Each address that sent an accepted frame within the last 10 s is a peer, up to 8 of them.

    A silent peer keeps its place until a new address needs it; the one that was heard for longest keeps it always. So
    frames from many addresses cannot displace a ground station.

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
        self._known: dict[tuple[str, int], _Peer] = {}
        self._now = -math.inf  # s, monotonic, time of the last `tend`

    @property
    def peers(self) -> list[tuple[str, int]]:
        """Addresses of the peers that are not silent, to which frames are sent."""
        return [address for address, peer in self._known.items() if self._now - peer.last <= SILENCE]

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a datagram and its sender, or None if there is none."""
        try:
            data, address = self._socket.recvfrom(DATAGRAM)
        except OSError:
            return None
        return address, data

    def record_version(self, peer: Hashable, version: int) -> None:
        """Add this address to the peers, or renew it; count the frame if there is no place."""
        assert isinstance(peer, tuple)
        now, known = time.monotonic(), self._known.get(peer)
        if known is not None:
            known.last, known.version = now, max(known.version, version)
        elif len(self._known) < PEERS or self._forget(now):
            self._known[peer] = _Peer(now, now, version)
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
        """Send the queued datagrams."""
        self._now = now
        self._flush()

    def close(self) -> None:
        """Send the queued datagrams, and close the socket."""
        self._flush()
        self._socket.close()

    def _forget(self, now: float) -> bool:
        """Remove the silent peer that was heard for the shortest time, but not the one heard for longest."""
        heard = {address: peer.last - peer.first for address, peer in self._known.items()}
        kept = max(heard, key=heard.__getitem__)
        silent = [address for address, peer in self._known.items() if now - peer.last > SILENCE and address != kept]
        if not silent:
            return False
        del self._known[min(silent, key=heard.__getitem__)]
        return True

    def _flush(self) -> None:
        packets, self._packets = self._packets, {1: b"", 2: b""}
        for address in self.peers:
            try:
                if packet := packets[self._known[address].version]:
                    self._socket.sendto(packet, address)
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
