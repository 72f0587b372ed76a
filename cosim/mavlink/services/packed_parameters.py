"""The packed parameter file of ArduPilot, ``@PARAM/param.pck``, and the hash by which PX4's stations know a list."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence

_MAGIC = 0x671B
_FLOAT = 4  # AP_PARAM_FLOAT
_SHARED = 15  # characters of a name that can be taken from the one before
_ALL_ONES = 0xFFFFFFFF


def packed(parameters: Sequence[tuple[str, float]], total: int) -> bytes:
    """Return the file of some parameters.

    Each is its type, the lengths of what its name shares with the one before and of what is new, the new part of the
    name, and its value, little-endian; before them a magic number, how many they are, and how many there are.

    Parameters
    ----------
    parameters : sequence of (str, float)
        Names, all different, of up to sixteen characters, and values.
    total : int
        Of all parameters.
    """
    parts = [struct.pack("<HHH", _MAGIC, len(parameters), total)]
    before = ""
    for name, value in parameters:
        shared = 0
        while shared < min(len(before), len(name) - 1, _SHARED) and before[shared] == name[shared]:
            shared += 1
        new = name[shared:].encode("ascii")
        parts.append(struct.pack("<BB", _FLOAT, (len(new) - 1) << 4 | shared) + new + struct.pack("<f", value))
        before = name
    return b"".join(parts)


def bare_crc32(data: bytes, state: int = 0) -> int:
    """Return the CRC-32 that begins with 0 and is not inverted at the end, as MAVLink's stations reckon it."""
    return zlib.crc32(data, state ^ _ALL_ONES) ^ _ALL_ONES


def hash_check(parameters: Mapping[str, float]) -> int:
    """Return the hash of a list: over names and values, in the names' order."""
    state = 0
    for name in sorted(parameters):
        state = bare_crc32(name.encode("ascii"), state)
        state = bare_crc32(struct.pack("<f", parameters[name]), state)
    return state
