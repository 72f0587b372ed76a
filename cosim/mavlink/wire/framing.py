"""Decode bytes to frames and messages: cheap checks first; no input raises."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, NamedTuple

from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.signing import Verifier

V1, V2 = 0xFE, 0xFD  # first byte of a frame
_SIGNED = 0x01  # bit of the incompatibility flags
_SIGNATURE = 13  # bytes
_CRC = 2  # bytes
_SETUP_SIGNING = 256
_LAST_OF_V1 = 255  # greatest id of a message in MAVLink 1
_V2_HEADER = struct.Struct("<BBBxxBBHB")  # marker, length, flags, system, component, id in two parts
_V2_WHOLE = struct.Struct("<BBBBBBBHB")  # the same with the compatibility flags and sequence number
_V1_HEADER = struct.Struct("<BBxBBB")  # marker, length, system, component, id
_HEADERS = {b"\xfd": _V2_HEADER.size, b"\xfe": _V1_HEADER.size}
_MARKER = re.compile(rb"[\xfd\xfe]")


class Kind(NamedTuple):
    """Properties of a message for the checks before decoding."""

    crc_extra: int
    size: int  # greatest number of bytes of the payload
    target: int | None  # offset of the target system in the payload
    old_size: int  # bytes of the payload in MAVLink 1, which has no extension fields


class Header(NamedTuple):
    """Sender and message of a frame; offsets are from its first byte."""

    size: int  # bytes of the whole frame
    payload: int  # offset of the payload's start
    end: int  # offset of the payload's end, where the checksum starts
    signed: bool
    system: int
    component: int
    message: int  # id of the message


@dataclass(slots=True)
class Counts:
    """Received frames, by their outcome."""

    accepted: int = 0
    foreign: int = field(default=0, metadata={"words": "for another system"})
    own: int = field(default=0, metadata={"words": "of our own"})
    unknown: int = field(default=0, metadata={"words": "of an unknown kind"})
    malformed: int = field(default=0, metadata={"words": "malformed"})
    checksum: int = field(default=0, metadata={"words": "with a wrong checksum"})
    system: int = field(default=0, metadata={"words": "of a system that is not allowed"})
    unsigned: int = field(default=0, metadata={"words": "unsigned"})
    forged: int = field(default=0, metadata={"words": "forged"})
    replayed: int = field(default=0, metadata={"words": "replayed"})
    old: int = field(default=0, metadata={"words": "too old"})
    ahead: int = field(default=0, metadata={"words": "with a timestamp more than a minute ahead"})
    crowded: int = field(default=0, metadata={"words": "of too many signing streams"})
    setup_signing: int = field(default=0, metadata={"words": "that would change the key"})

    def refused(self) -> dict[str, int]:
        """Return the counts of reported refusals, by reason."""
        innocent = ("accepted", "foreign", "own", "unknown")
        reasons = [item for item in fields(self) if item.name not in innocent]
        return {item.metadata["words"]: getattr(self, item.name) for item in reasons if getattr(self, item.name)}


@cache
def kinds() -> dict[int, Kind]:
    """Return the properties of each message of the dialect, by its id."""
    return {
        number: Kind(message.crc_extra, message.unpacker.size, _target(message), _old_size(message))
        for number, message in dialect().mavlink_map.items()
    }


def _target(message: Any) -> int | None:
    """Return the offset of the target system in a payload, or None if it has none."""
    name = "target" if message.msgname == "MANUAL_CONTROL" else "target_system"
    if name not in message.fieldnames:
        return None
    offset = 0
    for other, array in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
        if other == name:
            return offset
        kind = message.fieldtypes[message.fieldnames.index(other)]
        offset += _SIZES[kind] * (array or 1)
    return None


def _old_size(message: Any) -> int:
    """Return the bytes of a payload without extension fields, which are last and not part of CRC_EXTRA."""
    crc, size, found = dialect().x25crc(f"{message.msgname} ".encode()), 0, int(message.unpacker.size)
    for name, array in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
        kind = message.fieldtypes[message.fieldnames.index(name)]
        crc.accumulate(f"{kind} {name} ".encode() + bytes((array,) if array else ()))
        size += _SIZES[kind] * (array or 1)
        if crc.crc & 0xFF ^ crc.crc >> 8 == message.crc_extra:
            found = size  # the last one: one before it may be the same by chance
    return found


_SIZES = {"char": 1, "uint8_t": 1, "int8_t": 1, "uint16_t": 2, "int16_t": 2, "uint32_t": 4, "int32_t": 4,
          "uint64_t": 8, "int64_t": 8, "float": 4, "double": 8}  # fmt: skip


def header_at(data: bytes, at: int) -> Header | None:
    """Parse the header at an offset; None if it is incomplete or has unknown flags."""
    marker, left = data[at], len(data) - at
    if marker == V2 and left >= _V2_HEADER.size:
        _, length, flags, system, component, low, high = _V2_HEADER.unpack_from(data, at)
        if flags & ~_SIGNED:
            return None
        signed, end = bool(flags), _V2_HEADER.size + length
        return Header(
            end + _CRC + _SIGNATURE * signed, _V2_HEADER.size, end, signed, system, component, low | high << 16
        )
    if marker == V1 and left >= _V1_HEADER.size:
        _, length, system, component, message = _V1_HEADER.unpack_from(data, at)
        end = _V1_HEADER.size + length
        return Header(end + _CRC, _V1_HEADER.size, end, False, system, component, message)
    return None


class Framer:
    """Encode messages as unsigned frames, as pymavlink does, in less than half the time.

    Parameters
    ----------
    source : (int, int)
        System and component id of the sender.

    Attributes
    ----------
    seq, old_seq : int
        Sequence number of the next frame of MAVLink 2 and of MAVLink 1, 0 to 255.
    """

    def __init__(self, source: tuple[int, int]) -> None:
        self._source = source
        self._crc = dialect().x25crc
        self._message = 0
        self.seq = self.old_seq = 0

    def count(self, old: bytes | None) -> None:
        """Advance the sequence number, also that of MAVLink 1 unless `old` is None."""
        self.seq = (self.seq + 1) % 256
        self.old_seq = (self.old_seq + (old is not None)) % 256

    def frame(self, message: Any) -> bytes:
        """Encode a message as a frame of MAVLink 2.

        Raises
        ------
        struct.error, OverflowError, IndexError, TypeError, ValueError
            If a field cannot hold its value.
        """
        return self._packed(message, self._framed)

    def old_frame(self, message: Any) -> bytes | None:
        """Encode a message as a frame of MAVLink 1, without extension fields; None for ids above 255.

        It raises as `frame` does.
        """
        return None if message.get_msgId() > _LAST_OF_V1 else self._packed(message, self._framed_old)

    def _packed(self, message: Any, pack: Callable[..., bytes]) -> bytes:
        self._message = message.get_msgId()  # its `id` may be a field
        message._pack = pack  # which the message's own `pack` calls with its payload
        try:
            framed: bytes = message.pack(None)
        finally:
            del message._pack  # another link may sign it
        return framed

    def _framed(self, codec: None, crc_extra: int, payload: bytes, force_mavlink1: bool = False) -> bytes:
        payload = payload.rstrip(b"\0") or payload[:1]  # zeros at the end are not sent
        system, component = self._source
        number = self._message & 0xFFFF, self._message >> 16
        body = _V2_WHOLE.pack(V2, len(payload), 0, 0, self.seq, system, component, *number) + payload
        return self._checked(body, crc_extra)

    def _framed_old(self, codec: None, crc_extra: int, payload: bytes, force_mavlink1: bool = False) -> bytes:
        payload = payload[: kinds()[self._message].old_size]
        system, component = self._source
        return self._checked(
            bytes((V1, len(payload), self.old_seq, system, component, self._message)) + payload, crc_extra
        )

    def _checked(self, body: bytes, crc_extra: int) -> bytes:
        crc: int = self._crc(body[1:] + bytes((crc_extra,))).crc
        return body + crc.to_bytes(_CRC, "little")


class Gate:
    """Accept or refuse frames, and decode the accepted ones.

    Parameters
    ----------
    counts : Counts
        Counts of the frames by outcome.
    own : (int, int), optional
        Own system and component id: frames from them, and those for other systems, are ignored. Default: frames for
        all systems are accepted.
    allowed : frozenset of int, optional
        System ids that are accepted; default: all.
    verifier : Verifier, optional
        Verifier of signatures; with it, frames not signed with its key are refused, and so is all of MAVLink 1.
    """

    def __init__(
        self,
        counts: Counts,
        own: tuple[int, int] | None = None,
        allowed: frozenset[int] | None = None,
        verifier: Verifier | None = None,
    ) -> None:
        self.counts = counts
        self._own, self._allowed, self._verifier = own, allowed, verifier
        mavlink = dialect()
        self.kinds = kinds()
        self._crc, self._error = mavlink.x25crc, mavlink.MAVError
        self._codec = mavlink.MAVLink(None)

    def datagram(self, data: bytes) -> Iterator[tuple[bytes, Any]]:
        """Yield the accepted frames of a datagram with their messages.

        Frames follow one another without gaps. A malformed one ends the datagram.
        """
        at = 0
        while at < len(data):
            header = header_at(data, at)
            if header is None or at + header.size > len(data):
                self.counts.malformed += 1
                return
            frame = data[at : at + header.size]
            if header.message not in self.kinds:
                self.counts.unknown += 1
            elif self._is_for_us(frame, header):
                if self.is_intact(frame, header):
                    yield from self._verified(frame, header)
                else:
                    self.counts.checksum += 1
            at += header.size

    def frame(self, frame: bytes, header: Header) -> Iterator[tuple[bytes, Any]]:
        """Yield an intact frame with its message, if it is accepted."""
        if self._is_for_us(frame, header):
            yield from self._verified(frame, header)

    def is_intact(self, frame: bytes, header: Header) -> bool:
        """Return True if the checksum of a known message's frame is right, and in MAVLink 1 its length is valid."""
        if frame[0] == V1 and header.end - header.payload > self.kinds[header.message].size:
            return False
        crc = self._crc(frame[1 : header.end])
        crc.accumulate(bytes((self.kinds[header.message].crc_extra,)))
        return bool(crc.crc == frame[header.end] | frame[header.end + 1] << 8)

    def _is_for_us(self, frame: bytes, header: Header) -> bool:
        target = self.kinds[header.message].target
        if self._own is not None and target is not None:
            where = header.payload + target
            system = frame[where] if where < header.end else 0  # zeros at the end of a payload are not sent
            if system not in (0, self._own[0]):  # 0 is broadcast; all own components are answered for
                self.counts.foreign += 1
                return False
        if (header.system, header.component) == self._own:
            self.counts.own += 1
            return False
        if self._allowed is not None and header.system not in self._allowed:
            self.counts.system += 1
            return False
        return True

    def _verified(self, frame: bytes, header: Header) -> Iterator[tuple[bytes, Any]]:
        """Yield a frame with its message, if it is signed as required and can be decoded."""
        counts = self.counts
        if self._verifier is not None:
            refusal = self._verifier.check(frame, header.system, header.component, header.signed)
            if refusal is not None:
                setattr(counts, refusal.value, getattr(counts, refusal.value) + 1)
                return
        if header.message == _SETUP_SIGNING:
            counts.setup_signing += 1
            return
        try:
            message = self._codec.decode(bytearray(frame))
        except self._error:
            counts.malformed += 1
            return
        counts.accepted += 1
        yield frame, message


class StreamReader:
    """Find the frames in a stream of bytes; invalid bytes do not lose a following frame.

    Parameters
    ----------
    gate : Gate
        Gate that accepts the frames.
    """

    def __init__(self, gate: Gate) -> None:
        self._gate = gate
        self._rest = b""  # an incomplete frame, shorter than the longest
        self._lost = False  # True if bytes were lost since the last frame; each loss counts once

    def read(self, data: bytes) -> Iterator[tuple[bytes, Any]]:
        """Yield the accepted frames that `data` completes, with their messages. Exhaust it before the next call."""
        data, at = self._rest + data, 0
        self._rest = b""
        while True:
            marker = _MARKER.search(data, at)
            start = len(data) if marker is None else marker.start()
            if start > at:
                self._lose("malformed")
            at = start
            if len(data) - at < _HEADERS.get(data[at : at + 1], 1):
                break
            header = header_at(data, at)
            if header is None or header.message not in self._gate.kinds:
                self._lose("malformed" if header is None else "unknown")
                at += 1
                continue
            if at + header.size > len(data):
                break
            frame = data[at : at + header.size]
            if not self._gate.is_intact(frame, header):
                self._lose("checksum")
                at += 1
                continue
            self._lost = False
            at += header.size
            yield from self._gate.frame(frame, header)
        self._rest = data[at:]

    def _lose(self, reason: str) -> None:
        if not self._lost:
            self._lost = True
            setattr(self._gate.counts, reason, getattr(self._gate.counts, reason) + 1)
