"""The joined rows of a campaign."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from cosim.campaigns.parts import check_schema
from cosim.errors import RunError
from cosim.signals import Array

_PIECE = 1000  # rows


class Results:
    """The rows of a campaign, in a file that is read column by column as they are asked for.

    Parameters
    ----------
    path : Path
        A Parquet file, in order of key.
    schema : pyarrow.Schema, optional
        That it is to have.

    Raises
    ------
    RunError
        If it cannot be read, or has other columns.
    """

    def __init__(self, path: Path, schema: Any = None) -> None:
        self.path = path
        try:
            if schema is not None:
                check_schema(path, schema)
            metadata = pq.read_metadata(path)
        except (OSError, pa.ArrowException) as error:
            raise RunError(f"{path}: cannot be read: {' '.join(str(error).split())}") from error
        self.schema = metadata.schema.to_arrow_schema()
        self._rows = int(metadata.num_rows)

    def __len__(self) -> int:
        return self._rows

    def __getitem__(self, name: str) -> Any:
        """Return a column, shape (rows,); NaN or None where there is nothing."""
        return self._read(columns=[name])[name].to_numpy()

    def number(self, name: str, absent: float = np.nan) -> Array:
        """Return a column of numbers, shape (rows,), with `absent` where there is none."""
        column: Array = self[name].astype(float)
        return np.where(np.isnan(column), absent, column)

    def fact(self, name: str) -> NDArray[np.bool_]:
        """Return a column of facts, shape (rows,); what is not known is no fact."""
        facts: NDArray[np.bool_] = pc.fill_null(self._read(columns=[name])[name], False).to_numpy()
        return facts

    def absent(self, name: str) -> NDArray[np.bool_]:
        """Return where a column has nothing, shape (rows,)."""
        absent: NDArray[np.bool_] = pc.is_null(self._read(columns=[name])[name]).to_numpy()
        return absent

    def pieces(self, name: str) -> Iterator[list[Any]]:
        """Yield a column some rows at a time, in their order; a RunError if it is not there."""
        try:
            with pq.ParquetFile(self.path) as file:
                for batch in file.iter_batches(_PIECE, columns=[name]):
                    yield batch.column(0).to_pylist()
        except (OSError, pa.ArrowException) as error:
            raise RunError(f"{self.path}: cannot be read: {' '.join(str(error).split())}") from error

    def row(self, key: int) -> dict[str, Any] | None:
        """Return the row of a key, None if there is none."""
        rows = self._read(filters=[(self.schema.names[0], "=", key)]).to_pylist()
        return dict(rows[0]) if rows else None

    @property
    def table(self) -> Any:
        """All of it, a pyarrow.Table."""
        return self._read()

    def _read(self, **how: Any) -> Any:
        try:
            return pq.read_table(self.path, **how)
        except (OSError, pa.ArrowException) as error:
            raise RunError(f"{self.path}: cannot be read: {' '.join(str(error).split())}") from error
