"""One link as the protocol sees it: a place to send messages to."""

from __future__ import annotations

from typing import Any, Protocol


class MessageSink(Protocol):
    """Takes messages; what cannot be sent is counted, and never raises."""

    name: str  # such as udpout:127.0.0.1:14550

    def has_room(self) -> bool:
        """Return whether what can wait should go now."""
        ...

    def send(self, message: Any) -> bool:
        """Encode, sign where that is asked for, and send a message of the dialect; return whether it went out."""
        ...
