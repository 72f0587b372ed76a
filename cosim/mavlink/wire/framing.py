"""Frames: decode bytes with cheap checks first, so that no input raises; make those of MAVLink 1."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, NamedTuple

from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.signing import Verifier

V1, V2 = 0xFE, 0xFD  # first byte of a frame
_SIGNED = 0x01  # bit of the incompatibility flags
_SIGNATURE = 13  # bytes
_CRC = 2  # bytes
_SETUP_SIGNING = 256  # id of SETUP_SIGNING
_MAX_V1_ID = 255  # highest message id of MAVLink 1
_V2_HEADER = struct.Struct("<BBBxxBBHB")  # marker, length, flags, system, component, id in two parts
_SOURCE_OFFSET = 5  # of the system in a header of MAVLink 2
_V1_HEADER = struct.Struct("<BBxBBB")  # marker, length, system, component, id
_HEADER_SIZES = {b"\xfd": _V2_HEADER.size, b"\xfe": _V1_HEADER.size}
_MARKER = re.compile(rb"[\xfd\xfe]")
_FIELD_SIZES = {"char": 1, "uint8_t": 1, "int8_t": 1, "uint16_t": 2, "int16_t": 2, "uint32_t": 4, "int32_t": 4,
                "uint64_t": 8, "int64_t": 8, "float": 4, "double": 8}  # fmt: skip


class MessageInfo(NamedTuple):
    """Properties of a message for the checks before decoding."""

    crc_extra: int
    max_size: int  # maximum bytes of the payload
    target_offset: int | None  # offset of the target system in the payload
    v1_size: int  # bytes of the payload in MAVLink 1, which has no extension fields


class Header(NamedTuple):
    """Sender and message of a frame; offsets are from its first byte."""

    size: int  # bytes of the whole frame
    payload: int  # offset of the payload's start
    end: int  # offset of the payload's end, where the checksum starts
    is_signed: bool
    system: int
    component: int
    message_id: int


def _reported(words: str) -> int:
    return field(default=0, metadata={"words": words})


@dataclass(slots=True)
class RxStats:
    """Received frames, by their outcome; those with words are reported to the user."""

    accepted: int = 0
    foreign: int = 0  # for another system
    own: int = 0
    unknown: int = 0  # message not in the dialect
    malformed: int = _reported("malformed")
    checksum: int = _reported("with a wrong checksum")
    system: int = _reported("of a system that is not allowed")
    unsigned: int = _reported("unsigned")
    forged: int = _reported("forged")
    replayed: int = _reported("replayed")
    old: int = _reported("too old")
    ahead: int = _reported("with a timestamp more than a minute ahead")
    crowded: int = _reported("of too many signing streams")
    setup_signing: int = _reported("that would change the key")

    def count(self, outcome: str) -> None:
        """Count a frame with the outcome of that name."""
        setattr(self, outcome, getattr(self, outcome) + 1)

    def rejected(self) -> dict[str, int]:
        """Return the counts of reported rejections, by reason."""
        counts = {item.metadata.get("words", ""): getattr(self, item.name) for item in fields(self)}
        return {words: n for words, n in counts.items() if words and n}


@cache
def message_infos() -> dict[int, MessageInfo]:
    """Return the properties of each message of the dialect, by its id."""
    return {number: _message_info(message) for number, message in dialect().mavlink_map.items()}


def _message_info(message: Any) -> MessageInfo:
    target_field = "target" if message.msgname == "MANUAL_CONTROL" else "target_system"
    crc, offset, target_offset = dialect().x25crc(f"{message.msgname} ".encode()), 0, None
    max_size = v1_size = int(message.unpacker.size)
    for name, length in zip(message.ordered_fieldnames, message.array_lengths, strict=True):
        type_name = message.fieldtypes[message.fieldnames.index(name)]
        target_offset = offset if name == target_field else target_offset
        offset += _FIELD_SIZES[type_name] * (length or 1)
        crc.accumulate(f"{type_name} {name} ".encode() + bytes((length,) if length else ()))
        if crc.crc & 0xFF ^ crc.crc >> 8 == message.crc_extra:  # extension fields follow; an earlier match is chance
            v1_size = offset
    return MessageInfo(message.crc_extra, max_size, target_offset, v1_size)


def parse_header(data: bytes, offset: int) -> Header | None:
    """Parse the header at an offset; None if it is incomplete or has unknown flags."""
    marker, available = data[offset], len(data) - offset
    if marker == V2 and available >= _V2_HEADER.size:
        _, length, flags, system, component, low, high = _V2_HEADER.unpack_from(data, offset)
        if flags & ~_SIGNED:
            return None
        is_signed, end = bool(flags), _V2_HEADER.size + length
        size = end + _CRC + _SIGNATURE * is_signed
        return Header(size, _V2_HEADER.size, end, is_signed, system, component, low | high << 16)
    if marker == V1 and available >= _V1_HEADER.size:
        _, length, system, component, message_id = _V1_HEADER.unpack_from(data, offset)
        end = _V1_HEADER.size + length
        return Header(end + _CRC, _V1_HEADER.size, end, False, system, component, message_id)
    return None


def encode_v1(frame: bytes, seq: int) -> bytes | None:
    """Encode an unsigned frame of MAVLink 2 as one of MAVLink 1, without extension fields; None for ids above 255."""
    system, component, low, high = struct.unpack_from("<BBHB", frame, _SOURCE_OFFSET)
    if low > _MAX_V1_ID or high:
        return None
    info = message_infos()[low]
    payload = frame[_V2_HEADER.size : -_CRC].ljust(info.v1_size, b"\0")[: info.v1_size]
    body = bytes((V1, len(payload), seq, system, component, low)) + payload
    crc: int = dialect().x25crc(body[1:] + bytes((info.crc_extra,))).crc
    return body + crc.to_bytes(_CRC, "little")


class FrameFilter:
    """Accept or reject frames, and decode the accepted ones."""

    def __init__(
        self,
        stats: RxStats,
        own: tuple[int, int] | None = None,
        allowed: frozenset[int] | None = None,
        verifier: Verifier | None = None,
    ) -> None:
        self.stats = stats
        self._own, self._allowed, self._verifier = own, allowed, verifier
        mavlink = dialect()
        self.infos = message_infos()
        self._crc, self._error = mavlink.x25crc, mavlink.MAVError
        self._codec = mavlink.MAVLink(None)

    def read_datagram(self, data: bytes) -> Iterator[tuple[bytes, Any]]:
        """Yield the accepted frames of a datagram with their messages."""
        # Frames follow one another without gaps. A malformed one ends the datagram.
        offset = 0
        while offset < len(data):
            header = parse_header(data, offset)
            if header is None or offset + header.size > len(data):
                self.stats.malformed += 1
                return
            frame = data[offset : offset + header.size]
            if header.message_id not in self.infos:
                self.stats.unknown += 1
            elif self._is_for_us(frame, header):
                if self.is_intact(frame, header):
                    yield from self._decode(frame, header)
                else:
                    self.stats.checksum += 1
            offset += header.size

    def accept(self, frame: bytes, header: Header) -> Iterator[tuple[bytes, Any]]:
        """Yield an intact frame with its message, if it is accepted."""
        if self._is_for_us(frame, header):
            yield from self._decode(frame, header)

    def is_intact(self, frame: bytes, header: Header) -> bool:
        """Return True if the checksum of a known message's frame is right, and in MAVLink 1 its length is valid."""
        info = self.infos[header.message_id]
        if frame[0] == V1 and header.end - header.payload > info.max_size:
            return False
        crc = self._crc(frame[1 : header.end])
        crc.accumulate(bytes((info.crc_extra,)))
        return bool(crc.crc == frame[header.end] | frame[header.end + 1] << 8)

    def _is_for_us(self, frame: bytes, header: Header) -> bool:
        target_offset = self.infos[header.message_id].target_offset
        if self._own is not None and target_offset is not None:
            offset = header.payload + target_offset
            system = frame[offset] if offset < header.end else 0  # zeros at the end of a payload are not sent
            if system not in (0, self._own[0]):  # 0 is broadcast; all own components are answered for
                self.stats.foreign += 1
                return False
        if (header.system, header.component) == self._own:
            self.stats.own += 1
            return False
        if self._allowed is not None and header.system not in self._allowed:
            self.stats.system += 1
            return False
        return True

    def _decode(self, frame: bytes, header: Header) -> Iterator[tuple[bytes, Any]]:
        """Yield a frame with its message, if it is signed as required and can be decoded."""
        stats = self.stats
        if self._verifier is not None:
            rejection = self._verifier.check(frame, header.system, header.component, header.is_signed)
            if rejection is not None:
                stats.count(rejection)
                return
        if header.message_id == _SETUP_SIGNING:
            stats.setup_signing += 1
            return
        try:
            message = self._codec.decode(bytearray(frame))
        except self._error:
            stats.malformed += 1
            return
        stats.accepted += 1
        yield frame, message


class StreamReader:
    """Find the frames in a stream of bytes; invalid bytes do not lose a following frame."""

    def __init__(self, frame_filter: FrameFilter) -> None:
        self._filter = frame_filter
        self._rest = b""  # an incomplete frame, shorter than the longest
        self._in_gap = False  # True if bytes were lost since the last frame; each loss counts once

    def read(self, data: bytes) -> Iterator[tuple[bytes, Any]]:
        """Yield the accepted frames that `data` completes, with their messages. Exhaust it before the next call."""
        data, offset = self._rest + data, 0
        self._rest = b""
        while True:
            marker = _MARKER.search(data, offset)
            start = len(data) if marker is None else marker.start()
            if start > offset:
                self._count_loss("malformed")
            offset = start
            if len(data) - offset < _HEADER_SIZES.get(data[offset : offset + 1], 1):
                break
            header = parse_header(data, offset)
            if header is None or header.message_id not in self._filter.infos:
                self._count_loss("malformed" if header is None else "unknown")
                offset += 1
                continue
            if offset + header.size > len(data):
                break
            frame = data[offset : offset + header.size]
            if not self._filter.is_intact(frame, header):
                self._count_loss("checksum")
                offset += 1
                continue
            self._in_gap = False
            offset += header.size
            yield from self._filter.accept(frame, header)
        self._rest = data[offset:]

    def _count_loss(self, outcome: str) -> None:
        if not self._in_gap:
            self._in_gap = True
            self._filter.stats.count(outcome)
