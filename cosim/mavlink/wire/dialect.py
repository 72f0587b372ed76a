"""The MAVLink dialect that everything here speaks."""

from __future__ import annotations

from typing import Any


def dialect() -> Any:
    """Return pymavlink's module of the dialect ``all``, MAVLink 2.

    It is the only one that has the messages of ArduPilot and of modes both. Its import takes a tenth of a second, so it
    waits until somebody speaks MAVLink.
    """
    from pymavlink.dialects.v20 import all as mavlink

    return mavlink
