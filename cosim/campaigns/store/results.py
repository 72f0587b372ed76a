"""The joined rows of a campaign."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from cosim.errors import RunError
from cosim.simulation.signals import Array

_MAX_NUMBER = 1e100  # maximum size of a number, whose powers are still finite
_CHUNK = 1000  # number of rows that are read at once
# name, type, unit, description and nulls of a column that older results lack
_MISSION = "First times within the goal at each of its places, as JSON; null: of a goal with one place"
ARRIVALS = ("arrivals", pa.string(), "s", _MISSION, True)


class Results:
    """The rows of a campaign in a file, whose columns are read at each use."""

    def __init__(self, path: Path, schema: Any = None) -> None:
        self.path = path
        with self._readable():
            metadata = pq.read_metadata(path)
            self.schema = metadata.schema.to_arrow_schema()
        if schema is not None and ARRIVALS[0] not in self.schema.names:
            schema = pa.schema([field for field in schema if field.name != ARRIVALS[0]])
        if schema is not None and not self.schema.equals(schema):
            raise RunError(f"{path}: cannot be read: {_difference(self.schema, schema)}")
        self._rows = int(metadata.num_rows)

    def __len__(self) -> int:
        return self._rows

    def __getitem__(self, name: str) -> Any:
        """Return a column, shape (rows,), with NaN or None for null; raise a RunError for numbers beyond statistics."""
        column = to_array(self._read([name])[name])
        if column.dtype == np.float64 and (beyond := np.isfinite(column) & (np.abs(column) > _MAX_NUMBER)).any():
            i = int(np.argmax(beyond))
            raise RunError(
                f"{self.path}: column {name!r} holds {column[i]:g} in row {i}, expected at most {_MAX_NUMBER:g} in size"
            )
        return column

    def number(self, name: str, missing: float = np.nan) -> Array:
        """Return a column of numbers, shape (rows,), with `missing` for null and NaN."""
        column: Array = self[name].astype(float)
        return np.where(np.isnan(column), missing, column)

    def fact(self, name: str) -> NDArray[np.bool_]:
        """Return a column of Booleans, shape (rows,), with False for null."""
        facts: NDArray[np.bool_] = self[name].astype(bool)  # None is false
        return facts

    def is_null(self, name: str) -> NDArray[np.bool_]:
        """Return a mask of the nulls of a column, shape (rows,)."""
        return to_array(pc.is_null(self._read([name])[name]))

    def values(self, name: str) -> Iterator[Any]:
        """Yield the values of a column in order; raise a RunError if it does not exist."""
        with self._readable(), pq.ParquetFile(self.path) as file:
            for batch in file.iter_batches(_CHUNK, columns=[name]):
                yield from batch.column(0).to_pylist()

    def row(self, key: int) -> dict[str, Any] | None:
        """Return the row of a key, None if there is none."""
        with self._readable():
            rows = pq.read_table(self.path, filters=[(self.schema.names[0], "=", key)]).to_pylist()
        return dict(rows[0]) if rows else None

    @property
    def table(self) -> Any:
        """All rows, a pyarrow.Table."""
        return self._read()

    def _read(self, names: list[str] | None = None) -> Any:
        with self._readable(), pq.ParquetFile(self.path) as file:
            return file.read(names)

    @contextlib.contextmanager
    def _readable(self) -> Iterator[None]:
        try:
            yield
        except (OSError, pa.ArrowException, UnicodeDecodeError) as error:
            raise RunError(f"{self.path}: cannot be read: {error}") from error


def make_schema(columns: Any) -> Any:
    """Make a schema of columns, each a name, an Arrow type, a unit, a description, and whether it has nulls."""
    return pa.schema(
        [
            pa.field(name, kind, nullable=nullable, metadata={"unit": unit, "description": description})
            for name, kind, unit, description, nullable in columns
        ]
    )


def make_table(schema: Any, columns: Iterable[Sequence[Any] | NDArray[Any]]) -> Any:
    """Make a table of columns, shape (n,); None and NaN are null."""
    arrays = [to_column(field.type, values) for field, values in zip(schema, columns, strict=True)]
    return pa.Table.from_arrays(arrays, schema=schema)


def to_array(column: Any) -> NDArray[Any]:
    """Return the values of a column, shape (n,), with NaN or None for null; not `to_numpy`, which imports pandas."""
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if array.type == pa.string() or (array.type == pa.bool_() and array.null_count):
        return np.array(array.to_pylist(), dtype=object)
    if array.type == pa.bool_():
        return to_array(pc.cast(array, pa.uint8())).view(np.bool_)
    if not array.null_count:
        return np.from_dlpack(array)
    without_nulls = [None, array.buffers()[1]]
    values = np.from_dlpack(pa.Array.from_buffers(array.type, len(array), without_nulls, 0, array.offset))
    return np.where(to_array(pc.is_null(array)), np.nan, values)


def to_column(kind: Any, values: Sequence[Any] | NDArray[Any]) -> Any:
    """Make a column of values, shape (n,); None and NaN are null."""
    # not pa.array: it imports pandas where that is installed, which takes each worker a third of a second
    if kind == pa.string():
        texts = [(text or "").encode() for text in values]
        content: list[Any] = [np.cumsum([0, *map(len, texts)], dtype=np.int32), b"".join(texts)]
    elif kind == pa.bool_():
        content = [np.packbits(np.array(values, dtype=bool), bitorder="little")]
    else:
        content = [np.array(values, dtype=np.float64 if kind == pa.float64() else np.int64)]
    is_null = np.isnan(content[0]) if kind == pa.float64() else np.array([value is None for value in values], bool)
    validity = np.packbits(~is_null, bitorder="little") if is_null.any() else None
    buffers = [None if buffer is None else pa.py_buffer(buffer) for buffer in (validity, *content)]
    return pa.Array.from_buffers(kind, len(values), buffers)


def _difference(received: Any, expected: Any) -> str:
    """Describe the first column in which two schemas differ."""
    for field in expected:
        if received.names.count(field.name) != 1:
            number = "two columns" if field.name in received.names else "no column"
            return f"has {number} {field.name!r}, expected one"
        if not received.field(field.name).equals(field):
            types = (f"{f.type}{', perhaps null' if f.nullable else ''}" for f in (received.field(field.name), field))
            return f"column {field.name!r} holds {', expected '.join(types)}"
    unknown = next((name for name in received.names if name not in expected.names), received.names[0])
    return f"column {unknown!r} is not expected there"
