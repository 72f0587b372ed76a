"""What waits to be written to a stream: whole frames, and not too many of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

WAITING = 1 << 16  # bytes
STALL = 5.0  # s without progress, after which the other side is given up


class Outgoing:
    """Frames on their way into a stream that takes what it likes.

    Parameters
    ----------
    write : callable
        Takes bytes and returns how many it took, or raises OSError; BlockingIOError where it can take none now.
    limit : int
        Bytes that may wait. A frame that finds no room is dropped whole, so the other side never sees a torn one.

    Attributes
    ----------
    dropped : int
        Frames that found no room.
    """

    def __init__(self, write: Callable[[bytes], int], limit: int = WAITING) -> None:
        self._write: Final = write
        self._limit: Final = limit
        self._waiting = bytearray()
        self._stalled: float | None = None  # since when nothing was taken
        self.dropped = 0

    def put(self, frame: bytes) -> bool:
        """Take a frame; return whether there was room.

        Raises
        ------
        OSError
            If the other side has gone.
        """
        if not self._waiting:
            taken = self._try(frame)
            self._waiting += frame[taken:]
            return True
        if len(self._waiting) + len(frame) > self._limit:
            self.dropped += 1
            return False
        self._waiting += frame
        return True

    def flush(self, now: float) -> bool:
        """Write what waits, as far as it is taken; return False if nothing was taken for too long.

        Raises
        ------
        OSError
            If the other side has gone.
        """
        taken = self._try(bytes(self._waiting)) if self._waiting else 0
        del self._waiting[:taken]
        if taken or not self._waiting:
            self._stalled = None
        elif self._stalled is None:
            self._stalled = now
        return self._stalled is None or now - self._stalled < STALL

    def _try(self, data: bytes) -> int:
        try:
            return self._write(data)
        except (BlockingIOError, InterruptedError):
            return 0
