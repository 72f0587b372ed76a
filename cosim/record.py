"""The record of a run: a Parquet file with a column for each signal and its unit in the metadata."""

from __future__ import annotations

import contextlib
import shutil
import time
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
_WHOLE = "whole"  # among them, what a finished run makes of them
_PART_SECONDS = 1.0  # of the wall clock, after which a part is written even if it is small
_BLOCK = 10_000  # rows that are read at once
_SMALL = 2**23  # numbers of a record that is read as a whole,
_KEPT = 24  # and signals that a larger one keeps in memory


class Recorder:
    """Observer that writes each step's row, in parts that a killed run leaves readable.

    Parameters
    ----------
    folder : Path
        The run folder.
    columns : sequence of Column
        Of the rows that will come.
    rows_per_part : int
        A part is written when so many rows have come, or a second of the wall clock has passed.

    Attributes
    ----------
    rows : int
        That have come.
    """

    def __init__(self, folder: Path, columns: Sequence[Column], rows_per_part: int = 10_000) -> None:
        self._folder = folder
        self._schema = _schema(columns)
        self._block: Array = np.empty((rows_per_part, len(columns)))
        self._filled = 0
        self._parts = 0
        self._flushed = time.monotonic()
        self.rows = 0
        (folder / PARTS).mkdir()
        self._whole: pq.ParquetWriter | None = None  # what the record will be, begun with its first rows
        self._gathered: list[pa.Table] = []  # written as parts, but not yet into the whole
        self._sound = True  # the whole has what it should have; not so once a write was cut off

    def observe(self, k: int, row: Array) -> None:
        """Keep the row of step `k`."""
        if self._filled == len(self._block) or (self._filled and time.monotonic() - self._flushed > _PART_SECONDS):
            self._flush()
        self._block[self._filled] = row
        self._filled += 1
        self.rows += 1

    def close(self) -> None:
        """Write what is left, and put the whole in the place of its parts."""
        self._flush()
        if not self._sound:
            self._begin_anew()
        self._write_gathered()
        if self._whole is not None:
            self._whole.close()
        (self._folder / PARTS / _WHOLE).replace(self._folder / RECORD)
        shutil.rmtree(self._folder / PARTS)

    def _begin_anew(self) -> None:
        """Write the whole from its parts: Ctrl-C or a full disk may have come in the middle of it."""
        if self._whole is not None:
            with contextlib.suppress(OSError, pa.ArrowException):
                self._whole.close()
            self._whole = None
        self._gathered = []
        for part in _part_files(self._folder):
            with pq.ParquetFile(part) as parquet:
                self._gather(parquet.read())

    def _gather(self, table: pa.Table) -> None:
        self._gathered.append(table)
        if sum(gathered.num_rows for gathered in self._gathered) >= len(self._block):
            self._write_gathered()

    def _write_gathered(self) -> None:
        if self._gathered:
            if self._whole is None:
                self._whole = pq.ParquetWriter(self._folder / PARTS / _WHOLE, self._schema, **_WRITING)
            self._whole.write_table(pa.concat_tables(self._gathered).combine_chunks())
            self._gathered = []

    def _flush(self) -> None:
        if not self._filled:
            return
        sound, self._sound = self._sound, False
        # not pa.array: that imports pandas where it is installed, for nothing
        columns = [
            pa.Array.from_buffers(pa.float64(), self._filled, [None, pa.py_buffer(column)])
            for column in self._block[: self._filled].T.copy("C")  # the block is filled anew
        ]
        part = self._folder / PARTS / f"{self._parts:06}.parquet"
        scratch = part.with_suffix(".tmp")
        table = pa.Table.from_arrays(columns, schema=self._schema)
        pq.write_table(table, scratch, **_WRITING_PARTS)
        scratch.replace(part)
        # only now: an interrupted write is done again, into the same part
        self._parts, self._filled = self._parts + 1, 0
        if sound:
            self._gather(table)
        self._sound = sound
        self._flushed = time.monotonic()


# measured: bytes of a float64 column compress best when they are split by place, and dictionaries only cost
_WRITING = {"compression": "zstd", "use_dictionary": False, "use_byte_stream_split": True}
_WRITING_PARTS = _WRITING | {"compression": "lz4"}  # a fifth of the time; they do not stay


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
    files = [folder / RECORD] if (folder / RECORD).exists() else _part_files(folder)
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


def _part_files(folder: Path) -> list[Path]:
    return sorted((folder / PARTS).glob("*.parquet"))


def _schema(columns: Sequence[Column]) -> pa.Schema:
    return pa.schema(
        [
            pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit, "description": c.description})
            for c in columns
        ]
    )
