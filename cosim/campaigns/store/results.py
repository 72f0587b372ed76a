"""The joined rows of a campaign."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from cosim.campaigns.store.columns import to_array
from cosim.campaigns.store.parts import check_schema
from cosim.errors import RunError
from cosim.simulation.signals import Array

_MAX_NUMBER = 1e100  # greatest size of a number, whose powers are still finite
_PIECE = 1000  # number of rows that are read at once


class Results:
    """The rows of a campaign in a file, whose columns are read at each use."""

    def __init__(self, path: Path, schema: Any = None) -> None:
        self.path = path
        with self._readable():
            if schema is not None:
                check_schema(path, schema)
            metadata = pq.read_metadata(path)
        self.schema = metadata.schema.to_arrow_schema()
        self._rows = int(metadata.num_rows)

    def __len__(self) -> int:
        return self._rows

    def __getitem__(self, name: str) -> Any:
        """Return a column, shape (rows,), with NaN or None for null; raise a RunError for numbers beyond statistics."""
        with self._readable():
            column = to_array(self._read([name])[name])
        if column.dtype == np.float64 and (beyond := np.isfinite(column) & (np.abs(column) > _MAX_NUMBER)).any():
            i = int(np.argmax(beyond))
            raise RunError(
                f"{self.path}: column {name!r} holds {column[i]:g} in row {i}, expected at most {_MAX_NUMBER:g} in size"
            )
        return column

    def number(self, name: str, absent: float = np.nan) -> Array:
        """Return a column of numbers, shape (rows,), with `absent` for null and NaN."""
        column: Array = self[name].astype(float)
        return np.where(np.isnan(column), absent, column)

    def fact(self, name: str) -> NDArray[np.bool_]:
        """Return a column of Booleans, shape (rows,), with False for null."""
        facts: NDArray[np.bool_] = self[name].astype(bool)  # None is false
        return facts

    def absent(self, name: str) -> NDArray[np.bool_]:
        """Return a mask of the nulls of a column, shape (rows,)."""
        return to_array(pc.is_null(self._read([name])[name]))

    def pieces(self, name: str) -> Iterator[list[Any]]:
        """Yield a column in pieces of rows in order; raise a RunError if it does not exist."""
        with self._readable(), pq.ParquetFile(self.path) as file:
            for batch in file.iter_batches(_PIECE, columns=[name]):
                yield batch.column(0).to_pylist()

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
