"""The MAVLink dialect of this package."""

from __future__ import annotations

from collections.abc import Mapping
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


def make_command(mavlink: Any, system: int, number: int, *parameters: float) -> Any:
    """Return a COMMAND_LONG to a system's autopilot; parameters that are not given are 0."""
    return mavlink.MAVLink_command_long_message(system, 1, number, 0, *parameters, *[0.0] * (7 - len(parameters)))


def make_rate_requests(mavlink: Any, system: int, rates: Mapping[str, float]) -> list[Any]:
    """Return the commands that request messages, by name, from a system's autopilot; rates [Hz]."""
    ids = (getattr(mavlink, f"MAVLINK_MSG_ID_{name}") for name in rates)
    number = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
    return [make_command(mavlink, system, number, i, 1e6 / rate) for i, rate in zip(ids, rates.values(), strict=True)]
