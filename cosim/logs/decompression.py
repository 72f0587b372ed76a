"""Decompression of parts of a bag, bounded in each part and in total."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from cosim.errors import ImportLogError

MAX_PART = 1 << 27  # bytes, maximum size of a chunk or message
_PIECE = 1 << 20  # bytes
_MIN_TOTAL = 1 << 24  # bytes that the parts of any bag may have in total
_MAX_RATIO = 100  # maximum total size of the parts beyond that, in sizes of the file


class Decompressor:
    """Decompress the parts of a file of a size [bytes]."""

    def __init__(self, size: int) -> None:
        self._max_total = max(_MIN_TOTAL, _MAX_RATIO * size)
        self.total = 0  # total size of the parts so far [bytes]

    def decompress(self, compression: str, data: bytes) -> bytes:
        """Decompress a part; `compression` is bz2, lz4, zstd, none or empty."""
        limit = min(MAX_PART, self._max_total - self.total)
        if compression not in ("", "none"):
            opened = _open(compression, BytesIO(data))
            try:
                with opened as file:
                    pieces, size = [], 0  # at once, a library would allocate the limit
                    while size <= limit and (piece := file.read(_PIECE)):
                        pieces.append(piece)
                        size += len(piece)
                    data = b"".join(pieces)
            except Exception as error:  # each library has errors of its own
                raise ValueError(f"a part cannot be decompressed: {error}") from error
        if len(data) > limit:
            raise ImportLogError(
                f"decompresses to more than {self.total + limit} bytes, "
                f"expected at most {MAX_PART} in a part and {self._max_total} in all"
            )
        self.total += len(data)
        return data


def _open(compression: str, file: BytesIO) -> Any:
    """Open compressed data as a file to read from."""
    if compression == "bz2":
        from bz2 import BZ2File

        return BZ2File(file)
    if compression == "lz4":
        from lz4.frame import LZ4FrameFile

        return LZ4FrameFile(file)
    if compression == "zstd":
        from zstandard import ZstdDecompressor

        return ZstdDecompressor(max_window_size=MAX_PART).stream_reader(file)
    raise ValueError(f"is compressed by {compression!r}, expected one of bz2, lz4, zstd")
