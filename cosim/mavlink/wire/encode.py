"""Encode numbers as fields of messages, limited to the range of the field."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

_MAX_FLOAT32 = 3.4028234e38
_BITS = {"int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64}

# value of "unknown" where it is not 0, by message and field
UNKNOWN: dict[tuple[str, str], int] = {
    ("GLOBAL_POSITION_INT", "hdg"): 0xFFFF,
    ("GPS_RAW_INT", "cog"): 0xFFFF,
    ("GPS_RAW_INT", "vel"): 0xFFFF,
    ("SYS_STATUS", "voltage_battery"): 0xFFFF,
    ("SYS_STATUS", "current_battery"): -1,
    ("SYS_STATUS", "battery_remaining"): -1,
    ("BATTERY_STATUS", "temperature"): 0x7FFF,
    ("BATTERY_STATUS", "voltages"): 0xFFFF,
    ("BATTERY_STATUS", "current_battery"): -1,
    ("BATTERY_STATUS", "battery_remaining"): -1,
    ("DISTANCE_SENSOR", "current_distance"): 0xFFFF,
    ("OBSTACLE_DISTANCE", "distances"): 0xFFFF,
}

Encode = Callable[[Any], Any]
Fields = tuple[Any, ...]  # values of a message's fields, in the dialect's order; extensions may be left out


def clip_to_float32(x: float) -> float:
    """Limit a number to the range of float32; NaN stays."""
    if -_MAX_FLOAT32 <= x <= _MAX_FLOAT32 or x != x:
        return x
    return math.copysign(_MAX_FLOAT32, x)


def round_finite(x: float) -> int | None:
    """Round a received number to an integer; None if it is not finite, as clients fill unused ones with NaN."""
    return round(x) if math.isfinite(x) else None


def combine_flags(mavlink: Any, prefix: str, names: str) -> int:
    """Combine flags of an enumeration, whose names are given without their prefix."""
    return sum(getattr(mavlink, prefix + name) for name in names.split())


class Encoder:
    """Make messages of a dialect from any numbers."""

    def __init__(self, mavlink: Any) -> None:
        self._classes: dict[str, Any] = {}
        self._fields: dict[str, tuple[Encode, ...]] = {}
        for message in mavlink.mavlink_map.values():
            self._classes[message.msgname] = message
        self.payload_sizes = {message.id: message.unpacker.size for message in self._classes.values()}  # bytes

    def __call__(self, name: str, *values: Any) -> Any:
        """Return the message of a name with these fields, in the dialect's order; extensions may be left out."""
        message_class = self._classes[name]
        fields = self._fields.get(name) or self._make_encoders(name, message_class)
        return message_class(*[encode(value) for encode, value in zip(fields, values, strict=False)])

    def _make_encoders(self, name: str, message_class: Any) -> tuple[Encode, ...]:
        fields = []
        for field, type_name in zip(message_class.fieldnames, message_class.fieldtypes, strict=True):
            length = message_class.array_lengths[message_class.ordered_fieldnames.index(field)]
            encode = _number_encoder(type_name, UNKNOWN.get((name, field), 0))
            if type_name == "char":
                encode = _text_encoder(length)
            elif length:
                encode = _array_encoder(encode, length)
            fields.append(encode)
        self._fields[name] = tuple(fields)
        return self._fields[name]


def _number_encoder(type_name: str, unknown: int) -> Encode:
    if type_name in ("float", "double"):
        return clip_to_float32
    unsigned = type_name.startswith("u")
    bits = _BITS.get(type_name.removeprefix("u"), 8)
    low, high = (0, 2**bits - 1) if unsigned else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)

    def encode(x: Any) -> int:
        if low <= x <= high:
            return round(x)  # type: ignore[no-any-return]
        return unknown if x != x else low if x < low else high

    return encode


def _text_encoder(length: int) -> Encode:
    return lambda x: (x if isinstance(x, bytes) else x.encode("ascii", "replace"))[:length]


def _array_encoder(encode: Encode, length: int) -> Encode:
    def encode_array(values: Sequence[Any]) -> list[Any]:
        numbers = [encode(x) for x in values[:length]]
        return numbers + [encode(0)] * (length - len(numbers))

    return encode_array
