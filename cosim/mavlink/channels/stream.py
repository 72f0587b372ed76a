"""What waits to be written to a stream: whole frames, and not too many of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

WAITING = 1 << 16  # bytes
_MUCH = 1 << 12  # bytes, that need not wait for a flush
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
        """Take a frame to be written at the next flush, or when there is much; return whether there was room.

        Raises
        ------
        OSError
            If the other side has gone.
        """
        if len(self._waiting) > _MUCH and self._stalled is None:
            self._write_some()
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
        if not self._waiting or self._write_some():
            self._stalled = None
        elif self._stalled is None:
            self._stalled = now
        return self._stalled is None or now - self._stalled < STALL

    def _write_some(self) -> bool:
        """Write what is taken; return whether anything was."""
        try:
            taken = self._write(bytes(self._waiting))
        except (BlockingIOError, InterruptedError):
            return False
        del self._waiting[:taken]
        return taken > 0
