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
from cosim.logs.clocks import Clock
from cosim.logs.column_map import ColumnMap, TimeColumn, require_map
from cosim.logs.format import LogFormat, Moved
from cosim.logs.frames import UNITS
from cosim.logs.spool import LogContents
from cosim.simulation.signals import Array
from plant_fmu.toml_tables import hint

_ROWS = 2**15  # rows of a Parquet file that are read at once
_BLOCK = 1 << 19  # bytes of a CSV file that are read at once; the reader is up to 32 such blocks ahead
_MISSING = ["", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "inf", "-inf"]


def read(path: Path, columns: ColumnMap | None, contents: LogContents, moved: Moved) -> None:
    """Read a table, as specified by `LogFormat`; raise ImportLogError if a column is missing or not numeric."""
    columns = require_map(columns)
    times = {name: columns.time_of(name) for name in columns.quantities}
    untimed = next((name for name, time in times.items() if time is None), None)
    if untimed is not None:
        raise ImportLogError(f"the map says no time for [{untimed}], expected [time] with column and unit")
    wanted = {column for mapped in columns.quantities.values() for column in mapped.columns}
    stamps = {time for time in times.values() if time is not None}
    clocks = {time: Clock() for time in stamps}
    texts = {time.column for time in stamps if time.unit == "iso8601"}
    for batch in _batches(path, contents, wanted | {time.column for time in stamps}, texts, moved):
        at = {time: clocks[time].times(_seconds(batch, time)) for time in stamps}
        for name, mapped in columns.quantities.items():
            time = times[name]
            assert time is not None
            values = np.column_stack([_numbers(batch, column) for column in mapped.columns])
            columns.put(contents, name, at[time], values)
    for time, clock in clocks.items():
        for _, by in clock.jumps:
            contents.remarks.append(f"Column {time.column!r} jumps by {by:+.4g} s: it is taken as a pause of 1 s.")


def _batches(path: Path, contents: LogContents, wanted: set[str], texts: set[str], moved: Moved) -> Iterator[Any]:
    """Yield batches of rows with the wanted columns."""
    try:
        if path.suffix.lower() == ".parquet":
            with pq.ParquetFile(path, pre_buffer=False) as file:
                _require(file.schema_arrow.names, wanted, contents)
                rows, done = max(1, file.metadata.num_rows), 0
                for batch in file.iter_batches(_ROWS, columns=sorted(wanted)):
                    done += batch.num_rows
                    moved(done / rows)
                    yield batch
            return
        with path.open("rb") as head:
            first = head.readline(1 << 20)
        separator = max(",;\t", key=lambda letter: first.count(letter.encode()))
        options = {
            "read_options": pa.csv.ReadOptions(block_size=_BLOCK),
            "parse_options": pa.csv.ParseOptions(delimiter=separator),
        }
        line = first.decode("utf-8-sig", "replace").rstrip("\r\n")
        names = next(csv.reader([line], delimiter=separator), [])
        _require(names, wanted, contents)
        types = {column: pa.string() if column in texts else pa.float64() for column in wanted}
        convert = pa.csv.ConvertOptions(
            column_types=types, include_columns=sorted(wanted), null_values=_MISSING, strings_can_be_null=True
        )
        total, done = max(1, path.stat().st_size), 0
        with contextlib.closing(pa.csv.open_csv(path, convert_options=convert, **options)) as reader:
            for batch in reader:
                done += _BLOCK
                moved(min(1.0, done / total))
                yield batch
    except (pa.ArrowException, OSError, UnicodeDecodeError, csv.Error) as error:
        raise ImportLogError(f"cannot be read: {error}") from error


def _require(names: list[str], wanted: set[str], contents: LogContents) -> None:
    """Refuse a table that lacks columns; record the unused ones."""
    missing = sorted(wanted - set(names))
    if missing:
        raise ImportLogError(f"has no column {missing[0]!r}, which the map names; {hint(missing[0], names)}")
    twice = next((name for name in wanted if names.count(name) > 1), None)
    if twice is not None:
        raise ImportLogError(f"has two columns {twice!r}, expected each that the map names once")
    contents.unread.update({name: 1 for name in names if name not in wanted})


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


FORMAT = LogFormat((".csv", ".parquet"), read, mapped=True)
