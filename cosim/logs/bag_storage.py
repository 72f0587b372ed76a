"""Readers of stored messages from ROS bags: MCAP, SQLite, and bags of ROS 1."""

from __future__ import annotations

import contextlib
import re
import sqlite3
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.errors import ImportLogError
from cosim.logs.format import Moved

_LARGEST = 1 << 28  # bytes, greatest size of an MCAP record
_NUMBER = re.compile(r"\d+")
_ZSTANDARD = b"\x28\xb5\x2f\xfd"  # first bytes of compressed data, RFC 8878
# exceptions that damaged data raises in libraries
DAMAGE = (
    ValueError, KeyError, IndexError, TypeError, AttributeError, EOFError, OSError, RuntimeError, AssertionError,
    MemoryError, struct.error,
)  # fmt: skip
SUFFIXES = (".mcap", ".db3", ".bag")


@dataclass(frozen=True, slots=True)
class StoredMessage:
    """A stored message, not decoded."""

    topic: str
    type: str  # name of the message type, such as nav_msgs/msg/Odometry
    definition: str  # text that defines the type and its nested types; empty if the storage has none
    language: str  # language of the definition: ros2msg or ros2idl; empty without one
    encoding: str  # encoding of the data, such as cdr, ros1 or json
    data: bytes
    time: float  # s, time of recording, by the recorder's clock
    part: float  # fraction of the file read so far, 0 to 1


def bag_files(path: Path) -> list[Path]:
    """Return the files of a bag: the file itself, or the files of a recorder's folder in the order of their numbers.

    Raises
    ------
    ImportLogError
        If the folder holds no bag, or files of two kinds.
    """
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


def stored_messages(path: Path, remarks: list[str], moved: Moved) -> Iterator[StoredMessage]:
    """Yield the messages of a bag in the order of its files and their storage.

    Parameters
    ----------
    path : Path
        Path of a bag's file, or of a folder of such files.
    remarks : list of str
        Receives a remark on each file that ends early or has damaged parts.
    moved : callable
        Receives the fraction read so far.

    Raises
    ------
    ImportLogError
        If the first file cannot be read at all.
    """
    failures = _failures()
    files, readers = bag_files(path), {".mcap": _of_mcap, ".db3": _of_sqlite, ".bag": _of_ros1}
    found = False
    for k, file in enumerate(files):
        try:
            for message in readers[file.suffix.lower()](file, remarks):
                yield message
                found = True
                moved((k + message.part) / len(files))
        except failures as error:
            words = str(error) or type(error).__name__
            if not found:
                raise ImportLogError(f"cannot be read as a bag: {words}") from error
            remarks.append(f"{file.name} breaks off: {words}"[:200])


def _failures() -> tuple[type[Exception], ...]:
    """Return the exceptions that a damaged bag raises in the libraries that read it."""
    from mcap.exceptions import McapError
    from rosbags.rosbag1 import ReaderError
    from zstandard import ZstdError

    return (McapError, ReaderError, ZstdError, sqlite3.Error, *DAMAGE)


def _of_mcap(path: Path, remarks: list[str]) -> Iterator[StoredMessage]:
    from mcap.reader import make_reader
    from mcap.records import Channel, Chunk, Message, Schema
    from mcap.stream_reader import StreamReader, breakup_chunk

    failures, total, lost, unknown = _failures(), path.stat().st_size, 0, 0
    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    with path.open("rb") as file:
        # the index at the end, which is missing if the recorder was killed
        with contextlib.suppress(*failures):
            summary = make_reader(file, record_size_limit=_LARGEST).get_summary()
            schemas, channels = dict(summary.schemas), dict(summary.channels)
        file.seek(0)
        for whole in StreamReader(file, emit_chunks=True, record_size_limit=_LARGEST).records:
            try:
                records = breakup_chunk(whole, validate_crc=True) if isinstance(whole, Chunk) else [whole]
            except failures:
                lost += 1
                continue
            for record in records:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message) and record.channel_id not in channels:
                    unknown += 1
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    schema = schemas.get(channel.schema_id)
                    yield StoredMessage(
                        channel.topic,
                        schema.name if schema else "",
                        schema.data.decode() if schema else "",
                        schema.encoding if schema else "",
                        channel.message_encoding,
                        record.data,
                        record.log_time * 1e-9,
                        file.tell() / total,
                    )
    if lost:
        remarks.append(f"{lost} damaged chunks of {path.name} were passed over.")
    if unknown:
        remarks.append(f"{unknown} messages of {path.name} are of no channel, and were passed over.")


def _of_sqlite(path: Path, remarks: list[str]) -> Iterator[StoredMessage]:
    # a recorder that was killed leaves a journal, which a file opened as immutable would not show
    journal = path.with_name(f"{path.name}-wal").exists()
    address = f"{path.resolve().as_uri()}?mode=ro" + ("" if journal else "&immutable=1")
    with contextlib.closing(sqlite3.connect(address, uri=True)) as database:
        tables = {name for (name,) in database.execute("SELECT name FROM sqlite_master")}
        if not tables >= {"topics", "messages"}:
            raise ImportLogError("is a database without topics and messages, expected a bag of ROS 2")
        texts: dict[str, tuple[str, str]] = {}
        if "message_definitions" in tables:
            query = "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions"
            texts = {name: (text, language) for name, text, language in database.execute(query)}
        topics = {
            key: (topic, _three_parts(kind), *texts.get(kind, ("", "")), encoding)
            for key, topic, kind, encoding in database.execute(
                "SELECT id, name, type, serialization_format FROM topics"
            )
        }
        total, read = path.stat().st_size, 0
        for topic, stamp, data in database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id"):
            if topic not in topics:
                raise ValueError(f"a message has topic number {topic!r}, expected one of {sorted(topics)}")
            read += len(data)
            yield StoredMessage(*topics[topic], _unpacked(data), stamp * 1e-9, read / total)


def _three_parts(kind: str) -> str:
    """Return a type's name with its part ``msg``, which early recorders omit."""
    return kind.replace("/", "/msg/") if kind.count("/") == 1 else kind


def _unpacked(data: bytes) -> bytes:
    """Return the data of a message, decompressed if the recorder has compressed each message."""
    if not data.startswith(_ZSTANDARD):
        return data
    from zstandard import ZstdDecompressor

    return ZstdDecompressor().decompressobj().decompress(data)


def _of_ros1(path: Path, remarks: list[str]) -> Iterator[StoredMessage]:
    from rosbags.rosbag1 import Reader

    with Reader(path) as bag:
        total = max(1, bag.message_count)
        for k, (connection, stamp, data) in enumerate(bag.messages()):
            text = getattr(connection.msgdef, "data", connection.msgdef)
            yield StoredMessage(
                connection.topic, connection.msgtype, text, "ros2msg", "ros1", bytes(data), stamp * 1e-9, k / total
            )
