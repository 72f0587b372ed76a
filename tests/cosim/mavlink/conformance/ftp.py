"""Download a file by MAV-FTP as QGroundControl does: open, burst read, fill the gaps, end the session."""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

from tests.cosim.mavlink.conformance.client import Client

_HEADER = struct.Struct("<HBBBBBxI")  # sequence, session, opcode, size, requested opcode, burst complete, offset
_DATA = 239  # bytes of data in a packet
_PAYLOAD = 251
_END, _RESET, _OPEN, _READ, _BURST, _ACK, _NAK = 1, 2, 4, 5, 15, 128, 129
_END_OF_FILE = 6
_TIMEOUT, _TRIES = 1.0, 3  # QGroundControl's
_GREATEST = 1 << 22  # bytes of a file
ERRORS = {1: "Fail", 2: "FailErrno", 4: "InvalidSession", 7: "UnknownCommand", 10: "FileNotFound"}


class Packet(NamedTuple):
    """A reply of the file server."""

    sequence: int
    session: int
    opcode: int
    requested: int
    complete: bool
    offset: int
    data: bytes

    @property
    def refused(self) -> bool:
        """True if it is a NAK."""
        return self.opcode == _NAK

    @property
    def error(self) -> int:
        """MAV-FTP error code of a NAK."""
        return self.data[0] if self.data else 0


class Download(NamedTuple):
    """The result of a download."""

    data: bytes | None  # None without a file
    said: str  # description of the error; empty with data
    retries: int


class _Session:
    """An MAV-FTP session with its sequence number and retries."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.sequence = self.number = self.retries = 0

    def ask(self, opcode: int, offset: int = 0, data: bytes = b"", size: int | None = None) -> Packet | None:
        """Send a request, with retries, and return its reply; None without one."""
        for attempt in range(_TRIES + 1):
            self.retries += attempt > 0
            self.client.discard_unread()
            length = len(data) if size is None else size
            head = _HEADER.pack(self.sequence, self.number, opcode, length, 0, 0, offset)
            payload = (head + data).ljust(_PAYLOAD, b"\0")
            self.client.send(
                self.client.mavlink.MAVLink_file_transfer_protocol_message(0, *self.client.target, list(payload))
            )
            reply = self.next(opcode)
            if reply is not None:
                self.sequence = (reply.sequence + 1) & 0xFFFF
                return reply
        return None

    def next(self, opcode: int) -> Packet | None:
        """Return the next packet that answers an opcode, or None after the timeout."""
        message = self.client.wait(
            lambda m: m.get_type() == "FILE_TRANSFER_PROTOCOL" and _packet(m).requested == opcode, _TIMEOUT
        )
        return None if message is None else _packet(message)


def _packet(message: Any) -> Packet:
    raw = bytes(message.payload)
    sequence, session, opcode, size, requested, complete, offset = _HEADER.unpack_from(raw)
    data = raw[_HEADER.size : _HEADER.size + min(size, _DATA)]
    return Packet(sequence, session, opcode, requested, bool(complete), offset, data)


def download(client: Client, path: str) -> Download:
    """Download a file."""
    session = _Session(client)
    opened = session.ask(_OPEN, data=path.encode())
    if opened is None:
        return Download(None, "no answer", session.retries)
    if opened.refused:
        return Download(None, ERRORS.get(opened.error, f"error {opened.error}"), session.retries)
    session.number = opened.session
    size = int.from_bytes(opened.data[:4], "little")
    if size > _GREATEST:
        return Download(None, f"a file of {size} bytes", session.retries)
    pieces = _burst(session, size)
    size = _fill(session, size, pieces)
    session.ask(_END)
    data = b"".join(pieces[offset] for offset in sorted(pieces))
    if len(data) != size:
        return Download(None, f"{len(data)} of {size} bytes", session.retries)
    return Download(data, "", session.retries)


def _burst(session: _Session, size: int) -> dict[int, bytes]:
    pieces: dict[int, bytes] = {}
    reached = 0
    packet = session.ask(_BURST, 0, size=_DATA)
    while packet is not None and not packet.refused:
        pieces[packet.offset] = packet.data
        reached = max(reached, packet.offset + len(packet.data))
        if reached >= size:
            break
        packet = session.ask(_BURST, reached, size=_DATA) if packet.complete else session.next(_BURST)
    return pieces


def _fill(session: _Session, size: int, pieces: dict[int, bytes]) -> int:
    """Read the parts that the bursts lack; return the size of the file, which ArduPilot only estimates beforehand."""
    at = 0
    while at < size:
        if at not in pieces:
            following = min((offset for offset in pieces if offset > at), default=size)
            packet = session.ask(_READ, at, size=min(_DATA, following - at))
            if packet is None or packet.refused or not packet.data:
                ended = packet is not None and packet.refused and packet.error == _END_OF_FILE and following == size
                return at if ended else size
            pieces[at] = packet.data
        at += len(pieces[at])
    return size
