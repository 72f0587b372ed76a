"""Encode numbers as fields of messages, limited to the range of the field."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

_GREATEST_FLOAT = 3.4028234e38  # greatest float32
_BITS = {"int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64}

# value of "unknown" where it is not 0, by message and field
_UNKNOWN: dict[tuple[str, str], int] = {
    ("GLOBAL_POSITION_INT", "hdg"): 0xFFFF,
    ("GPS_RAW_INT", "cog"): 0xFFFF,
    ("GPS_RAW_INT", "vel"): 0xFFFF,
    ("SYS_STATUS", "voltage_battery"): 0xFFFF,
    ("SYS_STATUS", "current_battery"): -1,
    ("SYS_STATUS", "battery_remaining"): -1,
    ("BATTERY_STATUS", "temperature"): 0x7FFF,
    ("DISTANCE_SENSOR", "current_distance"): 0xFFFF,
    ("OBSTACLE_DISTANCE", "distances"): 0xFFFF,
}

Encode = Callable[[Any], Any]


def float32(x: float) -> float:
    """Limit a number to the range of float32; NaN stays."""
    if -_GREATEST_FLOAT <= x <= _GREATEST_FLOAT or x != x:
        return x
    return math.copysign(_GREATEST_FLOAT, x)


def whole(x: float) -> int | None:
    """Round a received number to an integer; None if it is not finite, as clients fill unused ones with NaN."""
    return round(x) if math.isfinite(x) else None


def wrap_time(microseconds: int, per_unit: int = 1000) -> int:
    """Convert a time since boot to units of `per_unit` microseconds, modulo 2**32."""
    return microseconds // per_unit & 0xFFFFFFFF


class Encoder:
    """Make messages of a dialect from any numbers.

    Parameters
    ----------
    mavlink : module
        Dialect of pymavlink.
    """

    def __init__(self, mavlink: Any) -> None:
        self._classes: dict[str, Any] = {}
        self._fields: dict[str, tuple[Encode, ...]] = {}
        for kind in mavlink.mavlink_map.values():
            self._classes[kind.msgname] = kind
        self.size_of = {kind.id: kind.unpacker.size for kind in self._classes.values()}  # bytes of payload

    def __call__(self, name: str, *values: Any) -> Any:
        """Return the message of a name with these fields, in the dialect's order; extensions may be left out."""
        kind = self._classes[name]
        fields = self._fields.get(name) or self._field_encoders(name, kind)
        return kind(*[encode(value) for encode, value in zip(fields, values, strict=False)])

    def _field_encoders(self, name: str, kind: Any) -> tuple[Encode, ...]:
        fields = []
        for field, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True):
            length = kind.array_lengths[kind.ordered_fieldnames.index(field)]
            one = _field(type_name, _UNKNOWN.get((name, field), 0))
            if type_name == "char":
                fields.append(_text(length))
            else:
                fields.append(_array(one, length) if length else one)
        self._fields[name] = tuple(fields)
        return self._fields[name]


def _field(type_name: str, unknown: int) -> Encode:
    if type_name in ("float", "double"):
        return float32
    unsigned = type_name.startswith("u")
    bits = _BITS.get(type_name.removeprefix("u"), 8)
    least, greatest = (0, 2**bits - 1) if unsigned else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)

    def integer(x: Any) -> int:
        if least <= x <= greatest:
            whole_number: int = round(x)
            return whole_number
        if x != x:
            return unknown
        return least if x < least else greatest

    return integer


def _text(length: int) -> Encode:
    def text(x: Any) -> bytes:
        written: bytes = x if isinstance(x, bytes) else x.encode("ascii", "replace")
        return written[:length]

    return text


def _array(one: Encode, length: int) -> Encode:
    def array(values: Sequence[Any]) -> list[Any]:
        numbers = [one(x) for x in values[:length]]
        return numbers + [one(0)] * (length - len(numbers))

    return array
