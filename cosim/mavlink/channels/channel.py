"""The protocol of a channel, which carries the frames of a link."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Protocol

CHUNK_SIZE = 512  # bytes of a stream per read: bounds the parsing time of hostile input far below 1 ms
DATAGRAM_SIZE = 2048  # bytes read of a datagram; the longest frame has 280


class Channel(Protocol):
    """Carry bytes to and from peers; no method blocks or raises."""

    # Input is polled by the thread every few milliseconds, which takes less time from the stepper than an interruption
    # for each packet.

    datagrams: bool  # true if each `receive` returns a whole packet, False for some bytes of a stream
    losses: dict[str, int]  # count of each kind of failure, by a text for the user

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a peer and bytes from it, or None if there are none."""
        # The peer of a stream can be weakly referenced; after a reconnection it is another object.
        ...

    def record_version(self, peer: Hashable, version: int) -> None:
        """Record that an accepted frame of MAVLink 1 or 2 was received from `peer`."""
        # A peer that has sent only MAVLink 1 is answered in MAVLink 1.
        ...

    def send(self, frame: bytes, frame_v1: bytes | None = None) -> bool:
        """Queue a frame for all peers until the next `poll`; return False if a queue was full."""
        # Peers that are answered in MAVLink 1 get `frame_v1`, the same message in that version, or nothing if it is
        # None.
        ...

    def poll(self, now: float) -> None:
        """Send queued frames, accept and drop peers, and reopen, at monotonic time `now` [s]."""
        # The thread calls it after each slice of work.
        ...

    def close(self) -> None:
        """Write what can be written without blocking, and close."""
        ...
