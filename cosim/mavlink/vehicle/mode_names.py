"""Names of modes by the heartbeat of any autopilot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_ARDUPILOT, _PX4, _SUBMARINE = 3, 12, 12  # MAV_AUTOPILOT, MAV_AUTOPILOT, MAV_TYPE
_MAIN, _SUB = 16, 24  # bits by which PX4's main mode and sub-mode are shifted

_ARDUSUB = {
    0: "STABILIZE", 1: "ACRO", 2: "ALT_HOLD", 3: "AUTO", 4: "GUIDED", 7: "CIRCLE", 9: "SURFACE", 16: "POSHOLD",
    19: "MANUAL", 20: "MOTOR_DETECT", 21: "SURFTRAK",
}  # fmt: skip
_PX4_MAIN = {
    1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 4: "AUTO", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED",
}  # fmt: skip
_PX4_AUTO = {1: "READY", 2: "TAKEOFF", 3: "LOITER", 4: "MISSION", 5: "RTL", 6: "LAND", 8: "FOLLOW", 9: "PRECLAND"}


def mode_name(heartbeat: Any, names: Mapping[int, str]) -> str:
    """Return the name of a vehicle's mode."""
    number = heartbeat.custom_mode
    if names.get(number):
        return names[number]
    if heartbeat.autopilot == _PX4:
        main, sub = number >> _MAIN & 0xFF, number >> _SUB & 0xFF
        name = _PX4_MAIN.get(main, str(main))
        return f"{name}.{_PX4_AUTO.get(sub, sub)}" if sub else name
    if heartbeat.autopilot == _ARDUPILOT and heartbeat.type == _SUBMARINE:
        return _ARDUSUB.get(number, str(number))
    return str(number)
