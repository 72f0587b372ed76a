"""Streams of bytes: whole frames wait to be written, and not too many of them; what was lost is opened anew."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from typing import Final

from cosim.mavlink.channels.channel import CHUNK

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


class Stream:
    """An open stream, with the frames that wait for it.

    Parameters
    ----------
    read, write, close : callable
        Of the operating system: takes how many bytes to read at most, what to write, and nothing.
    limit : int
        Bytes that may wait.

    Attributes
    ----------
    outgoing : Outgoing
        The frames that wait.
    open : bool
        Whether the other side was there when it was last spoken to.
    version : int
        Greatest version of MAVLink that came from there; 0 before any did.
    """

    def __init__(
        self,
        read: Callable[[int], bytes],
        write: Callable[[bytes], int],
        close: Callable[[], None],
        limit: int = WAITING,
    ) -> None:
        self._read, self._close = read, close
        self.outgoing = Outgoing(write, limit)
        self.open = True
        self.version = 0  # the greatest that the other side has spoken; 0 for none yet

    def read(self) -> bytes | None:
        """Return what has come, None if nothing has; `open` tells whether more can come."""
        try:
            data = self._read(CHUNK)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError:
            data = b""
        self.open = bool(data)
        return data or None

    def put(self, frame: bytes, old: bytes | None = None) -> bool:
        """Take a frame for the other side, `old` if it speaks MAVLink 1; return whether there was room."""
        if self.version == 1:
            if old is None:
                return True
            frame = old
        try:
            return self.outgoing.put(frame)
        except OSError:
            self.open = False
            return False

    def flush(self, now: float) -> bool:
        """Write what waits; return whether the other side takes something now and then."""
        try:
            return self.outgoing.flush(now)
        except OSError:
            self.open = False
            return True

    def close(self) -> None:
        """Give it back."""
        self.open = False
        self._close()


class OneStream:
    """A channel to one peer, by a stream that is opened anew when it was lost.

    Parameters
    ----------
    stream : Stream or None
        The first one, if there is one already.
    gone, slow : str
        Who was not there, or took too little, when frames were dropped.
    """

    datagrams = False

    def __init__(self, stream: Stream | None, gone: str, slow: str) -> None:
        self.trouble: dict[str, int] = Counter()
        self._stream = stream
        self._gone, self._slow = gone, slow

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return bytes of the other side."""
        stream = self._stream
        data = None if stream is None else stream.read()
        return None if data is None else (stream, data)

    def heard(self, peer: Hashable, version: int) -> None:
        """Note which version the peer speaks."""
        assert isinstance(peer, Stream)
        peer.version = max(peer.version, version)

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Send to the other side, if it is there."""
        if self._stream is None:
            self.trouble[f"frames dropped while there was no {self._gone}"] += 1
            return False
        return self._stream.put(frame, old)

    def close(self) -> None:
        """Close the stream, having written what can be written at once."""
        if self._stream is not None:
            self._stream.flush(0.0)
            self._lose(self._stream)

    def _lose(self, stream: Stream) -> None:
        if stream.outgoing.dropped:
            self.trouble[f"frames dropped {self._slow}"] += stream.outgoing.dropped
        stream.close()
        self._stream = None
