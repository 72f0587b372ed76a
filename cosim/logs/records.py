"""The records of a file that may be damaged anywhere: those before and after the damage are read."""

from __future__ import annotations

import contextlib
import re
import struct
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, ClassVar, Generic, TypeVar, cast

from cosim.errors import ImportLogError

OnProgress = Callable[[float], None]  # receives the fraction of the log read so far, 0 to 1
Record = TypeVar("Record")
# exceptions that damaged data raises in libraries
DAMAGE = (
    ValueError, KeyError, IndexError, TypeError, AttributeError, EOFError, OSError, RuntimeError, AssertionError,
    ArithmeticError, MemoryError, struct.error,
)  # fmt: skip
_WINDOW = 1 << 20  # bytes that are read at once
_MAX_WASTE = 20, 1 << 26  # sizes of the file, bytes: maximum size of records that prove to be damaged, in total


class Records(Generic[Record]):
    """Iterate over the sound records of a file; a format says where one may begin, its size, and if it is sound."""

    # A record without a checksum is sound if another one follows, else some of its bytes may be missing. After a
    # damaged record the search goes on one byte behind its begin, since its size may be wrong.

    mark: ClassVar[re.Pattern[bytes]]  # first bytes of a record, at most `head` of them
    head: ClassVar[int]  # bytes, from which the size of a record follows
    checked: ClassVar[re.Pattern[bytes] | None] = None  # begins of records that have a checksum or the like

    def __init__(self, path: Path, on_progress: OnProgress = lambda fraction: None, begin: int = 0) -> None:
        self._open: Callable[[], BinaryIO] = lambda: path.open("rb")
        self._on_progress = on_progress
        self.begin, self.end = begin, path.stat().st_size
        self.spans: list[tuple[int, int]] = []  # begins and ends of parts, in the order to read them; empty: the whole
        self.reason = ""  # why the first damaged record is not sound
        self.lost = 0  # bytes that belong to no sound record
        self.cut = 0  # of these, bytes at the end of the file
        self._data, self._start = b"", 0  # a part of the file, and its offset there

    def reopen(self, content: bytes) -> None:
        """Read records of a content instead of the file, such as of a decompressed part."""
        self._open, self._on_progress = lambda: BytesIO(content), lambda fraction: None
        self.begin, self.end, self.spans, self.lost = 0, len(content), [], 0
        self._data, self._start = b"", 0

    def _size_at(self, data: bytes, offset: int) -> int:
        """Return the size of the record at an offset, negative for one to skip; 0 if none begins there."""
        raise NotImplementedError

    def _parse(self, record: bytes) -> Record:
        """Parse a record; raise one of `DAMAGE` if it is not sound."""
        raise NotImplementedError

    def remarks(self, name: str) -> list[str]:
        """Return a sentence about damage in a file of a name."""
        if not self.lost:
            return []
        at_end = f", {self.cut} at its end" if self.cut else ""
        return [f"{self.lost} bytes of {name}{at_end} are damaged and were passed over."]

    def __iter__(self) -> Iterator[Record]:
        with contextlib.closing(self._open()) as self._file:
            for begin, end in self.spans or [(self.begin, self.end)]:
                yield from self._read(begin, end)

    def _read(self, at: int, stop: int) -> Iterator[Record]:
        """Yield the sound records between two positions."""
        size, waste = self._size_here(at), 0
        while at < stop:
            end = at + abs(size)
            if size and end <= self.end:
                offset = self._load(at, min(end - at, _WINDOW) + self.head)
                is_checked = size > 0 and self.checked is not None and self.checked.match(self._data, offset)
                is_followed = end == self.end or self.mark.match(self._data, self._load(end, self.head)) is not None
                try:
                    if not (is_followed or is_checked):
                        raise ValueError("a record is not followed by another")
                    offset = self._load(at, size) if size > 0 else 0
                    parsed = self._parse(self._data[offset : offset + size]) if size > 0 else None
                except DAMAGE as error:
                    self.reason = self.reason or str(error) or type(error).__name__
                    waste += max(size, 0)
                    if waste > max(_MAX_WASTE[0] * self.end, _MAX_WASTE[1]):
                        raise ImportLogError("is damaged in more places than can be searched") from error
                else:
                    if size > 0:
                        yield cast(Record, parsed)
                    at, size, self.cut = end, self._size_here(end), 0
                    continue
            begin = self._next(at + 1)
            self.lost, self.cut = self.lost + begin - at, self.cut + begin - at
            at, size = begin, self._size_here(begin)

    def _load(self, position: int, count: int) -> int:
        """Hold a number of bytes of the file from a position on, as far as there are; return the offset in the data."""
        offset = position - self._start
        if offset < 0 or (offset + count > len(self._data) and self._start + len(self._data) < self.end):
            kept = self._data[offset:] if offset >= 0 else b""
            self._file.seek(position + len(kept))
            self._data, self._start = kept + self._file.read(max(count - len(kept), _WINDOW)), position
            self._on_progress(min(1.0, (position + len(self._data)) / self.end))
            return 0
        return offset

    def _size_here(self, position: int) -> int:
        """Return the size of the record at a position of the file, 0 for none."""
        offset = self._load(position, self.head)
        try:
            return self._size_at(self._data, offset) if position < self.end else 0
        except (struct.error, IndexError):  # the file ends within its head
            return 0

    def _next(self, position: int) -> int:
        """Return the position of the next bytes that look like the begin of a record, or the end of the file."""
        while position < self.end:
            offset = self._load(position, self.head + 1)
            if (match := self.mark.search(self._data, offset)) is not None:
                return min(self._start + match.start(), self.end)
            position = max(position + 1, self._start + len(self._data) - self.head)
        return self.end
