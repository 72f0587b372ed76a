"""The MAVLink dialect of this package."""

from __future__ import annotations

from typing import Any


def dialect() -> Any:
    """Return pymavlink's module of the dialect ``all``, MAVLink 2."""
    # It is the only dialect with both the messages of ArduPilot and those of modes. It is imported at the first call,
    # since the import takes 0.1 s.
    from pymavlink.dialects.v20 import all as mavlink

    return mavlink


def make_heartbeat(mavlink: Any, kind: int, state: int) -> Any:
    """Return the heartbeat of a system that is no vehicle; kind is its MAV_TYPE, state its MAV_STATE."""
    return mavlink.MAVLink_heartbeat_message(kind, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, state, 3)
