"""Reads the record of a run: a Parquet file with a column for each signal and its unit in the metadata."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from cosim.errors import RunError
from cosim.io.format_number import require_format
from cosim.simulation.signals import Array, Column
from plant_fmu.variables.former_names import present_name

log = logging.getLogger(__name__)

MAX_ROWS = 100_000_001  # rows of a run with the maximum number of steps that a scenario may have
RECORD = "record.parquet"
STREAM = "record.arrows"  # Arrow stream of the rows of a run that is under way or was killed
_DIGITS = 9  # maximum number of digits of a format number
_BLOCK = 10_000  # rows that are read at once
_SMALL = 2**22  # numbers; a record of at most so many is read as a whole
_MAX_CACHED_SIGNALS = 24  # signals of a larger record that are kept in memory


class Rows:
    """Signals over some rows of a run, in memory; arrays (rows,)."""

    def __init__(self, columns: Sequence[Column], arrays: Mapping[str, Array]) -> None:
        self.columns = tuple(columns)
        self.units: dict[str, str] = {column.name: column.unit for column in self.columns}
        self._arrays = arrays

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self[next(iter(self.units))])

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (rows,)."""
        return self._arrays[name]

    def stack(self, names: Sequence[str]) -> Array:
        """Return several signals side by side, shape (rows, len(names))."""
        return np.column_stack([self[name] for name in names])

    def to_array(self) -> Array:
        """Return all signals side by side, shape (rows, columns)."""
        return self.stack(list(self.units))

    def blocks(self, names: Sequence[str] | None = None) -> Iterator[Rows]:
        """Yield all rows in their order, in blocks that fit into memory."""
        columns = self._columns_of(names)
        for first in range(0, len(self), _BLOCK):
            yield Rows(columns, {c.name: self[c.name][first : first + _BLOCK] for c in columns})

    def take(self, rows: Sequence[int] | NDArray[np.intp], names: Sequence[str] | None = None) -> Rows:
        """Return a selection of rows."""
        columns = self._columns_of(names)
        return Rows(columns, {column.name: self[column.name][np.asarray(rows, np.intp)] for column in columns})

    def value(self, name: str, row: int) -> float:
        """Return the value of signal `name` at `row`, from 0, or from -1 backwards."""
        return float(self.take([row % len(self)], [name])[name][0])

    def _columns_of(self, names: Sequence[str] | None) -> tuple[Column, ...]:
        if names is None:
            return self.columns
        for name in names:
            if name not in self.units:
                raise KeyError(name)
        by_name = {column.name: column for column in self.columns}
        return tuple(by_name[name] for name in dict.fromkeys(names))


class Record(Rows):
    """A run's signals, each an array over its steps, read from the file at their first use.

    A small record is kept in memory as a whole. Read a larger one by `blocks` or `take`: a single signal may exceed the
    memory.

    Parameters
    ----------
    file : Path
        Parquet file or Arrow stream.

    Attributes
    ----------
    columns : tuple of Column
        Columns in the order of the row.
    units : dict
        Unit of each signal, by name, in the order of the columns.
    file : Path
        The file.

    Raises
    ------
    RunError
        If the file cannot be read, or is no record.

    Examples
    --------
    >>> import cosim
    >>> run = cosim.run_scenario(cosim.load_scenario("paper", ["time.duration=0.2"]), "run", report=False)
    >>> run.record["position.z"].shape
    (201,)
    >>> run.record.units["position.z"]
    'm'
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        with _open_source(file, warn=True) as source:
            self._count = sum(source.group_rows)
            _require_numbers(file, source.schema, self._count)
            if (format_number := _format_of(source.schema)) is not None:
                require_format(file, format_number)
            columns = tuple(map(_column_of, source.schema))
        self._kept: dict[str, Array] = {}
        super().__init__(columns, self._kept)
        self._small = self._count * len(columns) <= _SMALL  # reading one signal takes a tenth of the time of all

    def __reduce__(self) -> tuple[Any, ...]:
        """Describe how another process opens the file."""
        return type(self), (self.file,)

    def __len__(self) -> int:
        """Return the number of rows."""
        return self._count

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (steps,)."""
        name = present_name(name, self.units)
        if name not in self.units:
            raise KeyError(name)
        self._keep([name])
        return self._kept[name]

    def stack(self, names: Sequence[str]) -> Array:
        """Return several signals side by side, shape (rows, len(names))."""
        if len(names) <= _MAX_CACHED_SIGNALS:
            self._keep(names)  # at once, since to open the file takes longer than to read a signal
        return super().stack(names)

    def _keep(self, names: Sequence[str]) -> None:
        """Read signals that are not in memory, in place of the others if those are many."""
        missing = [name for name in names if name not in self._kept]
        if missing and not self._small and len(self._kept) + len(missing) > _MAX_CACHED_SIGNALS:
            for name in self._kept.keys() - names:
                del self._kept[name]
        if missing:
            columns = self.columns if self._small else self._columns_of(missing)
            arrays, first = [np.empty(self._count) for _ in columns], 0
            for batch in self._batches(columns):  # a table of the whole would take the memory twice
                for row, column in zip(arrays, columns, strict=True):
                    row[first : first + len(batch)] = batch[column.name]
                first += len(batch)
            self._kept.update(zip((column.name for column in columns), arrays, strict=True))

    def blocks(self, names: Sequence[str] | None = None) -> Iterator[Rows]:
        """Yield all rows in order, in blocks that fit into memory, of all signals or of those in `names`."""
        if self._small:
            yield from super().blocks(names)
            return
        yield from self._batches(self._columns_of(names))

    def _batches(self, columns: Sequence[Column]) -> Iterator[Rows]:
        """Yield all rows in order, from the file."""
        with _open_source(self.file) as source:
            yield from source.read(columns, range(len(source.group_rows)))

    def take(self, rows: Sequence[int] | NDArray[np.intp], names: Sequence[str] | None = None) -> Rows:
        """Return a selection of `rows` (rising, from 0), of all signals or of those in `names`."""
        if self._small and self._kept:
            return super().take(rows, names)
        columns, rows = self._columns_of(names), np.asarray(rows, np.intp)
        pieces: dict[str, list[Array]] = {column.name: [np.empty(0)] for column in columns}
        first = 0
        with _open_source(self.file) as source:
            for group, length in enumerate(source.group_rows):
                if np.searchsorted(rows, first) == np.searchsorted(rows, first + length):
                    first += length
                    continue
                for batch in source.read(columns, [group]):
                    begin, stop = np.searchsorted(rows, [first, first + len(batch)])
                    for name, arrays in pieces.items():
                        arrays.append(batch[name][rows[begin:stop] - first])
                    first += len(batch)
        return Rows(columns, {name: np.concatenate(arrays) for name, arrays in pieces.items()})


def load_record(folder: Path) -> Record:
    """Open the record of a run, whether it was finished or killed."""
    require_utf8(folder)
    files = (folder / name for name in (RECORD, STREAM))
    file = next((file for file in files if file.exists() and file.stat().st_size), None)
    if file is None:
        raise RunError(f"{folder}: holds no record of a run")
    record = Record(file)
    if not len(record):
        raise RunError(f"{folder}: the record of the run is empty")
    return record


def _column_of(field: pa.Field) -> Column:
    about = field.metadata or {}
    return Column(field.name, about.get(b"unit", b"").decode(), about.get(b"description", b"").decode())


@dataclass(frozen=True)
class _Source:
    """The rows of a file by group: row groups of Parquet, or batches of an Arrow stream."""

    schema: pa.Schema
    group_rows: list[int]
    batches: Callable[[list[int], list[str]], Iterable[pa.RecordBatch]]  # of some groups, with some columns

    def read(self, columns: Sequence[Column], groups: Sequence[int]) -> Iterator[Rows]:
        """Yield the rows of some groups."""
        names, rows = [column.name for column in columns], 0
        for batch in self.batches(list(groups), names):
            rows += len(batch)
            yield Rows(columns, {name: _numbers(batch.column(name)) for name in names})
        expected_rows = sum(self.group_rows[group] for group in groups)
        if rows != expected_rows:
            raise TypeError(f"{rows} rows are there, expected {expected_rows}")


def _complete_batches(file: Path, stream: Any, warn: bool) -> Iterator[pa.RecordBatch]:
    """Yield the batches of a stream up to the first that a kill, a full disk or damage has made unreadable."""
    try:
        for batch in stream:
            batch.validate()  # a damaged length would be read beyond the file's end
            yield batch
    except (pa.ArrowInvalid, OSError) as error:
        log.log(
            logging.WARNING if warn else logging.DEBUG,
            "%s: its end cannot be read (%s); the rows before it are kept",
            file,
            error,
        )


@contextlib.contextmanager
def stream_batches(
    file: Path, warn: bool = False, is_mapped: bool = True
) -> Iterator[tuple[pa.Schema, Iterator[pa.RecordBatch]]]:
    """Open an Arrow stream to read its schema and complete batches, whose memory is the file's if it is mapped."""
    with (
        pa.memory_map(str(file)) if is_mapped else pa.OSFile(str(file)) as memory,
        pa.ipc.open_stream(memory) as stream,
    ):
        yield stream.schema, _complete_batches(file, stream, warn)


def _numbers(column: pa.Array) -> Array:
    if column.null_count:
        raise TypeError("a number is missing")
    numbers: Any = np.from_dlpack(column)
    result: Array = numbers
    return result


@contextlib.contextmanager
def _open_source(file: Path, warn: bool = False) -> Iterator[_Source]:
    """Open the file of a record; convert all errors of reading it to a RunError."""
    require_utf8(file)
    try:
        if file.suffix == Path(STREAM).suffix:
            with stream_batches(file, warn) as (schema, complete):
                batches = list(complete)
                yield _Source(schema, list(map(len, batches)), lambda groups, _: [batches[i] for i in groups])
        else:
            # with pre_buffer all that was read of a file would stay in memory until it is closed
            with pq.ParquetFile(file, pre_buffer=False) as parquet:
                group_rows = [parquet.metadata.row_group(i).num_rows for i in range(parquet.num_row_groups)]
                if parquet.metadata.num_rows != sum(group_rows):
                    raise TypeError("its groups have another number of rows than the file")
                yield _Source(
                    parquet.schema_arrow, group_rows,
                    lambda groups, names: parquet.iter_batches(_BLOCK, row_groups=groups, columns=names),
                )  # fmt: skip
    except (OSError, pa.ArrowException, UnicodeDecodeError, TypeError, BufferError, KeyError) as error:
        raise RunError(f"{file}: cannot be read: {error}") from error


def require_utf8(path: Path) -> None:
    """Raise a RunError for a path that is not UTF-8, which Parquet's library does not support."""
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        shown = str(path).encode(errors="surrogateescape").decode(errors="backslashreplace")
        raise RunError(f"{shown}: is not UTF-8, expected a UTF-8 path, which Parquet files need") from error


def _require_numbers(file: Path, schema: pa.Schema, rows: int) -> None:
    """Raise a RunError if a schema is not a record's, or `rows` exceeds the bound, which a small file can claim."""
    odd = next((field.name for field in schema if field.type != pa.float64()), None)
    if odd is not None:
        raise RunError(f"{file}: column {odd[:80]!r} is no number, expected the record of a run")
    if not schema.names or len(set(schema.names)) < len(schema.names):
        raise RunError(f"{file}: has no columns, or two of one name; expected the record of a run")
    if rows > MAX_ROWS:
        raise RunError(f"{file}: the record has {rows} rows, expected at most {MAX_ROWS}")


def _format_of(schema: pa.Schema) -> int | str | None:
    """Return the format number in a schema; without one, 1 if it has columns of format 1, else None."""
    number = (schema.metadata or {}).get(b"format", b"").decode("utf-8", "replace")
    if not number:
        return 1 if any(name.startswith("helm.") for name in schema.names) else None
    return int(number) if number.isdecimal() and len(number) < _DIGITS else number
