"""Streams of bytes with a bounded queue of whole frames; a lost stream is reopened."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable
from typing import Final

from cosim.mavlink.channels.channel import CHUNK_SIZE

QUEUE_SIZE = 1 << 16  # bytes, default limit of a queue
_WRITE_THRESHOLD = 1 << 12  # bytes in the queue above which `put` writes at once
STALL_TIME = 5.0  # s without progress, after which `flush` reports a stall


class Stream:
    """An open stream that accepts partial writes, with its queue of frames."""

    def __init__(
        self,
        read: Callable[[int], bytes],
        write: Callable[[bytes], int],
        close: Callable[[], None],
        limit: int = QUEUE_SIZE,
    ) -> None:
        self._read, self._write, self._close = read, write, close
        self._limit: Final = limit
        self._queue = bytearray()
        self._stalled_at: float | None = None  # time of the first write without progress
        self.is_open = True
        self.version = self.dropped = 0

    def read(self) -> bytes | None:
        """Return received bytes, or None if there are none; at the end of the stream `is_open` becomes False."""
        try:
            data = self._read(CHUNK_SIZE)
        except (BlockingIOError, InterruptedError):
            return None
        except OSError:
            data = b""
        self.is_open = bool(data)
        return data or None

    def put(self, frame: bytes, frame_v1: bytes | None = None) -> bool:
        """Queue a frame, or `frame_v1` for MAVLink 1; return False if the queue was full or the stream has broken."""
        queued = frame_v1 if self.version == 1 else frame
        if queued is None:
            return True
        if len(self._queue) > _WRITE_THRESHOLD and self._stalled_at is None:
            self._write_available()
        if not self.is_open:
            return False
        if len(self._queue) + len(queued) > self._limit:
            self.dropped += 1
            return False
        self._queue += queued
        return True

    def flush(self, now: float) -> bool:
        """Write as much of the queue as possible; return False after 5 s without progress."""
        if not self._queue or self._write_available():
            self._stalled_at = None
        elif self._stalled_at is None:
            self._stalled_at = now
        return self._stalled_at is None or now - self._stalled_at < STALL_TIME

    def _write_available(self) -> bool:
        """Write as much as the stream accepts; return True if that was anything."""
        try:
            written = self._write(bytes(self._queue))
        except (BlockingIOError, InterruptedError):
            return False
        except OSError:
            self.is_open = False
            return True
        del self._queue[:written]
        return written > 0

    def close(self) -> None:
        """Close the stream."""
        self.is_open = False
        self._close()


class StreamChannel:
    """Base of the channels that carry streams."""

    datagrams = False

    def __init__(self) -> None:
        self.losses: dict[str, int] = Counter()

    def record_version(self, peer: Hashable, version: int) -> None:
        """Record the MAVLink version of a peer; frames are sent to peers even if they never send."""
        assert isinstance(peer, Stream)
        peer.version = max(peer.version, version)

    def _close(self, stream: Stream, reason: str) -> None:
        """Close a stream, and count the frames that it dropped."""
        if stream.dropped:
            self.losses[f"frames dropped {reason}"] += stream.dropped
        stream.close()


class SinglePeer(StreamChannel):
    """A channel to one peer, by a stream that is reopened after a loss."""

    def __init__(self, stream: Stream | None, peer: str, slow: str) -> None:
        super().__init__()
        self._stream = stream
        self._peer_name, self._slow = peer, slow

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return the peer and bytes from it, or None if there are none."""
        stream = self._stream
        data = None if stream is None else stream.read()
        return None if data is None else (stream, data)

    def send(self, frame: bytes, frame_v1: bytes | None = None) -> bool:
        """Queue a frame for the peer; return False if it is absent or the queue is full."""
        if self._stream is None:
            self.losses[f"frames dropped while there was no {self._peer_name}"] += 1
            return False
        return self._stream.put(frame, frame_v1)

    def close(self) -> None:
        """Write what can be written without blocking, and close the stream."""
        if self._stream is not None:
            self._stream.flush(0.0)
            self._drop(self._stream)

    def _drop(self, stream: Stream) -> None:
        self._close(stream, self._slow)
        self._stream = None
