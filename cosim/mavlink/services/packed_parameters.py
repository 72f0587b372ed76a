"""The packed parameter file of ArduPilot, ``@PARAM/param.pck``, and the hash of a list for PX4's stations."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence

_MAGIC = 0x671B
_FLOAT = 4  # AP_PARAM_FLOAT
_MAX_SHARED = 15  # maximum number of characters that a name shares with the previous one
_ALL_ONES = 0xFFFFFFFF


def pack_parameters(parameters: Sequence[tuple[str, float]], total: int) -> bytes:
    """Encode parameters as a packed file."""
    # Each has its type, the lengths of the prefix shared with the previous name and of the rest, the rest of the name,
    # and its value, little-endian. A header has a magic number, their number, and the number of all parameters.
    parts = [struct.pack("<HHH", _MAGIC, len(parameters), total)]
    before = ""
    for name, value in parameters:
        shared = 0
        while shared < min(len(before), len(name) - 1, _MAX_SHARED) and before[shared] == name[shared]:
            shared += 1
        new = name[shared:].encode("ascii")
        parts.append(struct.pack("<BB", _FLOAT, (len(new) - 1) << 4 | shared) + new + struct.pack("<f", value))
        before = name
    return b"".join(parts)


def compute_crc32(data: bytes, state: int = 0) -> int:
    """Return the CRC-32 with initial value 0 and without final inversion, as MAVLink's stations compute it."""
    return zlib.crc32(data, state ^ _ALL_ONES) ^ _ALL_ONES


def hash_parameters(parameters: Mapping[str, float]) -> int:
    """Return the hash of a parameter list: CRC-32 over names and values, in the order of names."""
    state = 0
    for name in sorted(parameters):
        state = compute_crc32(name.encode("ascii"), state)
        state = compute_crc32(struct.pack("<f", parameters[name]), state)
    return state
