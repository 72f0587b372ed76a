"""The field ``thrust_body`` of SET_ATTITUDE_TARGET, an extension of MAVLink 2 that pymavlink's dialects lack."""

from __future__ import annotations

import struct
from typing import Any

THRUST_BODY_SET = 1 << 5  # type_mask

_FIELD = struct.Struct("<3f")
_OFFSET = 39  #  offset of the field in the payload
_HEADER_SIZE = 10  # bytes of a header of MAVLink 2


def make_attitude_target(mavlink: Any, *fields: Any, thrust_body: tuple[float, float, float]) -> Any:
    """Return SET_ATTITUDE_TARGET with a thrust along each body axis [-]."""
    message = mavlink.MAVLink_set_attitude_target_message(*fields)
    pack_message = message.pack

    def pack(mav: Any, force_mavlink1: bool = False) -> Any:
        frame, extension = message._pack, b"" if force_mavlink1 else _FIELD.pack(*thrust_body)
        message._pack = lambda mav, crc, payload, **options: frame(mav, crc, payload + extension, **options)
        try:
            return pack_message(mav, force_mavlink1)
        finally:
            message._pack = frame

    message.pack = pack
    return message


def get_thrust_body(message: Any) -> tuple[float, float, float]:
    """Return the thrust along each body axis [-] of a received SET_ATTITUDE_TARGET; 0 where the field is missing."""
    frame = bytes(message.get_msgbuf() or b"")
    payload = frame[_HEADER_SIZE : _HEADER_SIZE + frame[1]] if len(frame) > _HEADER_SIZE else b""
    ahead, right, down = _FIELD.unpack(payload[_OFFSET : _OFFSET + _FIELD.size].ljust(_FIELD.size, b"\0"))
    return ahead, right, down
