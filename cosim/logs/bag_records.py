"""The records of MCAP files and of bags of ROS 1: mcap.dev/spec, wiki.ros.org/Bags/Format/2.0."""

from __future__ import annotations

import copy
import itertools
import re
import struct
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO, ClassVar, NamedTuple

from cosim.errors import ImportLogError
from cosim.logs.decompression import MAX_PART, Decompressor
from cosim.logs.records import OnProgress, Records

_MCAP_HEAD = struct.Struct("<BQ")  # opcode and length of an MCAP record
_MCAP_MESSAGE = struct.Struct("<H4xQ8x")  # channel and time of an MCAP message
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = range(3, 7)  # opcodes of the MCAP records that are read
_MCAP_CHUNK = struct.Struct("<16xQI")  # size and checksum of a chunk
_TEXT = 4  # bytes, size of the length before a text
_ROS1_MESSAGE, _ROS1_CHUNK, _CHUNK_INFO, _CONNECTION = 2, 5, 6, 7  # operations of the records of ROS 1 that are read
_READ = _ROS1_MESSAGE, _ROS1_CHUNK, _CHUNK_INFO, _CONNECTION
_MAX_INDEX = 1 << 26  # bytes
_LENGTH = struct.Struct("<I")
_OPERATION = b"\4\0\0\0op="  # field of a header


class StoredMessage(NamedTuple):
    """A stored message, not decoded."""

    topic: str
    type: str  # name of the message type, such as nav_msgs/msg/Odometry
    definition: str  # text that defines the type and its nested types; empty if the storage has none
    language: str  # language of the definition: ros2msg or ros2idl; empty without one
    encoding: str  # encoding of the data, such as cdr, ros1 or json
    data: bytes
    time: float  # s, time of recording, by the recorder's clock


class BagRecords(Records[Iterable[StoredMessage]]):
    """Messages of each record: one, none, or those of a chunk."""

    magic: ClassVar[bytes]  # first bytes of the file

    def __init__(self, path: Path, on_progress: OnProgress = lambda fraction: None) -> None:
        super().__init__(path, on_progress)
        self.parts = Decompressor(self.end)
        self.channels: dict[int, tuple[str, str, str, str, str]] = {}  # the first fields of a `StoredMessage`
        self.schemas: dict[int, tuple[str, str, str]] = {}  # name, definition and language
        self.unknown = 0  # number of messages of no channel
        self.is_cut = False
        with path.open("rb") as file:
            self._begin_file(file)

    def _begin_file(self, file: BinaryIO) -> None:
        """Read what the begin and the end of the file say."""
        begins = file.read(len(self.magic)) == self.magic
        self.begin, self.reason = len(self.magic) * begins, "" if begins else "it does not begin as one"

    def _message(self, channel: int, time: float, data: bytes) -> Iterable[StoredMessage]:
        if channel in self.channels:
            return (StoredMessage(*self.channels[channel], data, time),)
        self.unknown += 1
        return ()

    def _inside(self, data: bytes) -> Iterator[StoredMessage]:
        """Yield the messages of a chunk, which shares channels with the file."""
        chunk = copy.copy(self)
        chunk.reopen(data)
        for messages in chunk:
            yield from messages
        self.lost, self.unknown = self.lost + chunk.lost, chunk.unknown

    def remarks(self, name: str) -> list[str]:
        """Return sentences about damage in a file of a name."""
        unknown = f"{self.unknown} messages of {name} are of no channel, and were passed over."
        cut = f"{name} breaks off: it has no footer."
        return [*super().remarks(name), *([unknown] if self.unknown else []), *([cut] if self.is_cut else [])]


class McapRecords(BagRecords):
    """Records of MCAP."""

    magic = b"\x89MCAP0\r\n"
    mark = re.compile(rb"[\x01-\x0f\x80-\xff][\0-\xff]{4}\0{4}")
    checked = re.compile(rb"\x06[\0-\xff]{36}[\1-\x08]\0\0\0[a-z0-9]")  # chunks that are compressed
    head = 64

    def _begin_file(self, file: BinaryIO) -> None:
        super()._begin_file(file)
        file.seek(max(0, self.end - len(self.magic)))
        self.is_cut = file.read() != self.magic
        self.end -= 0 if self.is_cut else len(self.magic)

    def _size_at(self, data: bytes, offset: int) -> int:
        opcode, length = _MCAP_HEAD.unpack_from(data, offset)
        if not self.mark.match(data, offset):
            return 0
        if _SCHEMA <= opcode <= _CHUNK:
            return int(_MCAP_HEAD.size + length) if length <= MAX_PART else 0
        return int(-_MCAP_HEAD.size - length)

    def _parse(self, record: bytes) -> Iterable[StoredMessage]:
        opcode, body = record[0], record[_MCAP_HEAD.size :]
        if opcode == _CHUNK:
            return self._inside(self._chunk(body))
        if opcode == _MESSAGE:
            channel, time = _MCAP_MESSAGE.unpack_from(body)
            return self._message(channel, time * 1e-9, body[_MCAP_MESSAGE.size :])
        if opcode == _SCHEMA:
            name, offset = _text(body, 2)
            encoding, offset = _text(body, offset)
            definition, _ = _text(body, offset)
            self.schemas[int.from_bytes(body[:2], "little")] = name, definition, encoding
        else:
            topic, offset = _text(body, 4)
            encoding, _ = _text(body, offset)
            key, schema = struct.unpack_from("<2H", body)
            self.channels[key] = topic, *self.schemas.get(schema, ("", "", "")), encoding
        return ()

    def _chunk(self, body: bytes) -> bytes:
        """Return the decompressed content of a chunk."""
        _, checksum = _MCAP_CHUNK.unpack_from(body)
        compression, offset = _text(body, _MCAP_CHUNK.size)
        (size,) = struct.unpack_from("<Q", body, offset)
        data = self.parts.decompress(compression, body[offset + 8 : offset + 8 + size])
        if checksum and zlib.crc32(data) != checksum:
            raise ValueError("a chunk has another checksum")
        return data


def _text(body: bytes, offset: int) -> tuple[str, int]:
    """Return a text that has its length before it, and the offset behind it."""
    begin = offset + _TEXT
    end = begin + int.from_bytes(body[offset:begin], "little")
    if end > len(body):
        raise ValueError("a text is longer than its record")
    return body[begin:end].decode(errors="replace"), end


class RosbagRecords(BagRecords):
    """Records of a bag of ROS 1."""

    magic = b"#ROSBAG V2.0\n"
    mark = re.compile(rb"[\0-\xff]{2}\0\0[\0-\xff]\0\0\0[a-z_]{2,12}=")
    checked = re.compile(rb"[\0-\xff]{,200}compression=(bz2|lz4)")
    head = 4096

    def _begin_file(self, file: BinaryIO) -> None:
        first = file.read(len(self.magic))
        if first != self.magic and first.startswith(b"#ROSBAG V"):
            raise ImportLogError(f"is a bag of version {first[9:].decode(errors='replace').strip()}, expected 2.0")
        file.seek(0)
        super()._begin_file(file)
        fields = _fields(file.read(self.head), 0) if not self.reason else {}
        if encryptor := fields.get(b"encryptor"):
            raise ImportLogError(f"is encrypted by {encryptor.decode(errors='replace')}, expected a bag that is not")
        # the index at the end lists all connections, also those whose first record is damaged, and the chunks' times
        file.seek(min(int.from_bytes(fields.get(b"index_pos", b""), "little") or self.end, self.end))
        self._chunks: list[tuple[float, int]] = []  # start [s] and offset of each chunk
        for _ in self._inside(file.read(_MAX_INDEX)):
            pass
        offsets = [offset for _, offset in self._chunks]
        if offsets != sorted(offsets):
            ends = dict(itertools.pairwise([*sorted({*offsets}), self.end]))
            self.spans = [(offset, ends[offset]) for offset in dict.fromkeys(x for _, x in sorted(self._chunks))]

    def _size_at(self, data: bytes, offset: int) -> int:
        (length,) = _LENGTH.unpack_from(data, offset)
        if not self.mark.match(data, offset) or length > self.head - 2 * _TEXT:
            return 0
        (count,) = _LENGTH.unpack_from(data, offset + _TEXT + length)
        size = 2 * _TEXT + length + count
        at = data.find(_OPERATION, offset, offset + _TEXT + length)
        if at < 0 or count > MAX_PART:
            return 0
        return int(size if data[at + len(_OPERATION)] in _READ else -size)

    def _parse(self, record: bytes) -> Iterable[StoredMessage]:
        fields, (length,) = _fields(record, 0), _LENGTH.unpack_from(record)
        operation, data = fields[b"op"][0], record[2 * _TEXT + length :]
        compression = fields.get(b"compression", b"").decode()
        if operation == _ROS1_CHUNK:
            return self._inside(self.parts.decompress(compression, data))
        if operation == _ROS1_MESSAGE:
            return self._message(_LENGTH.unpack(fields[b"conn"])[0], _ros1_time(fields[b"time"]), data)
        if operation == _CHUNK_INFO:
            self._chunks.append((_ros1_time(fields[b"start_time"]), int.from_bytes(fields[b"chunk_pos"], "little")))
            return ()
        about = {key: text.decode(errors="replace") for key, text in _fields(_LENGTH.pack(len(data)) + data, 0).items()}
        kind, topic = about[b"type"].replace("/", "/msg/"), fields[b"topic"].decode(errors="replace")
        (key,) = _LENGTH.unpack(fields[b"conn"])
        self.channels[key] = f"/{topic.strip('/')}", kind, about[b"message_definition"], "ros2msg", "ros1"
        return ()


def _fields(data: bytes, offset: int) -> dict[bytes, bytes]:
    """Return the fields of a header that has its length before it."""
    fields, end = {}, offset + _TEXT + _LENGTH.unpack_from(data, offset)[0]
    offset += _TEXT
    while offset < end:
        (length,) = _LENGTH.unpack_from(data, offset)
        name, equals, value = data[offset + _TEXT : offset + _TEXT + length].partition(b"=")
        offset += _TEXT + length
        if not equals or offset > end:
            raise ValueError("a header has a damaged field")
        fields[name] = value
    return fields


def _ros1_time(value: bytes) -> float:
    seconds, nanoseconds = struct.unpack("<2I", value)
    return float(seconds + 1e-9 * nanoseconds)
