"""Streams of bytes with a bounded queue of whole frames; a lost stream is reopened."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from typing import Final

from cosim.mavlink.channels.channel import CHUNK

WAITING = 1 << 16  # bytes, default limit of a queue
_MUCH = 1 << 12  # bytes in the queue above which `put` writes at once
STALL = 5.0  # s without progress, after which `flush` reports a stall


class Outgoing:
    """A queue of frames for a stream that accepts partial writes.

    Parameters
    ----------
    write : callable
        Function that writes bytes and returns the number written; it raises BlockingIOError if it cannot write now,
        another OSError if the other side has closed.
    limit : int
        Greatest number of bytes in the queue. A frame beyond the limit is dropped whole, so the other side never gets
        part of one.

    Attributes
    ----------
    dropped : int
        Number of frames dropped because the queue was full.
    """

    def __init__(self, write: Callable[[bytes], int], limit: int = WAITING) -> None:
        self._write: Final = write
        self._limit: Final = limit
        self._waiting = bytearray()
        self._stalled: float | None = None  # time of the first write without progress
        self.dropped = 0

    def put(self, frame: bytes) -> bool:
        """Queue a frame for the next flush; write at once if the queue is long; return False if it was full.

        Raises
        ------
        OSError
            If the other side has closed.
        """
        if len(self._waiting) > _MUCH and self._stalled is None:
            self._write_some()
        if len(self._waiting) + len(frame) > self._limit:
            self.dropped += 1
            return False
        self._waiting += frame
        return True

    def flush(self, now: float) -> bool:
        """Write as much of the queue as possible; return False after 5 s without progress.

        Raises
        ------
        OSError
            If the other side has closed.
        """
        if not self._waiting or self._write_some():
            self._stalled = None
        elif self._stalled is None:
            self._stalled = now
        return self._stalled is None or now - self._stalled < STALL

    def _write_some(self) -> bool:
        """Write as much as the stream accepts; return True if that was anything."""
        try:
            taken = self._write(bytes(self._waiting))
        except (BlockingIOError, InterruptedError):
            return False
        del self._waiting[:taken]
        return taken > 0


class Stream:
    """An open stream with its queue of frames.

    Parameters
    ----------
    read, write, close : callable
        Calls of the operating system; their arguments are the greatest number of bytes to read, the bytes to
        write, and none.
    limit : int
        Greatest number of bytes in the queue.

    Attributes
    ----------
    outgoing : Outgoing
        The queue of frames.
    open : bool
        False once a read or write has failed.
    version : int
        Greatest version of MAVLink received from the other side; 0 before any.
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
        self.version = 0  # the greatest received; 0 for none yet

    def read(self) -> bytes | None:
        """Return received bytes, or None if there are none; at the end of the stream `open` becomes False."""
        try:
            data = self._read(CHUNK)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError:
            data = b""
        self.open = bool(data)
        return data or None

    def put(self, frame: bytes, old: bytes | None = None) -> bool:
        """Queue a frame, or `old` if the other side sends MAVLink 1; return False if the queue was full."""
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
        """Write queued frames; return False if the other side has stalled."""
        try:
            return self.outgoing.flush(now)
        except OSError:
            self.open = False
            return True

    def close(self) -> None:
        """Close the stream."""
        self.open = False
        self._close()


class OneStream:
    """A channel to one peer, by a stream that is reopened after a loss.

    Parameters
    ----------
    stream : Stream or None
        The first stream, if it is open already.
    gone, slow : str
        Words in the texts about frames that were dropped because the peer was absent (`gone`), or too slow (`slow`).
    """

    datagrams = False

    def __init__(self, stream: Stream | None, gone: str, slow: str) -> None:
        self.trouble: dict[str, int] = Counter()
        self._stream = stream
        self._gone, self._slow = gone, slow

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return the peer and bytes from it, or None if there are none."""
        stream = self._stream
        data = None if stream is None else stream.read()
        return None if data is None else (stream, data)

    def record_version(self, peer: Hashable, version: int) -> None:
        """Record the MAVLink version of the peer."""
        assert isinstance(peer, Stream)
        peer.version = max(peer.version, version)

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Queue a frame for the peer; return False if it is absent or the queue is full."""
        if self._stream is None:
            self.trouble[f"frames dropped while there was no {self._gone}"] += 1
            return False
        return self._stream.put(frame, old)

    def close(self) -> None:
        """Write what can be written without blocking, and close the stream."""
        if self._stream is not None:
            self._stream.flush(0.0)
            self._lose(self._stream)

    def _lose(self, stream: Stream) -> None:
        if stream.outgoing.dropped:
            self.trouble[f"frames dropped {self._slow}"] += stream.outgoing.dropped
        stream.close()
        self._stream = None
