"""What a link needs of whatever carries its frames."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Protocol

CHUNK = 512  # bytes read of a stream at once: what a hostile peer can make one look at cost stays far below 1 ms
DATAGRAM = 2048  # bytes of a datagram that are looked at; the greatest frame has 280


class Channel(Protocol):
    """Carries bytes to its peers and from them, without ever waiting, and without raising.

    Nobody is told when something has come: the thread looks every few milliseconds, which costs the stepper less than
    being interrupted for each packet.

    Attributes
    ----------
    datagrams : bool
        Each `receive` yields a whole packet, else some bytes of a stream.
    trouble : dict of str to int
        What went wrong, and how often, in words for the user.
    """

    datagrams: bool
    trouble: dict[str, int]

    def receive(self) -> tuple[Hashable, bytes] | None:
        """Return a peer and bytes of it, None if nothing is there.

        The peer of a stream can be weakly referenced, and one that comes again is another.
        """
        ...

    def heard(self, peer: Hashable, version: int) -> None:
        """Hear that what came from `peer` is a frame that is accepted, of MAVLink 1 or 2.

        A peer that has spoken MAVLink 1 alone is answered in it.
        """
        ...

    def send(self, frame: bytes, old: bytes | None = None) -> bool:
        """Take a frame to be sent to all peers when it is tended; return whether there was room for all of them.

        Peers that are answered in MAVLink 1 get `old` instead, which is the same in that version, or nothing for None.
        """
        ...

    def tend(self, now: float) -> None:
        """Do what is due at monotonic time `now` [s]: send what was taken, accept and drop peers, reopen.

        Called at the end of each turn of the thread.
        """
        ...

    def close(self) -> None:
        """Give everything back, having written what can be written at once."""
        ...
