"""The main values of a message, in a line."""

from __future__ import annotations

import math
from itertools import groupby
from typing import Any

from cosim.mavlink.listening.telemetry_table import printable
from cosim.mavlink.wire.encode import UNKNOWN

_MAX_FIELDS = 8  # fields shown of a message without an entry below
_MAX_NUMBERS = 8  # numbers shown of an array

# main fields of messages; several of one unit are shown without their names
_MAIN_FIELDS = {
    "ATTITUDE": "roll pitch yaw rollspeed pitchspeed yawspeed",
    "ATTITUDE_QUATERNION": "q1 q2 q3 q4",
    "LOCAL_POSITION_NED": "x y z vx vy vz",
    "GLOBAL_POSITION_INT": "lat lon relative_alt hdg",
    "POSITION_TARGET_LOCAL_NED": "x y z vx vy vz",
    "VFR_HUD": "groundspeed climb alt heading throttle",
    "SYS_STATUS": "load voltage_battery current_battery battery_remaining",
    "SCALED_PRESSURE": "press_abs temperature",
    "SCALED_PRESSURE2": "press_abs temperature",
    "HOME_POSITION": "latitude longitude altitude",
    "GPS_RAW_INT": "lat lon fix_type satellites_visible",
    "SYSTEM_TIME": "time_boot_ms",
    "NAV_CONTROLLER_OUTPUT": "nav_bearing wp_dist",
    "SERVO_OUTPUT_RAW": " ".join(f"servo{i}_raw" for i in range(1, 9)),
    "NAMED_VALUE_FLOAT": "value",
    "NAMED_VALUE_INT": "value",
    "DEBUG_VECT": "x y z",
    "COMMAND_ACK": "command result",
    "MISSION_CURRENT": "seq",
    "DISTANCE_SENSOR": "current_distance",
}
# shown unit, factor and digits of a main field, by the unit of the dialect
_UNITS = {
    "rad": ("deg", 180.0 / math.pi, 1), "rad/s": ("deg/s", 180.0 / math.pi, 1), "degE7": ("deg", 1e-7, 6),
    "cdeg": ("deg", 1e-2, 1), "mm": ("m", 1e-3, 2), "cm": ("m", 1e-2, 2), "cm/s": ("m/s", 1e-2, 2),
    "ms": ("s", 1e-3, 2), "mV": ("V", 1e-3, 2), "cA": ("A", 1e-2, 2), "d%": ("%", 0.1, 1), "cdegC": ("degC", 1e-2, 1),
}  # fmt: skip
_CLOCKS = ("time_boot_ms", "time_usec", "time_unix_usec")


def format_values(message: Any) -> str:
    """Format the main values of a message, those of one unit together."""
    if message.get_type() == "STATUSTEXT":
        return printable(message.text)
    units: dict[str, str] = message.fieldunits_by_name
    main = _MAIN_FIELDS.get(message.get_type(), "").split()
    names = main or [name for name in message.get_fieldnames() if name not in _CLOCKS][:_MAX_FIELDS]
    groups = []
    for unit, members in groupby(names, lambda name: units.get(name, "")):
        named = list(members)
        shown, factor, digits = _UNITS.get(unit, (unit, 1, 2 if unit else 4))
        form = f"z.{digits}f" if main or unit == "degE7" else "z.6g"
        values = [_format(message, name, factor, form) for name in named]
        if len(named) == 1 or not main:
            values = [f"{name} {value}" for name, value in zip(named, values, strict=True)]
        groups.append(f"{' '.join(values)} {shown}".rstrip())
    return printable("  ".join(groups))


def _format(message: Any, name: str, factor: float, form: str) -> str:
    """Format a field: a number, a text, or the first numbers of an array; "-" for each that is not known."""
    value, unknown = getattr(message, name), UNKNOWN.get((message.get_type(), name))

    def format_one(x: Any) -> str:
        if x == unknown:
            return "-"
        scaled = x if isinstance(x, str) else x * factor
        return f"{scaled:{form}}" if isinstance(scaled, float) else str(scaled)

    if not isinstance(value, list | tuple):
        return format_one(value)
    more = " ..." if len(value) > _MAX_NUMBERS else ""
    return f"[{' '.join(map(format_one, value[:_MAX_NUMBERS]))}{more}]"
