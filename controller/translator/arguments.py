"""Arguments of translated functions as words of eight bytes, in the order of their C structs."""

from __future__ import annotations

import operator
import struct
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBER = struct.Struct("=d")


def words_of(arguments: tuple[Any, ...]) -> NDArray[np.uint64]:
    """Return what arguments are made of.

    Parameters
    ----------
    arguments : tuple
        Numbers, C-contiguous arrays, and tuples of such. Arrays must outlast the words: these hold their addresses.

    Returns
    -------
    ndarray, shape (n,)
        A number is one word; an array is its address and its shape.
    """
    return np.array(list_of_words(arguments), dtype=np.uint64)


def list_of_words(value: Any) -> list[int]:
    """Return the words of one argument."""
    if isinstance(value, np.ndarray):
        return [value.ctypes.data, *value.shape]
    if isinstance(value, tuple):
        return [word for item in value for word in list_of_words(item)]
    if isinstance(value, float):
        return [int.from_bytes(_NUMBER.pack(value), sys.byteorder)]
    return [operator.index(value) % 2**64]
