"""UDP: to one address, or to each peer that sends to a local port."""

# The frames of one call of `poll` share a datagram, as those of autopilots do: each system call delays the stepper,
# since it releases the interpreter lock.

from __future__ import annotations

import math
import socket
import time
from collections import Counter
from collections.abc import Callable, Hashable
from dataclasses import dataclass

from cosim.errors import TelemetryError
from cosim.mavlink.channels.channel import DATAGRAM_SIZE

MAX_PEERS = 8
PEER_TIMEOUT = 10.0  # s without a frame, after which nothing is sent to a peer
_RECEIVE_BUFFER = 1 << 18  # bytes of the kernel's receive buffer; what exceeds it is lost in the kernel

_SEND_ERRORS = "datagrams not taken by the kernel"
_MAX_PACKET = 1000  # bytes of frames in a datagram: the limit of small receivers


class _Udp:
    """A socket whose queued frames are sent together."""

    datagrams = True

    def __init__(self, name: str, prepare: Callable[[socket.socket], None]) -> None:
        self.losses: dict[str, int] = Counter()
        self._packets = {1: b"", 2: b""}  # frames of the next datagram, by version
        self._socket = _open_socket(name, prepare)

    def send(self, frame: bytes, frame_v1: bytes | None = None) -> bool:
        """Queue a frame for the next datagram to each peer; having no listener is no failure."""
        frames = {1: frame_v1 or b"", 2: frame}
        if any(len(self._packets[version]) + len(frames[version]) > _MAX_PACKET for version in frames):
            self._send_packets()
        self._packets = {version: self._packets[version] + frames[version] for version in frames}
        return True

    def poll(self, now: float) -> None:
        """Send the queued datagrams."""
        self._send_packets()

    def close(self) -> None:
        """Send the queued datagrams, and close the socket."""
        self._send_packets()
        self._socket.close()

    def _send_packets(self) -> None:
        packets, self._packets = self._packets, {1: b"", 2: b""}
        self._write(packets)

    def _write(self, packets: dict[int, bytes]) -> None:
        raise NotImplementedError


class UdpOut(_Udp):
    """One fixed peer; the kernel drops datagrams of others."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"udpout:{host}:{port}", lambda s: s.connect((host, port)))
        self._version = 0  # the highest received; 0 for none yet

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a datagram, or None if there is none."""
        try:
            return 0, self._socket.recv(DATAGRAM_SIZE)
        except OSError:  # nothing was received, or an earlier datagram was refused
            return None

    def record_version(self, peer: Hashable, version: int) -> None:
        """Record the MAVLink version of the peer."""
        self._version = max(self._version, version)

    def _write(self, packets: dict[int, bytes]) -> None:
        packet = packets[1 if self._version == 1 else 2]
        for _ in range(2 if packet else 0):
            try:
                self._socket.send(packet)
                return
            except ConnectionRefusedError:  # the error of an earlier datagram, and this one was not sent: send it again
                continue
            except OSError:
                self.losses[_SEND_ERRORS] += 1
                return


@dataclass
class _Peer:
    """When accepted frames of an address were received, and their highest version."""

    first: float  # s, monotonic
    last: float
    version: int


class UdpIn(_Udp):
    """A server. Each address that sent an accepted frame within the last 10 s is a peer, up to 8 of them."""

    # A silent peer is kept until a new address replaces it; the one active for longest is always kept. So frames from
    # many addresses cannot displace a ground station.

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"udpin:{host}:{port}", lambda s: s.bind((host, port)))
        self.port: int = self._socket.getsockname()[1]
        self._peers: dict[tuple[str, int], _Peer] = {}
        self._now = -math.inf  # s, monotonic, time of the last `poll`

    @property
    def peers(self) -> list[tuple[str, int]]:
        """Addresses of the peers that are not silent, to which frames are sent."""
        return [address for address, peer in self._peers.items() if self._now - peer.last <= PEER_TIMEOUT]

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a datagram and its sender, or None if there is none."""
        try:
            data, address = self._socket.recvfrom(DATAGRAM_SIZE)
        except OSError:
            return None
        return address, data

    def record_version(self, peer: Hashable, version: int) -> None:
        """Add this address to the peers, or renew it; count the frame if there is no room."""
        assert isinstance(peer, tuple)
        now, entry = time.monotonic(), self._peers.get(peer)
        if entry is not None:
            entry.last, entry.version = now, max(entry.version, version)
        elif len(self._peers) < MAX_PEERS or self._drop_silent_peer(now):
            self._peers[peer] = _Peer(now, now, version)
        else:
            self.losses["frames of peers beyond 8"] += 1

    def poll(self, now: float) -> None:
        """Send the queued datagrams to the peers that are not silent now [s]."""
        self._now = now
        super().poll(now)

    def _drop_silent_peer(self, now: float) -> bool:
        """Remove the silent peer that was active for the shortest time, but never the one active for longest."""
        ages = {address: peer.last - peer.first for address, peer in self._peers.items()}
        oldest = max(ages, key=ages.__getitem__)
        peers = self._peers.items()
        silent = [address for address, peer in peers if now - peer.last > PEER_TIMEOUT and address != oldest]
        if not silent:
            return False
        del self._peers[min(silent, key=ages.__getitem__)]
        return True

    def _write(self, packets: dict[int, bytes]) -> None:
        for address in self.peers:
            try:
                if packet := packets[self._peers[address].version]:
                    self._socket.sendto(packet, address)
            except OSError:
                self.losses[_SEND_ERRORS] += 1


def _open_socket(name: str, prepare: Callable[[socket.socket], None]) -> socket.socket:
    """Return a prepared, non-blocking UDP socket."""
    try:
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    except OSError as error:
        raise TelemetryError(f"{name}: no UDP socket: {error.strerror or error}") from error
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        opened.setblocking(False)
        prepare(opened)
    except OSError as error:
        opened.close()
        raise TelemetryError(f"{name}: {error.strerror or error}") from error
    return opened
