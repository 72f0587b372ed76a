"""A link on one endpoint: frames with their own sequence numbers, signed with a key, within a budget."""

from __future__ import annotations

import logging
import struct
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final, NamedTuple
from weakref import WeakKeyDictionary

from cosim.mavlink.channels.channel import Channel
from cosim.mavlink.channels.serial import Serial
from cosim.mavlink.channels.tcp import TcpIn, TcpOut
from cosim.mavlink.channels.tlog_file import Tlog
from cosim.mavlink.channels.udp import UdpIn, UdpOut
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.framing import V1, FrameFilter, RxStats, StreamReader, encode_v1
from cosim.mavlink.wire.options import COMPONENT_ID, MavlinkOptions
from cosim.mavlink.wire.signing import SigningClock, Verifier, timestamp_file

log = logging.getLogger(__name__)

BUDGET = 200_000.0  # bytes/s, of the wall clock, into a network
_BURST = 0.5  # s of the budget, that can be sent at once
_RESERVED = 0.25  # fraction of the burst that is reserved for answers
_ENCODING_ERRORS = (struct.error, OverflowError, IndexError, TypeError, ValueError)  # a field cannot hold its value

_NETWORKS: dict[str, Callable[[str, int], Channel]] = {"udpout": UdpOut, "udpin": UdpIn, "tcpin": TcpIn, "tcp": TcpOut}


class SendRule(NamedTuple):
    """How messages of one name are sent."""

    is_answer: bool = False  # sent only on the link of the request
    has_priority: bool = False  # may use the reserved part of the budget


_SEND_RULES = {
    **dict.fromkeys(("HEARTBEAT", "STATUSTEXT", "MISSION_REQUEST"), SendRule(has_priority=True)),
    **dict.fromkeys(
        ("COMMAND_ACK", "FILE_TRANSFER_PROTOCOL", "MISSION_ACK", "MISSION_COUNT", "MISSION_ITEM_INT",
         "MISSION_REQUEST_INT", "PARAM_ERROR", "PARAM_VALUE", "TIMESYNC"), SendRule(True, True)),
    **dict.fromkeys(
        ("AUTOPILOT_VERSION", "AVAILABLE_MODES", "LOG_DATA", "LOG_ENTRY", "MESSAGE_INTERVAL", "PING"), SendRule(True)),
}  # fmt: skip


class Budget:
    """A token bucket of bytes that may be sent; rate [bytes/s]."""

    def __init__(self, rate: float) -> None:
        self._rate, self._capacity = rate, rate * _BURST
        self._available = self._capacity
        self._last = time.monotonic()

    @property
    def exceeds_reserve(self) -> bool:
        """True if more is left than the part reserved for answers."""
        self._refill()
        return self._available >= _RESERVED * self._capacity

    def _refill(self) -> None:
        now = time.monotonic()
        self._available = min(self._capacity, self._available + (now - self._last) * self._rate)
        self._last = now

    def spend(self, size: int, has_priority: bool) -> bool:
        """Spend `size` bytes if available; return True if so. Without priority the reserved quarter must remain."""
        self._refill()
        if self._available - size < (0.0 if has_priority else _RESERVED * self._capacity):
            return False
        self._available -= size
        return True


class Signer(NamedTuple):
    """Key, timestamps and link id, with which the frames of one link are signed."""

    key: bytes
    clock: SigningClock
    link: int


class Link:
    """An endpoint with its peers."""

    def __init__(
        self,
        name: str,
        channel: Channel,
        frame_filter: FrameFilter,
        source: tuple[int, int],
        budget: float | None = None,
        signer: Signer | None = None,
    ) -> None:
        self.name: str = name
        self.channel: Final = channel
        self.stats: Final = frame_filter.stats
        self.logs: list[Link] = []
        self.sent = self.dropped = self.unencodable = 0
        self._filter, self._signer = frame_filter, signer
        self._budget = None if budget is None else Budget(budget)
        self._seq_v1 = 0
        self._codec = dialect().MAVLink(None, *source)
        if signer is not None:
            signing = self._codec.signing
            signing.secret_key, signing.link_id, signing.sign_outgoing = signer.key, signer.link % 256, True
        self._readers: WeakKeyDictionary[Any, StreamReader] = WeakKeyDictionary()
        self._frames: Iterator[tuple[bytes, Any]] = iter(())  # of the last received bytes
        self._peer: Any = None  # their sender
        self._has_v1_peers = False  # True once a peer has sent MAVLink 1
        self._reported: set[str] = set()  # kinds of messages that could not be encoded

    def has_room(self) -> bool:
        """Return True if messages of low priority may be sent now."""
        return self._budget is None or self._budget.exceeds_reserve

    def send(self, message: Any) -> bool:
        """Encode, sign if there is a signer, and send a message; return False if it was not sent to all peers."""
        name = message.get_type()
        try:
            if self._signer is not None:
                self._codec.signing.timestamp = self._signer.clock.next()
            frame: bytes = message.pack(self._codec)
        except _ENCODING_ERRORS as error:
            self.unencodable += 1
            if name not in self._reported:
                self._reported.add(name)
                log.warning("MAVLink: %s cannot be encoded: %s", name, error)
            return False
        rule = _SEND_RULES.get(name, SendRule())
        if self._budget is not None and not self._budget.spend(len(frame), rule.has_priority):
            self.dropped += 1
            return False
        # frames of MAVLink 1 are unsigned, so with a key such peers are rejected
        frame_v1 = encode_v1(frame, self._seq_v1) if self._has_v1_peers and self._signer is None else None
        self._codec.seq = (self._codec.seq + 1) % 256
        self._seq_v1 = (self._seq_v1 + (frame_v1 is not None)) % 256
        self.sent += 1
        was_sent = self.channel.send(frame, frame_v1)
        if rule.is_answer:
            for tlog in self.logs:
                tlog.send(message)
        return was_sent

    def receive(self, until: float) -> Iterator[tuple[bytes, Any]]:
        """Yield accepted frames with their messages, until none is left or a time of `time.perf_counter`."""
        # The rest follows at the next call.
        while time.perf_counter() < until:
            received = next(self._frames, None)
            if received is not None:
                version = 1 if received[0][0] == V1 else 2
                self._has_v1_peers |= version == 1
                self.channel.record_version(self._peer, version)
                yield received
                continue
            chunk = self.channel.receive()
            if chunk is None:
                return
            self._peer, data = chunk
            self._frames = self._filter.read_datagram(data) if self.channel.datagrams else self._reader().read(data)

    def _reader(self) -> StreamReader:
        """Return the reader of the peer of the last received bytes."""
        reader = self._readers.get(self._peer)
        if reader is None:
            reader = self._readers[self._peer] = StreamReader(self._filter)
        return reader

    def loss_reports(self) -> list[str]:
        """Return a text for each kind of frame lost or rejected, with its count."""
        lost = {"messages over the budget": self.dropped, "messages that could not be encoded": self.unencodable}
        rejected = {f"frames {reason}": n for reason, n in self.stats.rejected().items()}
        return [f"{n} {what}" for what, n in (lost | rejected | self.channel.losses).items() if n]


def open_links(endpoints: Sequence[Endpoint], options: MavlinkOptions) -> list[Link]:
    """Open endpoints as links of one vehicle."""
    source, key = (options.system_id, COMPONENT_ID), options.key
    clock = SigningClock(None if key is None else timestamp_file(key, source))
    verifier = None if key is None else Verifier(key, clock)
    links: list[Link] = []
    try:
        for i, endpoint in enumerate(endpoints):
            frames = FrameFilter(RxStats(), source, options.allowed_systems, verifier)
            channel, budget = open_channel(endpoint)
            signer = None if key is None or endpoint.kind == "tlog" else Signer(key, clock, i)
            links.append(Link(endpoint.text, channel, frames, source, budget, signer))
    except BaseException:
        for link in links:
            link.channel.close()
        raise
    return links


def open_channel(endpoint: Endpoint) -> tuple[Channel, float | None]:
    """Open the channel of an endpoint; return it and its limit [bytes/s], None for no limit."""
    if endpoint.kind == "tlog":
        return Tlog(endpoint.path), None
    if endpoint.kind == "serial":
        return Serial(endpoint.path, endpoint.baud), endpoint.baud / 10  # start and stop bit go along
    return _NETWORKS[endpoint.kind](endpoint.host, endpoint.port), BUDGET
