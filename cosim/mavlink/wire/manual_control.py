"""Decode the sticks of MANUAL_CONTROL."""

from __future__ import annotations

from typing import Any

_FULL, _INVALID = 1000.0, 0x7FFF  # value of a full stick; of an unused one
_PITCH, _ROLL = 1, 2  # bits of enabled_extensions


def decode_sticks(message: Any, center: float, full_tilt: float) -> tuple[float, float, float, float, float, float]:
    """Return the sticks X Y Z K M N, -1 to 1, by the values of a throttle at rest and of full roll and pitch."""
    # The vertical stick is positive up, Z is positive down.
    up = 0.0 if message.z == _INVALID else clip_stick((message.z - center) / (_FULL - center))
    roll = _axis(message.t, full_tilt) if message.enabled_extensions & _ROLL else 0.0
    pitch = _axis(message.s, full_tilt) if message.enabled_extensions & _PITCH else 0.0
    return _axis(message.x, _FULL), _axis(message.y, _FULL), -up + 0.0, roll, pitch, _axis(message.r, _FULL)


def clip_stick(value: float) -> float:
    """Limit a stick to -1 and 1."""
    return max(-1.0, min(1.0, value))


def _axis(value: int, full: float) -> float:
    return 0.0 if value == _INVALID else clip_stick(value / full)
