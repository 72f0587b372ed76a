"""Readers of stored messages from ROS bags: MCAP, SQLite, and bags of ROS 1."""

from __future__ import annotations

import heapq
import mmap
import os
import re
import sqlite3
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from cosim.errors import ImportLogError
from cosim.logs.bag_database import open_database
from cosim.logs.chunked_file import OnProgress
from cosim.logs.decompression import MAX_PART, Decompressor

MAX_DECODED = 1 << 20  # bytes, maximum size of a message that is decoded: its objects take up to a hundred times that
_MAX_TOPICS = 20_000
_RECORD_HEAD = struct.Struct("<BQ")  # opcode and length of an MCAP record
_MESSAGE_HEAD, _DATA = struct.Struct("<H4xQ"), 22  # channel and time of an MCAP message; bytes before its data
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = range(2, 7)  # opcodes of the MCAP records that are read
_MAX_RECORD = {_FOOTER: 1 << 10, _SCHEMA: 1 << 20, _CHANNEL: 1 << 20, _MESSAGE: MAX_PART, _CHUNK: MAX_PART}  # bytes
_DAMAGED = -1  # in place of an opcode
_CHUNK_HEAD = re.compile(rb"\x04\0\0\0zstd|\x03\0\0\0lz4")  # compression of a chunk
_BEFORE_COMPRESSION = 37  # bytes of a chunk's record before it
_NUMBER = re.compile(r"\d+")
_ZSTANDARD = b"\x28\xb5\x2f\xfd"  # first bytes of compressed data, RFC 8878
# exceptions that damaged data raises in libraries
DAMAGE = (
    ValueError, KeyError, IndexError, TypeError, AttributeError, EOFError, OSError, RuntimeError, AssertionError,
    ArithmeticError, MemoryError, struct.error,
)  # fmt: skip
SUFFIXES = (".mcap", ".db3", ".bag")


class StoredMessage(NamedTuple):
    """A stored message, not decoded."""

    topic: str
    type: str  # name of the message type, such as nav_msgs/msg/Odometry
    definition: str  # text that defines the type and its nested types; empty if the storage has none
    language: str  # language of the definition: ros2msg or ros2idl; empty without one
    encoding: str  # encoding of the data, such as cdr, ros1 or json
    data: bytes
    time: float  # s, time of recording, by the recorder's clock
    progress: float  # fraction of the file read so far, 0 to 1


def bag_files(path: Path) -> list[Path]:
    """Return the files of a bag: the file itself, or the files of a recorder's folder in the order of their numbers."""
    if not path.is_dir():
        return [path]
    files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES and file.is_file()]
    packed = next((file.name for file in path.iterdir() if file.suffix.lower() in (".zstd", ".zst")), None)
    if packed is not None:
        raise ImportLogError(f"holds {packed!r}, which is compressed as a whole; expected files of zstd -d")
    if not files:
        raise ImportLogError(f"is a folder without a bag, expected files that end in {', '.join(SUFFIXES)}")
    if len({file.suffix.lower() for file in files}) > 1:
        raise ImportLogError("is a folder of bags of two kinds, expected one bag")
    return sorted(files, key=_sort_key)


def _sort_key(file: Path) -> tuple[list[int], str]:
    """Return the sort key of a bag's file: the numbers in its name, such as of a part or a time, and its name."""
    return [int(number) for number in _NUMBER.findall(file.stem)], file.name


def stored_messages(path: Path, remarks: list[str], on_progress: OnProgress) -> Iterator[StoredMessage]:
    """Yield the messages of a bag in the order of its files and their storage."""
    failures = _failures()
    files, readers = bag_files(path), {".mcap": _mcap_messages, ".db3": _sqlite_messages, ".bag": _ros1_messages}
    topics: set[str] = set()
    for k, file in enumerate(files):
        try:
            for message in readers[file.suffix.lower()](file, remarks):
                yield message
                if message.topic not in topics:
                    topics.add(message.topic)
                    if len(topics) > _MAX_TOPICS:
                        raise ImportLogError(f"has more than {_MAX_TOPICS} topics")
                on_progress((k + message.progress) / len(files))
        except failures as error:
            words = str(error) or type(error).__name__
            if not topics:
                raise ImportLogError(f"cannot be read as a bag: {words}") from error
            remarks.append(f"{file.name} breaks off: {words}"[:200])


def _failures() -> tuple[type[Exception], ...]:
    """Return the exceptions that a damaged bag raises in the libraries that read it."""
    from mcap.exceptions import McapError
    from rosbags.rosbag1 import ReaderError
    from zstandard import ZstdError

    return (McapError, ReaderError, ZstdError, sqlite3.Error, *DAMAGE)


def _mcap_messages(path: Path, remarks: list[str]) -> Iterator[StoredMessage]:
    """Yield the messages of an MCAP file in the order of its records; raise EOFError if the file ends early."""
    from mcap.data_stream import ReadDataStream
    from mcap.records import Channel, Chunk, Schema
    from mcap.stream_reader import read_magic

    size, failures, parts = path.stat().st_size, _failures(), Decompressor(path)
    schemas: dict[int, tuple[str, str, str]] = {}  # name, definition and language
    channels: dict[int, tuple[str, str, str, str, str]] = {}  # the first fields of a `StoredMessage`
    damaged_chunks = unknown = 0

    def records_in(body: bytes) -> Iterator[tuple[int, bytes]]:
        """Decompress a chunk, and yield opcode and body of each record."""
        chunk = Chunk.read(ReadDataStream(BytesIO(body)))
        data = parts.decompress(chunk.compression, chunk.data)
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise ValueError("a chunk has another checksum")
        yield from _mcap_records(BytesIO(data))

    try:
        with path.open("rb") as file:
            read_magic(ReadDataStream(file))
            for opcode, body in _mcap_records(file, size):
                if opcode == _FOOTER:
                    return
                damaged_chunks += opcode == _DAMAGED
                position = file.tell() / size
                try:
                    for kind, record in records_in(body) if opcode == _CHUNK else [(opcode, body)]:
                        if kind == _SCHEMA:
                            schema = Schema.read(ReadDataStream(BytesIO(record)))
                            schemas[schema.id] = schema.name, schema.data.decode(errors="replace"), schema.encoding
                        elif kind == _CHANNEL:
                            channel = Channel.read(ReadDataStream(BytesIO(record)))
                            definition = schemas.get(channel.schema_id, ("", "", ""))
                            channels[channel.id] = channel.topic, *definition, channel.message_encoding
                        elif kind == _MESSAGE:
                            key, time = _MESSAGE_HEAD.unpack_from(record)
                            if key in channels:
                                yield StoredMessage(*channels[key], record[_DATA:], time * 1e-9, position)
                            else:
                                unknown += 1
                except failures:
                    if opcode != _CHUNK:
                        raise
                    damaged_chunks += 1
        raise EOFError("the file ends without a footer")
    finally:
        if damaged_chunks:
            remarks.append(f"{damaged_chunks} damaged chunks of {path.name} were passed over.")
        if unknown:
            remarks.append(f"{unknown} messages of {path.name} are of no channel, and were passed over.")


def _mcap_records(file: BinaryIO, size: int = 0) -> Iterator[tuple[int, bytes]]:
    """Yield opcode and body of each record that matters here, of a file of a size [bytes] or a chunk."""
    # In a file, `_DAMAGED` stands for bytes that are passed over up to the next compressed chunk.
    while head := file.read(_RECORD_HEAD.size):
        opcode, length = _RECORD_HEAD.unpack(head) if len(head) == _RECORD_HEAD.size else (0, 0)
        limit = _MAX_RECORD.get(opcode)
        begin = file.tell() - len(head)
        is_damaged = begin + _RECORD_HEAD.size + length > size or (limit is not None and length > limit)
        if size and is_damaged and (chunk := _next_chunk(file, begin + 1)) is not None:
            file.seek(chunk)
            yield _DAMAGED, b""
            continue
        if limit is None:
            file.seek(length, os.SEEK_CUR)
            continue
        if length > limit:
            raise ImportLogError(f"has a record of {length} bytes, expected at most {limit}")
        body = file.read(length)
        if len(body) < length:
            raise EOFError(f"a record has {len(body)} bytes of {length}")
        yield opcode, body


def _next_chunk(file: BinaryIO, start: int) -> int | None:
    """Return the offset of the next compressed chunk from an offset on, or None."""
    with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for match in _CHUNK_HEAD.finditer(data, start):
            begin = match.start() - _BEFORE_COMPRESSION
            if begin >= start and data[begin] == _CHUNK:
                return begin
    return None


def _sqlite_messages(path: Path, remarks: list[str]) -> Iterator[StoredMessage]:
    parts, total, read = Decompressor(path), path.stat().st_size, 0
    with open_database(path) as database:
        if not database.tables >= {"topics", "messages"}:
            raise ImportLogError("is a database without topics and messages, expected a bag of ROS 2")
        texts: dict[str, tuple[str, str]] = {}
        if "message_definitions" in database.tables:
            query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
            texts = {name: (text, language) for name, text, language in database.rows(query, str, str, str)}
        topics = {
            key: (topic, _three_parts(kind), *texts.get(kind, ("", "")), encoding)
            for key, topic, kind, encoding in database.rows(
                "SELECT id, name, type, serialization_format FROM topics", int, str, str, str
            )
        }
        query = "SELECT topic_id, timestamp, data FROM messages ORDER BY id"
        for topic, stamp, data in database.rows(query, int, int, bytes):
            if topic not in topics:
                raise ValueError(f"a message has topic number {topic!r}, expected one of {sorted(topics)}")
            read += len(data)
            if data.startswith(_ZSTANDARD):  # the recorder has compressed each message
                data = parts.decompress("zstd", data)
            yield StoredMessage(*topics[topic], data, stamp * 1e-9, read / total)


def _three_parts(kind: str) -> str:
    """Return a type's name with its part ``msg``, which early recorders omit."""
    return kind.replace("/", "/msg/") if kind.count("/") == 1 else kind


def _ros1_messages(path: Path, remarks: list[str]) -> Iterator[StoredMessage]:
    from rosbags.rosbag1.reader import Header, Reader, ReaderError, RecordType, read_bytes, read_uint32

    class BoundedReader(Reader):  # type: ignore[misc]
        """A reader that refuses to read parts of an index twice."""

        index_size = 0  # bytes, size of the index so far

        def read_index_data(self, pos: int, indexes: dict[int, Any]) -> None:
            start = self.bio.tell()
            super().read_index_data(pos, indexes)
            self.index_size += self.bio.tell() - start
            if self.index_size > path.stat().st_size:
                raise ReaderError("the index is larger than the file")

    parts, position, chunk, walked = Decompressor(path), -1, BytesIO(), 0
    with BoundedReader(path) as bag:
        total = max(1, sum(map(len, bag.indexes.values())))
        connections = {connection.id: connection for connection in bag.connections}
        for k, entry in enumerate(heapq.merge(*(bag.indexes[key] for key in connections))):
            if entry.chunk_pos != position:
                position = entry.chunk_pos
                bag.bio.seek(position)
                compression = Header.read(bag.bio, RecordType.CHUNK).get_string("compression")
                chunk = BytesIO(parts.decompress(compression, read_bytes(bag.bio, read_uint32(bag.bio))))
            chunk.seek(entry.offset)
            while (header := Header.read(chunk)).get_uint8("op") == RecordType.CONNECTION:
                chunk.seek(read_uint32(chunk), os.SEEK_CUR)
            if header.get_uint8("op") != RecordType.MSGDATA or header.get_time("time") != entry.time:
                raise ReaderError("the index does not lead to its message")
            data = read_bytes(chunk, read_uint32(chunk))
            walked += chunk.tell() - entry.offset
            if walked > parts.total:
                raise ImportLogError("has more messages in its index than in its chunks")
            connection = connections[header.get_uint32("conn")]
            text = getattr(connection.msgdef, "data", connection.msgdef)
            yield StoredMessage(
                connection.topic, connection.msgtype, text, "ros2msg", "ros1", data, entry.time * 1e-9, k / total
            )
