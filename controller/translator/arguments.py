"""Convert arguments of translated functions to words of eight bytes, in the order of their C structs."""

from __future__ import annotations

import operator
import struct
import sys
from typing import Any

import numpy as np

_NUMBER = struct.Struct("=d")


def argument_words(value: Any) -> list[int]:
    """Return the words of one argument: one for a number, address and shape for an array."""
    if isinstance(value, np.ndarray):
        return [value.ctypes.data, *value.shape]
    if isinstance(value, tuple):
        return [word for item in value for word in argument_words(item)]
    if isinstance(value, float):
        return [int.from_bytes(_NUMBER.pack(value), sys.byteorder)]
    return [operator.index(value) % 2**64]
