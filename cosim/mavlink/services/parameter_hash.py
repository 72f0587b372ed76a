"""The hash of a parameter list, by which PX4's stations recognize one that they have."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping

_ALL_ONES = 0xFFFFFFFF


def hash_parameters(parameters: Mapping[str, float]) -> int:
    """Return the CRC-32, without initial and final inversion, over names and values in the order of names."""
    data = b"".join(name.encode("ascii") + struct.pack("<f", parameters[name]) for name in sorted(parameters))
    return zlib.crc32(data, _ALL_ONES) ^ _ALL_ONES
