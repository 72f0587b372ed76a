"""Frames made by pymavlink."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import all as mavlink


def attitude(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that makes a given number of frames of ATTITUDE."""
    codec = mavlink.MAVLink(None, *setup["source"])
    message = mavlink.MAVLink_attitude_message(*setup["fields"])

    def work(count: int) -> None:
        for _ in range(count):
            message.pack(codec)
            codec.seq = (codec.seq + 1) % 256

    return work
