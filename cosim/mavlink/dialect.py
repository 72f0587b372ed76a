"""The MAVLink dialect that everything here speaks."""

from __future__ import annotations

from typing import Any

from cosim.errors import TelemetryError


def dialect() -> Any:
    """Return pymavlink's module of the dialect ``all``, MAVLink 2.

    It is the only one that has the messages of ArduPilot and of modes both.

    Raises
    ------
    TelemetryError
        If pymavlink is not installed.
    """
    try:
        from pymavlink.dialects.v20 import all as mavlink
    except ImportError as error:
        raise TelemetryError("MAVLink needs pymavlink; pip install 'subreach[mavlink]'") from error
    return mavlink
