"""UDP: to one address, or to whoever spoke to ours.

The frames of a turn of the thread go in one datagram, as autopilots do it: each system call costs the stepper a
moment, for it hands over the interpreter.
"""

from __future__ import annotations

import socket
import time
from collections import Counter
from collections.abc import Callable, Hashable

from cosim.errors import TelemetryError
from cosim.mavlink.channels.channel import DATAGRAM

PEERS = 8
SILENCE = 10.0  # s, after which a peer is forgotten
_BUFFER = 1 << 18  # bytes the kernel keeps of what comes; what floods beyond it is lost there, at no cost

_NOT_TAKEN = "datagrams not taken by the kernel"
_PACKET = 1000  # bytes of frames in a datagram: small receivers read no more of one


class UdpOut:
    """One fixed peer; the kernel passes nothing on that another one sends.

    Raises
    ------
    TelemetryError
        If there is no way to it.
    """

    datagrams = True

    def __init__(self, host: str, port: int) -> None:
        self.trouble: dict[str, int] = Counter()
        self._packet = b""  # frames that go together
        self._version = 0  # the greatest that the peer has spoken; 0 for none yet
        self._socket = _socket(f"udpout:{host}:{port}", lambda s: s.connect((host, port)))

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a datagram, if one is there."""
        try:
            return 0, self._socket.recv(DATAGRAM)
        except OSError:  # nothing is there, or word that nobody listened to what was sent
            return None

    def heard(self, peer: Hashable, version: int) -> None:
        """Note which version the peer speaks."""
        self._version = max(self._version, version)

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Take a frame for the next datagram; that nobody listens is no trouble."""
        frame = (old or b"") if self._version == 1 else frame
        if len(self._packet) + len(frame) > _PACKET:
            self._flush()
        self._packet += frame
        return True

    def tend(self, now: float) -> None:
        """Send what was taken."""
        self._flush()

    def close(self) -> None:
        """Send what was taken, and close the socket."""
        self._flush()
        self._socket.close()

    def _flush(self) -> None:
        packet, self._packet = self._packet, b""
        for _ in range(2 if packet else 0):
            try:
                self._socket.send(packet)
                return
            except ConnectionRefusedError:  # word of an earlier one, in whose place this one was not sent: once more
                continue
            except OSError:
                self.trouble[_NOT_TAKEN] += 1
                return


class UdpIn:
    """Whoever sent a heeded frame within the last 10 s is a peer, up to 8 of them.

    Attributes
    ----------
    port : int
        On which it listens.

    Raises
    ------
    TelemetryError
        If the port is taken.
    """

    datagrams = True

    def __init__(self, host: str, port: int) -> None:
        self.trouble: dict[str, int] = Counter()
        self._socket = _socket(f"udpin:{host}:{port}", lambda s: s.bind((host, port)))
        self.port: int = self._socket.getsockname()[1]
        self._packets = {1: b"", 2: b""}  # by version
        self._heard: dict[tuple[str, int], float] = {}  # when, by address
        self._version: dict[tuple[str, int], int] = {}  # the greatest that each has spoken

    @property
    def peers(self) -> list[tuple[str, int]]:
        """Addresses that are sent to."""
        return list(self._heard)

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a datagram and its sender, if one is there."""
        try:
            data, address = self._socket.recvfrom(DATAGRAM)
        except OSError:
            return None
        return address, data

    def heard(self, peer: Hashable, version: int) -> None:
        """Send to this address from now on, where there is room."""
        assert isinstance(peer, tuple)
        if peer in self._heard or len(self._heard) < PEERS:
            self._heard[peer] = time.monotonic()
            self._version[peer] = max(self._version.get(peer, 1), version)
        else:
            self.trouble["frames of peers beyond 8"] += 1

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Take a frame for the next datagram to each peer; to none of them is well too."""
        if len(self._packets[2]) + len(frame) > _PACKET:
            self._flush()
        self._packets[2] += frame
        self._packets[1] += old or b""  # never the longer one by much: it has fewer messages, and zeros at their ends
        return True

    def tend(self, now: float) -> None:
        """Send what was taken, and forget who is silent."""
        self._flush()
        for peer in [peer for peer, last in self._heard.items() if now - last > SILENCE]:
            del self._heard[peer], self._version[peer]

    def close(self) -> None:
        """Send what was taken, and close the socket."""
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
    """Return a socket that never waits."""
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
