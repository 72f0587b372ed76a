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
from cosim.logs.format import Moved

_MAGIC = b"ULog\x01\x12\x35"
_SYNC = bytes.fromhex("2f731320250cbb12")  # body of a synchronization message
_HEAD = struct.Struct("<HB")  # size and type of a message
_FILE_HEAD = 16  # bytes, size of the file's header
_CHUNK = 1 << 20  # bytes that are read at once
_BLOCK = 1 << 16  # bytes, least size of a yielded block of samples before the end
_LONGEST = 10_000  # bytes, greatest size of a message; a longer one counts as damage
_MOST_FIELDS, _DEEPEST = 4096, 8  # greatest length of an array in a message; greatest depth of nested types
_KNOWN = frozenset(b"BFIMPQARDLCSO")  # types of messages
_TYPES = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "i1", "char": "i1",
}  # fmt: skip
_POSSIBLE = re.compile(rb"[\x00-\xff][\x00-\x27][" + bytes(sorted(_KNOWN)) + rb"]", re.DOTALL)  # heads of messages
_FAULTS = (ValueError, KeyError, IndexError, struct.error, UnicodeDecodeError)


@dataclass
class _Topic:
    """A subscription: the format of its samples, and the samples that were not yielded yet."""

    name: str  # name of the topic with its instance, such as vehicle_attitude[0]
    dtype: np.dtype[Any]
    longest: int  # bytes, size of a sample with padding
    waiting: bytearray = field(default_factory=bytearray)  # samples that were not yielded yet

    def samples(self) -> NDArray[Any]:
        """Return the waiting samples, and clear them."""
        found = np.frombuffer(bytes(self.waiting), self.dtype)
        self.waiting.clear()
        return found


class ULogMessages:
    """Read a ULog file from start to end."""

    def __init__(self, path: Path, wanted: frozenset[str]) -> None:
        self._path, self._wanted = path, wanted
        self.parameters: dict[str, float] = {}
        self.dropouts: list[float] = []  # durations in which the logger lost data [s]
        self.is_damaged = False
        self._formats: dict[str, list[tuple[str, int, str]]] = {}
        self._dtypes: dict[str, tuple[np.dtype[Any], int]] = {}
        self._topics: dict[int, _Topic | None] = {}  # topics by their id in the file; None: not wanted
        self._has_begun = False
        self._appended: list[int] = []  # bytes, offsets in the file at which data were appended after a crash

    @property
    def formats(self) -> set[str]:
        """Types of messages that the file defines."""
        return set(self._formats)

    def blocks(self, moved: Moved) -> Iterator[tuple[str, NDArray[Any]]]:
        """Yield blocks of samples: the topic with its instance, and a structured array in the order of the file."""
        for kind, body in self._messages(moved):
            try:
                topic = self._take(kind, body)
            except _FAULTS:
                self.is_damaged = True
                continue
            if topic is not None and len(topic.waiting) >= _BLOCK:
                yield topic.name, topic.samples()
        for topic in self._topics.values():
            if topic is not None and topic.waiting:
                yield topic.name, topic.samples()

    def _take(self, kind: int, body: bytes) -> _Topic | None:
        """Process a message; return its topic if it is a sample of a wanted topic."""
        is_first, self._has_begun = not self._has_begun, True
        match chr(kind):
            case "D":
                number = int.from_bytes(body[:2], "little")
                topic = self._topics[number]  # KeyError: damage
                if topic is None:
                    return None
                least = topic.dtype.itemsize
                if not least <= len(body) - 2 <= topic.longest:
                    raise ValueError
                topic.waiting += body[2 : 2 + least]
                return topic
            case "F" if not self._topics:
                name, _, texts = body.decode().partition(":")
                fields = [_field(text) for text in texts.split(";") if text]
                if not fields:
                    raise ValueError
                self._formats[name] = fields
            case "A":
                number, name = int.from_bytes(body[1:3], "little"), body[3:].decode()
                if name in self._wanted:
                    self._topics[number] = self._topic(f"{name}[{body[0]}]", name)
                else:
                    self._topics[number] = None
            case "P" if not self._topics:
                said, value = body[1 : 1 + body[0]].decode().split(" "), body[1 + body[0] :]
                self.parameters[said[1]] = float(struct.unpack({"int32_t": "<i", "float": "<f"}[said[0]], value)[0])
            case "O":
                self.dropouts.append(1e-3 * int.from_bytes(body[:2], "little"))
            case "B" if is_first:
                if body[8] & ~1 or any(body[9:16]):
                    raise ImportLogError("cannot be read as a ULog file: it has flags of a newer format")
                self._appended = [x for x in struct.unpack_from("<3Q", body, 16) if x]
        return None

    def _topic(self, name: str, kind: str) -> _Topic:
        if kind not in self._dtypes:
            self._dtypes[kind] = self._dtype(kind)
        return _Topic(name, *self._dtypes[kind])

    def _dtype(self, kind: str) -> tuple[np.dtype[Any], int]:
        """Return the format of a type's samples without padding at the end, and their size with it [bytes]."""
        fields = list(islice(self._flat("", kind, 0), _LONGEST + 1))
        if len(fields) > _LONGEST:
            raise ValueError
        longest = np.dtype(fields).itemsize
        while fields and fields[-1][0].startswith("_padding"):
            fields.pop()
        return np.dtype(fields), longest

    def _flat(self, prefix: str, kind: str, depth: int) -> Iterator[tuple[str, str]]:
        """Yield name and type of each number of a message, also in nested types."""
        if depth > _DEEPEST:
            raise ValueError
        for of, count, name in self._formats[kind]:
            for place in [f"[{i}]" for i in range(count)] if count else [""]:
                if of in _TYPES:
                    yield f"{prefix}{name}{place}", _TYPES[of]
                else:
                    yield from self._flat(f"{prefix}{name}{place}.", of, depth + 1)

    def _messages(self, moved: Moved) -> Iterator[tuple[int, bytes]]:
        """Yield type and body of each message; after invalid bytes, go on at a sync mark or a likely head."""
        total = max(1, self._path.stat().st_size)
        with self._path.open("rb") as file:
            if file.read(_FILE_HEAD)[:7] != _MAGIC:
                raise ImportLogError("cannot be read as a ULog file: it does not begin as one")
            data, at, before = b"", 0, _FILE_HEAD  # `before`: number of the file's bytes before `data`
            searched = 0  # offset in the file before which no mark follows the present message
            while True:
                if len(data) - at < _LONGEST + _HEAD.size:
                    more = file.read(_CHUNK)
                    before, data, at = before + at, data[at:] + more, 0
                    moved((before + len(data)) / total)
                if len(data) - at < _HEAD.size:
                    return
                size, kind = _HEAD.unpack_from(data, at)
                end = at + _HEAD.size + size
                if kind not in _KNOWN or not 0 < size <= _LONGEST:
                    self.is_damaged = True
                    found = data.find(_SYNC, max(at + 1, searched - before))
                    if found >= 0:
                        at = found + len(_SYNC)
                    else:
                        searched = before + max(0, len(data) - len(_SYNC) + 1)
                        possible = _POSSIBLE.search(data, at + 1)
                        at = possible.start() if possible else max(at + 1, len(data) - _HEAD.size + 1)
                    continue
                if self._appended and before + end > self._appended[0] >= before + at:
                    offset = self._appended.pop(0) - before  # a crash has cut this message
                    at = min(offset, len(data))
                    continue
                if end > len(data):
                    return
                body, at = data[at + _HEAD.size : end], end
                yield kind, body


def _field(text: str) -> tuple[str, int, str]:
    """Parse the text of a field; return its type, its length (0 for one number) and its name."""
    kind, name = text.split(" ")
    of, _, count = kind.partition("[")
    number = int(count.removesuffix("]")) if count else 0
    if not 0 <= number <= _MOST_FIELDS:
        raise ValueError
    return of, number, name
