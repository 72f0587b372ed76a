"""The main values of a message, in a line."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from cosim.mavlink.listening.telemetry_table import printable

_DEG = 180.0 / math.pi
_MAX_FIELDS = 8  # fields shown of a message without an entry below
_MAX_NUMBERS = 8  # numbers shown of an array


class _Group(NamedTuple):
    """Fields that share a unit."""

    names: tuple[str, ...]
    factor: float
    digits: int
    unit: str
    unknown: int | None  # value of an unknown field


def _group(names: str, factor: float = 1.0, digits: int = 2, unit: str = "", unknown: int | None = None) -> _Group:
    return _Group(tuple(names.split()), factor, digits, unit, unknown)


_FORMATS = {
    "ATTITUDE": (_group("roll pitch yaw", _DEG, 1, "deg"), _group("rollspeed pitchspeed yawspeed", _DEG, 1, "deg/s")),
    "ATTITUDE_QUATERNION": (_group("q1 q2 q3 q4", digits=3),),
    "LOCAL_POSITION_NED": (_group("x y z", unit="m"), _group("vx vy vz", unit="m/s")),
    "GLOBAL_POSITION_INT": (
        _group("lat lon", 1e-7, 6, "deg"),
        _group("relative_alt", 1e-3, unit="m"),
        _group("hdg", 1e-2, 1, "deg", 65535),
    ),
    "POSITION_TARGET_LOCAL_NED": (_group("x y z", unit="m"), _group("vx vy vz", unit="m/s")),
    "VFR_HUD": (
        _group("groundspeed climb", unit="m/s"),
        _group("alt", unit="m"),
        _group("heading", digits=0, unit="deg"),
        _group("throttle", digits=0, unit="%"),
    ),
    "SYS_STATUS": (
        _group("load", 0.1, 1, "%"),
        _group("voltage_battery", 1e-3, 2, "V", 65535),
        _group("current_battery", 1e-2, 2, "A", -1),
        _group("battery_remaining", digits=0, unit="%", unknown=-1),
    ),
    "SCALED_PRESSURE": (_group("press_abs", unit="hPa"), _group("temperature", 1e-2, 1, "degC")),
    "SCALED_PRESSURE2": (_group("press_abs", unit="hPa"), _group("temperature", 1e-2, 1, "degC")),
    "HOME_POSITION": (_group("latitude longitude", 1e-7, 6, "deg"), _group("altitude", 1e-3, unit="m")),
    "GPS_RAW_INT": (_group("lat lon", 1e-7, 6, "deg"), _group("fix_type satellites_visible", digits=0)),
    "SYSTEM_TIME": (_group("time_boot_ms", 1e-3, 2, "s"),),
    "NAV_CONTROLLER_OUTPUT": (_group("nav_bearing", digits=0, unit="deg"), _group("wp_dist", digits=0, unit="m")),
    "SERVO_OUTPUT_RAW": (_group(" ".join(f"servo{i}_raw" for i in range(1, 9)), digits=0, unit="us"),),
    "NAMED_VALUE_FLOAT": (_group("value", digits=4),),
    "NAMED_VALUE_INT": (_group("value", digits=0),),
    "DEBUG_VECT": (_group("x y z", digits=4),),
    "COMMAND_ACK": (_group("command result", digits=0),),
    "MISSION_CURRENT": (_group("seq", digits=0),),
    "DISTANCE_SENSOR": (_group("current_distance", 1e-2, unit="m"),),
}
_CLOCKS = ("time_boot_ms", "time_usec", "time_unix_usec")


def format_values(message: Any) -> str:
    """Format the main values of a message."""
    groups = _FORMATS.get(message.get_type())
    if groups is not None:
        return "  ".join(_format_group(message, group) for group in groups)
    if message.get_type() == "STATUSTEXT":
        return printable(message.text)
    names = [name for name in message.get_fieldnames() if name not in _CLOCKS]
    return "  ".join(f"{name} {_format_plain(getattr(message, name))}" for name in names[:_MAX_FIELDS])


def _format_group(message: Any, group: _Group) -> str:
    values = [getattr(message, name) for name in group.names]
    numbers = " ".join("-" if x == group.unknown else f"{x * group.factor:z.{group.digits}f}" for x in values)
    if len(group.names) == 1:
        numbers = f"{group.names[0]} {numbers}"
    return f"{numbers} {group.unit}".rstrip()


def _format_plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:z.4g}"
    if isinstance(value, list | tuple):
        more = " ..." if len(value) > _MAX_NUMBERS else ""
        return f"[{' '.join(_format_plain(x) for x in value[:_MAX_NUMBERS])}{more}]"
    return printable(value)
