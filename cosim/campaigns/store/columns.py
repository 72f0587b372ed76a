"""Conversion between columns of a table and arrays or texts."""

# `pyarrow.array` and `to_numpy` do the same, but import pandas if it is installed: a third of a second per worker.

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

_TYPES = {"f": pa.float64(), "i": pa.int64(), "b": pa.bool_()}  # type of a column by NumPy's kind of its values


def of_numbers(values: NDArray[Any], absent: NDArray[np.bool_] | None = None) -> Any:
    """Make a column of numbers or Booleans; values (n,), absent (n,)."""
    facts = values.dtype.kind == "b"
    content = _bits(values) if facts else pa.py_buffer(np.ascontiguousarray(values))
    return pa.Array.from_buffers(_TYPES[values.dtype.kind], len(values), [_presence(absent), content])


def of_texts(texts: Sequence[str | None]) -> Any:
    """Make a column of texts."""
    content = [(text or "").encode() for text in texts]
    ends = np.cumsum([0, *map(len, content)], dtype=np.int32)
    absent = np.array([text is None for text in texts], dtype=bool)
    buffers = [_presence(absent), pa.py_buffer(ends), pa.py_buffer(b"".join(content))]
    return pa.Array.from_buffers(pa.string(), len(content), buffers)


def to_array(column: Any) -> NDArray[Any]:
    """Return the values of a column; returns (n,)."""
    if column.type == pa.string():
        return np.array(column.to_pylist(), dtype=object)
    values = _values(column)
    if column.null_count:
        values = values.astype(np.float64 if column.type == pa.float64() else object)
        values[_values(pc.is_null(column))] = None  # NaN among floats
    return values


def _values(column: Any) -> NDArray[Any]:
    """Return numbers or Booleans, with undefined values for nulls."""
    if column.type == pa.bool_():
        return _values(pc.cast(column, pa.uint8())).view(np.bool_)
    chunks = [
        pa.Array.from_buffers(chunk.type, len(chunk), [None, chunk.buffers()[1]], 0, chunk.offset)
        for chunk in column.chunks
    ]
    nothing = pa.Array.from_buffers(column.type, 0, [None, pa.py_buffer(b"")])  # sets the type of an empty column
    return np.concatenate([np.from_dlpack(chunk) for chunk in (nothing, *chunks)])


def _presence(absent: NDArray[np.bool_] | None) -> Any:
    return _bits(~absent) if absent is not None and absent.any() else None


def _bits(facts: NDArray[np.bool_]) -> Any:
    return pa.py_buffer(np.packbits(facts, bitorder="little"))
