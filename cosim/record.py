"""The record of a run, read: a Parquet file with a column for each signal and its unit in the metadata."""

from __future__ import annotations

import contextlib
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.errors import RunError
from cosim.signals import Array, Column
from plant_fmu.tables import brief

MAX_ROWS = 100_000_001  # of a run of as many steps as a scenario may have
RECORD = "record.parquet"
PARTS = "record.parts"  # what a killed run leaves
_BLOCK = 10_000  # rows that are read at once
_SMALL = 2**23  # numbers of a record that is read as a whole,
_KEPT = 24  # and signals that a larger one keeps in memory


class Record:
    """A run's signals, each an array over its steps, read from the files when they are asked for.

    Parameters
    ----------
    files : sequence of Path
        Parquet files of one schema, one behind the other.

    Attributes
    ----------
    columns : tuple of Column
        In the order of the row.
    units : dict
        Unit of each signal, by name, in the order of the columns.

    Raises
    ------
    RunError
        If they cannot be read.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._files = list(files)
        columns, rows = [], 0
        for file in self._files:
            with _opened(file) as parquet:
                schema = parquet.schema_arrow
                rows += parquet.metadata.num_rows
                _require_numbers(file, schema, rows)
                columns.append(tuple(map(_column_of, schema)))
            if columns[-1] != columns[0]:
                raise RunError(f"{file}: has other columns than {self._files[0].name}, expected parts of one record")
        self.columns = columns[0]
        self.units: dict[str, str] = {column.name: column.unit for column in self.columns}
        self._small = rows * len(self.columns) <= _SMALL  # one signal takes a tenth of the time that all take
        self._kept: OrderedDict[str, Array] = OrderedDict()

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (steps,)."""
        if name not in self.units:
            raise KeyError(name)
        if name not in self._kept:
            names = list(self.units) if self._small else [name]
            parts = [_read(file, names) for file in self._files]
            self._kept.update(
                {n: np.concatenate([np.empty(0), *(c for part in parts for c in part[n])]) for n in names}
            )
        self._kept.move_to_end(name)
        while len(self._kept) > _KEPT and not self._small:
            self._kept.popitem(last=False)
        return self._kept[name]

    def stack(self, names: Sequence[str]) -> Array:
        """Return several signals side by side, shape (steps, len(names))."""
        return np.column_stack([self[name] for name in names])

    def blocks(self, names: Sequence[str] | None = None) -> Iterator[Array]:
        """Yield all rows in their order, in blocks of shape (n, len(names)) that fit into memory.

        Parameters
        ----------
        names : sequence of str, optional
            Which signals; default: all, in the order of the columns.

        Raises
        ------
        RunError
            If they cannot be read.
        """
        for file in self._files:
            with _opened(file) as parquet:
                for batch in parquet.iter_batches(_BLOCK, columns=names):
                    columns = batch.columns if names is None else [batch.column(name) for name in names]
                    yield np.column_stack([_numbers(column) for column in columns])


def load_record(folder: Path) -> Record:
    """Open the record of a run, whether it was finished or killed.

    Parameters
    ----------
    folder : Path
        The run folder.

    Returns
    -------
    Record
        All that was written.

    Raises
    ------
    RunError
        If there is none, or it cannot be read.
    """
    require_utf8(folder)
    files = [folder / RECORD] if (folder / RECORD).exists() else part_files(folder)
    if not files:
        raise RunError(f"{folder}: holds no record of a run")
    record = Record(files)
    if not len(record[next(iter(record.units))]):
        raise RunError(f"{folder}: the record of the run is empty")
    return record


def _column_of(field: pa.Field) -> Column:
    about = field.metadata or {}
    return Column(field.name, about.get(b"unit", b"").decode(), about.get(b"description", b"").decode())


def _read(file: Path, names: list[str]) -> dict[str, list[Array]]:
    """Return the pieces of each signal."""
    with _opened(file) as parquet:  # pq.read_table takes three times as long to begin
        table = parquet.read(names)
        return {name: [_numbers(chunk) for chunk in table[name].chunks] for name in names}  # not to_numpy, as above


def _numbers(column: pa.Array) -> Array:
    if column.null_count:
        raise TypeError("a number is missing")
    numbers: Any = np.from_dlpack(column)
    result: Array = numbers
    return result


@contextlib.contextmanager
def _opened(file: Path) -> Iterator[Any]:
    """Open a Parquet file; what cannot be read of it is one error, whoever has made it."""
    require_utf8(file)
    try:
        with pq.ParquetFile(file) as parquet:
            yield parquet
    except (OSError, pa.ArrowException, UnicodeDecodeError, TypeError, BufferError, KeyError) as error:
        raise RunError(f"{file}: cannot be read: {brief(error)}") from error


def require_utf8(path: Path) -> None:
    """Refuse a place that Parquet's library cannot be told of.

    Parameters
    ----------
    path : Path
        Of a file or folder.

    Raises
    ------
    RunError
        If its name is no UTF-8.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        shown = str(path).encode(errors="surrogateescape").decode(errors="backslashreplace")
        raise RunError(f"{shown}: is no UTF-8, expected such a name, which Parquet files need") from error


def _require_numbers(file: Path, schema: pa.Schema, rows: int) -> None:
    """Refuse a table that is no record, or brings one to too many rows: a few bytes could say what no memory holds."""
    odd = next((field.name for field in schema if field.type != pa.float64()), None)
    if odd is not None:
        raise RunError(f"{file}: column {odd[:80]!r} is no number, expected the record of a run")
    if not schema.names or len(set(schema.names)) < len(schema.names):
        raise RunError(f"{file}: has no columns, or two of one name; expected the record of a run")
    if rows > MAX_ROWS:
        raise RunError(f"{file}: the record has {rows} rows up to here, expected at most {MAX_ROWS}")


def part_files(folder: Path) -> list[Path]:
    """Return the parts that a run has left in its folder, in their order."""
    return sorted((folder / PARTS).glob("*.parquet"))
