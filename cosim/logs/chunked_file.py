"""A file that is read forward in chunks, so that memory is independent of its length."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

OnProgress = Callable[[float], None]  # receives the fraction of the log read so far, 0 to 1
_CHUNK = 1 << 20  # bytes that are read at once


class ChunkedFile:
    """Read a file forward: what is ahead is `data` from `offset` on, which the caller increases."""

    def __init__(self, path: Path, on_progress: OnProgress) -> None:
        self.data, self.offset = b"", 0
        self.start = 0  # offset in the file of the first byte of `data`
        self._file, self._size, self._on_progress = path.open("rb"), max(1, path.stat().st_size), on_progress

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def ahead(self, count: int) -> int:
        """Read on if fewer bytes than `count` are ahead; return the number of bytes ahead."""
        if len(self.data) - self.offset < count and (chunk := self._file.read(_CHUNK)):
            self.start += self.offset
            self.data, self.offset = self.data[self.offset :] + chunk, 0
            self._on_progress((self.start + len(self.data)) / self._size)
        return len(self.data) - self.offset
