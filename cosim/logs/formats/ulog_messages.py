"""Messages of a ULog file, PX4's format of logs, block by block (docs.px4.io/main/en/dev_log/ulog_file_format)."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import ImportLogError
from cosim.logs.records import OnProgress, Records

_MAGIC = b"ULog\x01\x12\x35"
_HEAD = struct.Struct("<HB")  # size and type of a message
_FILE_HEAD = 16  # bytes, size of the file's header
_BLOCK = 1 << 16  # bytes, minimum size of a yielded block of samples before the end
_MAX_MESSAGE = 10_000  # bytes, maximum size of a message; a longer one counts as damage
_MAX_LENGTH, _MAX_DEPTH = 4096, 8  # maximum length of an array in a message; maximum depth of nested types
_KNOWN = frozenset(b"BFIMPQARDLCSO")  # types of messages
_SIZES = {"B": 40, "O": 2, "R": 3, "S": 8}  # bytes, sizes of messages that have only one
_TYPES = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "i1", "char": "i1",
}  # fmt: skip


@dataclass
class _Topic:
    """A subscription: the format of its samples, and the samples that were not yielded yet."""

    name: str  # name of the topic with its instance, such as vehicle_attitude[0]
    dtype: np.dtype[Any]
    padded_size: int  # bytes, size of a sample with padding
    pending: bytearray = field(default_factory=bytearray)  # samples that were not yielded yet

    def samples(self) -> NDArray[Any]:
        """Return the pending samples, and clear them."""
        samples = np.frombuffer(bytes(self.pending), self.dtype)
        self.pending.clear()
        return samples


class ULogMessages(Records["_Topic | None"]):
    """Read a ULog file from start to end; a record is a message, and gives its topic if that is read."""

    head = _HEAD.size
    mark = re.compile(rb"[\0-\xff][\0-\x27][" + bytes(sorted(_KNOWN)) + rb"]")

    def __init__(self, path: Path, names: frozenset[str], on_progress: OnProgress = lambda fraction: None) -> None:
        super().__init__(path, on_progress, _FILE_HEAD)
        with path.open("rb") as file:
            if file.read(len(_MAGIC)) != _MAGIC:
                raise ImportLogError("cannot be read as a ULog file: it does not begin as one")
        self._names = names
        self.parameters: dict[str, float] = {}
        self.dropouts: list[float] = []  # durations in which the logger lost data [s]
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        self._dtypes: dict[str, tuple[np.dtype[Any], int]] = {}
        self._topics: dict[int, _Topic | None] = {}  # topics by their id in the file; None: not read
        self._has_begun = False

    @property
    def formats(self) -> set[str]:
        """Types of messages that the file defines."""
        return set(self._formats)

    def blocks(self) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield blocks of samples: the topic with its instance, and a structured array in the order of the file."""
        for topic in self:
            if topic is not None and len(topic.pending) >= _BLOCK:
                yield topic.name, topic.samples()
        for topic in self._topics.values():
            if topic is not None and topic.pending:
                yield topic.name, topic.samples()

    def _size_at(self, data: bytes, offset: int) -> int:
        size, kind = _HEAD.unpack_from(data, offset)
        return _HEAD.size + size if kind in _KNOWN and 0 < size <= _MAX_MESSAGE else 0

    def _parse(self, record: bytes) -> _Topic | None:
        kind, body = chr(record[2]), record[_HEAD.size :]
        if len(body) != _SIZES.get(kind, len(body)):
            raise ValueError
        is_first, self._has_begun = not self._has_begun, True
        match kind:
            case "D":
                number = int.from_bytes(body[:2], "little")
                topic = self._topics[number]  # KeyError: damage
                if topic is None:
                    return None
                size = topic.dtype.itemsize
                if not size <= len(body) - 2 <= topic.padded_size:
                    raise ValueError
                topic.pending += body[2 : 2 + size]
                return topic
            case "F" if not self._topics:
                name, _, texts = body.decode().partition(":")
                fields = [_field(text) for text in texts.split(";") if text]
                if not fields:
                    raise ValueError
                self._formats[name] = fields
            case "A":
                number, name = int.from_bytes(body[1:3], "little"), body[3:].decode()
                self._topics[number] = self._topic(f"{name}[{body[0]}]", name) if name in self._names else None
            case "P" if not self._topics:
                (kind_name, key), value = body[1 : 1 + body[0]].decode().split(" "), body[1 + body[0] :]
                self.parameters[key] = float(struct.unpack({"int32_t": "<i", "float": "<f"}[kind_name], value)[0])
            case "O":
                self.dropouts.append(1e-3 * int.from_bytes(body[:2], "little"))
            case "B" if is_first:
                if body[8] & ~1 or any(body[9:16]):
                    raise ImportLogError("cannot be read as a ULog file: it has flags of a newer format")
        return None

    def _topic(self, name: str, kind: str) -> _Topic:
        if kind not in self._dtypes:
            self._dtypes[kind] = self._dtype(kind)
        return _Topic(name, *self._dtypes[kind])

    def _dtype(self, kind: str) -> tuple[np.dtype[Any], int]:
        """Return the format of a type's samples without padding at the end, and their size with it [bytes]."""
        fields = list(islice(self._flat("", kind, 0), _MAX_MESSAGE + 1))
        if len(fields) > _MAX_MESSAGE:
            raise ValueError
        padded_size = np.dtype(fields).itemsize
        while fields and fields[-1][0].startswith("_padding"):
            fields.pop()
        return np.dtype(fields), padded_size

    def _flat(self, prefix: str, kind: str, depth: int) -> Iterator[tuple[str, str]]:
        """Yield name and type of each number of a message, also in nested types."""
        if depth > _MAX_DEPTH:
            raise ValueError
        for element, count, name in self._formats[kind]:
            for index in [f"[{i}]" for i in range(count)] if count else [""]:
                if element in _TYPES:
                    yield f"{prefix}{name}{index}", _TYPES[element]
                else:
                    yield from self._flat(f"{prefix}{name}{index}.", element, depth + 1)


def _field(text: str) -> tuple[str, int, str]:
    """Parse the text of a field; return its type, its length (0 for one number) and its name."""
    kind, name = text.split(" ")
    element, _, count = kind.partition("[")
    number = int(count.removesuffix("]")) if count else 0
    if not 0 <= number <= _MAX_LENGTH:
        raise ValueError
    return element, number, name
