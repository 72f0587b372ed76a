"""The interface of a link for the protocol: a destination of messages."""

from __future__ import annotations

from typing import Any, Protocol


class MessageSink(Protocol):
    """Send messages; those that cannot be sent are counted, and never raise."""

    name: str  # such as udpout:127.0.0.1:14550

    def has_room(self) -> bool:
        """Return True if messages of low priority may be sent now."""
        ...

    def send(self, message: Any) -> bool:
        """Encode, sign if required, and send a message of the dialect; return False if it was not sent."""
        ...
