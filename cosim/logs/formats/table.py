"""Tables: CSV and Parquet files, with columns named by a map."""

from __future__ import annotations

import codecs
import contextlib
import csv
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet as pq

from cosim.errors import ImportLogError
from cosim.logs.cleaning.clocks import Clock
from cosim.logs.column_map import ColumnMap, TimeColumn
from cosim.logs.draft_map import missing_map
from cosim.logs.frames import UNITS
from cosim.logs.records import OnProgress
from cosim.logs.spool import LogContents
from cosim.simulation.signals import Array
from plant_fmu.toml_tables import hint

_ROWS = 2**15  # rows of a Parquet file that are read at once
_BLOCK = 1 << 18  # bytes of a CSV file that are read at once; the reader is up to 32 such blocks ahead
_MISSING = ["", "nan", "NaN", "NAN", "-nan", "null", "NULL", "None", "N/A", "n/a", "inf", "-inf"]
_MARKS = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16", codecs.BOM_UTF8: "utf-8-sig"}
_FLAGS = {"true": "1", "false": "0"}
_NUMBER = r"^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$"
_DATE = r"^\s*\d{4}-\d\d-\d\d"
_MAX_LINE = 1 << 24  # characters
_MAX_TEXTS = 0.5  # maximum fraction of a column's cells that are texts, and left out


class _Layout(NamedTuple):
    """Layout of a CSV file."""

    names: list[str]
    separator: str
    encoding: str
    has_quotes: bool = False
    skipped: int = 1  # lines before the first row


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a table, as specified by `LogFormat`; raise ImportLogError if a column is missing or not numeric."""
    layout = _layout(path)
    if columns is None:
        raise missing_map(_rates(path, layout))
    times_of = {name: _require_time(columns, name) for name in columns.quantities}
    names = {column for mapped in columns.quantities.values() for column in mapped.needs}
    stamps = {time.column: time for time in times_of.values()}
    _require(layout.names, names | {*stamps}, contents)
    texts = Counter[str]()
    readings: dict[str, list[Array]] = {column: [] for column in stamps}
    lines: list[str] = []
    for batch in _batches(path, layout, {*stamps}, lines, lambda fraction: on_progress(0.2 * fraction)):
        for column, time in stamps.items():
            readings[column].append(_seconds(batch, time, layout, texts))
    times = {}
    for column, parts in readings.items():
        clock = Clock()
        times[column] = clock.times(np.concatenate(parts or [np.zeros(0)]))
        contents.remarks += clock.remarks(f"Column {column!r}")
    done, cells = 0, Counter[str]()
    for batch in _batches(path, layout, names, [], lambda fraction: on_progress(0.2 + 0.8 * fraction)):
        numbers = {column: _numbers(batch, column, layout, cells) for column in names}
        rows = slice(done, done + batch.num_rows)
        done += batch.num_rows
        for name, mapped in columns.quantities.items():
            values = np.column_stack([numbers[column] for column in mapped.columns])
            is_valid = mapped.is_valid(values, numbers.get(mapped.valid))
            columns.put(contents, name, times[times_of[name].column][rows], values, is_valid)
    _remark_texts(texts + cells, done, lines, contents)


def column_names(path: Path) -> list[str]:
    """Return the names of a table's columns."""
    return _layout(path).names


def _require_time(columns: ColumnMap, name: str) -> TimeColumn:
    time = columns.time_of(name)
    if time is None:
        raise ImportLogError(f"the map says no time for [{name}], expected [time] with column and unit")
    return time


def _layout(path: Path) -> _Layout:
    """Return the layout of a table."""
    if path.suffix.lower() == ".parquet":
        try:
            return _Layout(pq.read_schema(path).names, "", "")
        except (pa.ArrowException, OSError) as error:
            raise ImportLogError(f"cannot be read: {error}") from error
    with path.open("rb") as binary:
        head = binary.read(200)
    encoding = next((name for mark, name in _MARKS.items() if head.startswith(mark)), "utf-8")
    if encoding == "utf-8" and b"\0" in head:
        encoding = "utf-16-le" if head[1:2] == b"\0" else "utf-16-be"
    comment, line, skipped = "", "", 0
    with path.open(encoding=encoding, errors="replace") as file:
        while (line := file.readline(_MAX_LINE)) and (not line.strip() or line.startswith(("#", "%"))):
            comment, skipped = line.strip() or comment, skipped + 1
        others = "".join(file.readline(_MAX_LINE) for _ in range(20))
    # the header is the first line without a mark, or the last one with a mark if numbers follow it
    is_marked = comment and line.lstrip()[:1] in "0123456789.-+"
    header = (comment if is_marked else line).strip()
    separator = max(",;\t|", key=header.count)
    try:
        names = [name.strip() for name in next(csv.reader([header.lstrip("#% ")], delimiter=separator), [])]
    except csv.Error as error:
        raise ImportLogError(f"cannot be read: {error}") from error
    return _Layout(names, separator, encoding, '"' in line + others, skipped if is_marked else skipped + 1)


def _batches(
    path: Path, layout: _Layout, columns: set[str], faults: list[str], on_progress: OnProgress
) -> Iterator[Any]:
    """Yield batches of rows with some columns; add the lines of a CSV file that have other numbers of cells."""
    try:
        if not layout.separator:
            with pq.ParquetFile(path, pre_buffer=False) as file:
                done = 0
                for batch in file.iter_batches(_ROWS, columns=sorted(columns)):
                    done += batch.num_rows
                    on_progress(done / file.metadata.num_rows)
                    yield batch
            return

        def skip(row: Any) -> str:
            faults.append(f"{row.text[:60]!r} with {row.actual_columns} cells, expected {row.expected_columns}")
            return "skip"

        convert = pa.csv.ConvertOptions(
            column_types=dict.fromkeys(columns, pa.string()), include_columns=sorted(columns), null_values=_MISSING,
            strings_can_be_null=True,
        )  # fmt: skip
        total, done = max(1, path.stat().st_size), 0
        read = pa.csv.ReadOptions(
            block_size=_BLOCK,
            column_names=layout.names,
            skip_rows=layout.skipped,
            use_threads=False,
        )
        # a quote that damage has put in would swallow lines
        quote = '"' if layout.has_quotes else False
        parse = pa.csv.ParseOptions(delimiter=layout.separator, quote_char=quote, invalid_row_handler=skip)
        # decoded here: PyArrow does not pass rows that are no UTF-8 to `skip`
        with path.open("rb") as file, contextlib.ExitStack() as stack:
            text = codecs.EncodedFile(file, "utf-8", layout.encoding, "replace")
            for batch in stack.enter_context(contextlib.closing(pa.csv.open_csv(text, read, parse, convert))):
                done += _BLOCK
                on_progress(min(1.0, done / total))
                yield batch
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise ImportLogError(f"cannot be read: {error}") from error


def _require(names: Sequence[str], columns: set[str], contents: LogContents) -> None:
    """Refuse a table that lacks columns; record the unused ones."""
    missing = sorted(columns - set(names))
    if missing:
        raise ImportLogError(f"has no column {missing[0]!r}, which the map names; {hint(missing[0], names)}")
    twice = next((name for name in columns if names.count(name) > 1), None)
    if twice is not None:
        raise ImportLogError(f"has two columns {twice!r}, expected each that the map names once")
    contents.unread.update({name: 1 for name in names if name not in columns})


def _numbers(batch: Any, column: str, layout: _Layout, texts: Counter[str]) -> Array:
    """Return the numbers of a column, NaN for texts, which are counted."""
    values = batch.column(batch.schema.get_field_index(column))
    if pa.types.is_string(values.type) and layout.separator != ",":  # then a comma is a decimal one
        values = pc.replace_substring(values, ",", ".")
    try:
        numbers: Array = np.asarray(pc.fill_null(values.cast(pa.float64()), float("nan")))
    except pa.ArrowException as error:
        if not pa.types.is_string(values.type):
            raise ImportLogError(f"column {column!r} is {values.type}, expected numbers") from error
        cells = pc.utf8_trim_whitespace(values)
        for text, number in _FLAGS.items():
            cells = pc.if_else(pc.equal(pc.utf8_lower(cells), text), number, cells)
        cells = pc.if_else(pc.match_substring_regex(cells, _NUMBER), cells, pa.scalar(None, pa.string()))
        parsed = np.asarray(pc.fill_null(cells.cast(pa.float64()), float("nan")))
        known = np.asarray(pc.is_valid(values))
        odd = np.flatnonzero(np.isnan(parsed) & known)
        texts[column] += len(odd)
        if len(odd) > _MAX_TEXTS * np.count_nonzero(known) and len(odd) > 2:
            raise ImportLogError(
                f"column {column!r} has {values[int(odd[0])].as_py()[:30]!r}, expected numbers"
            ) from error
        numbers = np.asarray(parsed, float)
    return numbers


def _seconds(batch: Any, time: TimeColumn, layout: _Layout, texts: Counter[str]) -> Array:
    values = batch.column(batch.schema.get_field_index(time.column))
    if pa.types.is_timestamp(values.type) or time.unit == "iso8601":
        if pa.types.is_string(values.type):
            is_date = pc.match_substring_regex(values, _DATE)
            odd = np.flatnonzero(~np.asarray(pc.fill_null(is_date, True)))
            texts[time.column] += len(odd)
            if len(odd) <= _MAX_TEXTS * len(values):
                values = pc.if_else(is_date, values, pa.scalar(None, pa.string()))
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
    return _numbers(batch, time.column, layout, texts) * UNITS["s"][time.unit]


def _remark_texts(texts: Counter[str], rows: int, lines: Sequence[str], contents: LogContents) -> None:
    """Remark cells and lines that are left out; raise ImportLogError if no line is left."""
    if lines and not rows:
        raise ImportLogError(f"has no line with a cell for each column: {lines[0]}")
    if lines:
        contents.remarks.append(f"{len(lines)} lines were left out, such as {lines[0]}.")
    if worst := max(texts.values(), default=0):
        names = ", ".join(f"{name!r}" for name in sorted(texts) if texts[name] == worst)
        contents.remarks.append(f"{worst} lines with texts in place of numbers were left out: in {names[:80]}.")


def _rates(path: Path, layout: _Layout) -> dict[str, dict[str, float]]:
    """Return the columns of a table with numbers, each with its rate of new values per row, as a topic without name."""
    table = next(_batches(path, layout, {*layout.names}, [], lambda fraction: None), None)
    rates = {}
    for name in layout.names if table is not None else ():
        with contextlib.suppress(ImportLogError):
            values = _numbers(table, name, layout, Counter())
            rates[name] = float(np.mean(np.diff(values) != 0.0)) if len(values) > 1 else 0.0
    return {"": rates}
