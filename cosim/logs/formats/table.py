"""Tables: CSV and Parquet files, with columns named by a map."""

from __future__ import annotations

import contextlib
import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet as pq

from cosim.errors import ImportLogError
from cosim.logs.chunked_file import OnProgress
from cosim.logs.clocks import Clock
from cosim.logs.column_map import ColumnMap, TimeColumn, require_map
from cosim.logs.frames import UNITS
from cosim.logs.spool import LogContents
from cosim.simulation.signals import Array
from plant_fmu.toml_tables import hint

_ROWS = 2**15  # rows of a Parquet file that are read at once
_BLOCK = 1 << 19  # bytes of a CSV file that are read at once; the reader is up to 32 such blocks ahead
_MISSING = ["", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "inf", "-inf"]


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a table, as specified by `LogFormat`; raise ImportLogError if a column is missing or not numeric."""
    columns = require_map(columns)
    time_columns = {name: _require_time(columns, name) for name in columns.quantities}
    names = {column for mapped in columns.quantities.values() for column in mapped.columns}
    clocks = {time: Clock() for time in time_columns.values()}
    texts = {time.column for time in clocks if time.unit == "iso8601"}
    for batch in _batches(path, contents, names | {time.column for time in clocks}, texts, on_progress):
        times = {time: clock.times(_seconds(batch, time)) for time, clock in clocks.items()}
        for name, mapped in columns.quantities.items():
            values = np.column_stack([_numbers(batch, column) for column in mapped.columns])
            columns.put(contents, name, times[time_columns[name]], values)
    for time, clock in clocks.items():
        contents.remarks += clock.remarks(f"Column {time.column!r}")


def _require_time(columns: ColumnMap, name: str) -> TimeColumn:
    time = columns.time_of(name)
    if time is None:
        raise ImportLogError(f"the map says no time for [{name}], expected [time] with column and unit")
    return time


def _batches(
    path: Path, contents: LogContents, columns: set[str], texts: set[str], on_progress: OnProgress
) -> Iterator[Any]:
    """Yield batches of rows with some columns."""
    try:
        if path.suffix.lower() == ".parquet":
            with pq.ParquetFile(path, pre_buffer=False) as file:
                _require(file.schema_arrow.names, columns, contents)
                done = 0
                for batch in file.iter_batches(_ROWS, columns=sorted(columns)):
                    done += batch.num_rows
                    on_progress(done / file.metadata.num_rows)
                    yield batch
            return
        with path.open("rb") as head:
            first = head.readline(1 << 20)
        separator = max(",;\t", key=lambda letter: first.count(letter.encode()))
        line = first.decode("utf-8-sig", "replace").rstrip("\r\n")
        names = next(csv.reader([line], delimiter=separator), [])
        _require(names, columns, contents)
        types = {column: pa.string() if column in texts else pa.float64() for column in columns}
        convert = pa.csv.ConvertOptions(
            column_types=types, include_columns=sorted(columns), null_values=_MISSING, strings_can_be_null=True
        )
        total, done = max(1, path.stat().st_size), 0
        read, parse = pa.csv.ReadOptions(block_size=_BLOCK), pa.csv.ParseOptions(delimiter=separator)
        with contextlib.closing(pa.csv.open_csv(path, read, parse, convert)) as reader:
            for batch in reader:
                done += _BLOCK
                on_progress(min(1.0, done / total))
                yield batch
    except (pa.ArrowException, OSError, UnicodeDecodeError, csv.Error) as error:
        raise ImportLogError(f"cannot be read: {error}") from error


def _require(names: list[str], columns: set[str], contents: LogContents) -> None:
    """Refuse a table that lacks columns; record the unused ones."""
    missing = sorted(columns - set(names))
    if missing:
        raise ImportLogError(f"has no column {missing[0]!r}, which the map names; {hint(missing[0], names)}")
    twice = next((name for name in columns if names.count(name) > 1), None)
    if twice is not None:
        raise ImportLogError(f"has two columns {twice!r}, expected each that the map names once")
    contents.unread.update({name: 1 for name in names if name not in columns})


def _numbers(batch: Any, column: str) -> Array:
    values = batch.column(batch.schema.get_field_index(column))
    try:
        numbers: Array = np.asarray(pc.fill_null(values.cast(pa.float64()), float("nan")))
    except pa.ArrowException as error:
        raise ImportLogError(f"column {column!r} is {values.type}, expected numbers") from error
    return numbers


def _seconds(batch: Any, time: TimeColumn) -> Array:
    values = batch.column(batch.schema.get_field_index(time.column))
    if pa.types.is_timestamp(values.type) or time.unit == "iso8601":
        try:
            moments = values.cast(pa.timestamp("ns", tz="UTC" if pa.types.is_string(values.type) else None))
        except pa.ArrowException:
            try:
                moments = values.cast(pa.timestamp("ns"))
            except pa.ArrowException as error:
                raise ImportLogError(f"column {time.column!r}: {error}, expected times of ISO 8601") from error
        nanoseconds = pc.fill_null(moments.cast(pa.int64()).cast(pa.float64(), safe=False), float("nan"))
        seconds: Array = np.asarray(nanoseconds) * 1e-9
        return seconds
    return _numbers(batch, time.column) * UNITS["s"][time.unit]
