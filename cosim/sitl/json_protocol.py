"""Wire format of ArduPilot's JSON backend: servo packets in, a line of JSON out."""

# The autopilot searches the line for the bare key, and parses the number two characters behind its first occurrence. So
# there is no blank after a colon, and no key contains the name of a later one.

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

from cosim.errors import RunError
from cosim.sitl.motion import Motion

MAX_SIZE = 72  # bytes of a servo packet

_PACKINGS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
_PACKINGS_BY_SIZE = {packing.size: (magic, packing) for magic, packing in _PACKINGS.items()}


@dataclass(frozen=True, slots=True)
class ServoPacket:
    """One frame of the autopilot."""

    frame_rate: int  # Hz
    frame_count: int  # frames that the autopilot has received since it started
    pwm: tuple[int, ...]  # us, 16 or 32 servo outputs, 0 without a pulse


def parse_packet(data: bytes) -> ServoPacket | None:
    """Parse a servo packet."""
    magic, packing = _PACKINGS_BY_SIZE.get(len(data), (0, None))
    if packing is None:
        return None
    received, frame_rate, frame_count, *pwm = packing.unpack(data)
    return ServoPacket(frame_rate, frame_count, tuple(pwm)) if received == magic else None


def format_motion(motion: Motion) -> bytes:
    """Format the plant's state for the autopilot."""
    t, (p, q, r), (fx, fy, fz), (x, y, z), (vx, vy, vz), (roll, pitch, yaw), (e0, e1, e2, e3), altitude, _ = motion
    total = t + p + q + r + fx + fy + fz + x + y + z + vx + vy + vz + roll + pitch + yaw + e0 + e1 + e2 + e3
    if not math.isfinite(total + (altitude or 0.0)):
        raise RunError(f"t = {t:g} s: the vehicle's state is not finite: {motion}")
    below = "" if altitude is None else f',"rng_1":{altitude!r}'
    return (
        f'\n{{"timestamp":{t!r},"imu":{{"gyro":[{p!r},{q!r},{r!r}],"accel_body":[{fx!r},{fy!r},{fz!r}]}},'
        f'"position":[{x!r},{y!r},{z!r}],"velocity":[{vx!r},{vy!r},{vz!r}],'
        f'"attitude":[{roll!r},{pitch!r},{yaw!r}],"quaternion":[{e0!r},{e1!r},{e2!r},{e3!r}]{below}}}\n'
    ).encode("ascii")
