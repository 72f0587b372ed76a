"""Arguments of translated functions as words of eight bytes, in the order of their C structs."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray


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
    return np.array(list(_words(arguments)), dtype=np.uint64)


def _words(value: Any) -> Iterator[int]:
    if isinstance(value, tuple):
        for item in value:
            yield from _words(item)
    elif isinstance(value, np.ndarray):
        yield value.ctypes.data
        yield from value.shape
    elif isinstance(value, float):
        yield int(np.float64(value).view(np.uint64))
    else:
        yield operator.index(value) % 2**64
