"""Writes the record of a run: an Arrow stream during the run, which becomes a Parquet file at its end."""

from __future__ import annotations

import io
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.io.format_number import FORMAT
from cosim.results.record import RECORD, STREAM, stream_batches
from cosim.simulation.signals import Array, Column
from plant_fmu.archive import atomic_file

_PERIOD = 1.0  # s of wall-clock time between two batches of the stream at most
_BATCH = 10_000  # maximum number of rows of a batch
_BATCH_VALUES = 2**21  # maximum number of values of a batch, 16 MiB
_GROUPS = 100  # row groups of a long record: a reader needs a kilobyte per group and signal
_GROUP_VALUES = 2**22  # maximum number of values of a row group
# measured: float64 columns compress best with byte stream split; dictionaries only cost time
_WRITING = {"compression": "zstd", "use_dictionary": False, "use_byte_stream_split": True, "write_statistics": False}


class Recorder:
    """Observer that records each step's row; what it has flushed can be read even after a kill."""

    # Ctrl-C may interrupt every call. So that the record has each row once, rows move from `_columns` to `_message` to
    # the file by single assignment statements, and an interrupted write is repeated from `_end`.

    def __init__(self, folder: Path, columns: Sequence[Column], batch_rows: int | None = None) -> None:
        self._folder, self._schema = folder, record_schema(columns)
        size = batch_rows or max(1, min(_BATCH, _BATCH_VALUES // len(columns)))
        self._columns: Array = np.empty((len(columns), size))
        self._filled = self._flushed = 0  # rows of the columns, and rows that they held before
        self._message = self._schema.serialize()  # bytes that the next write appends
        (folder / STREAM).touch(exist_ok=False)
        self._end = 0  # bytes of the complete messages in the file
        self._due = time.monotonic() + _PERIOD

    @property
    def rows(self) -> int:
        """Number of recorded rows."""
        return self._flushed + self._filled

    def observe(self, k: int, row: Array) -> None:
        """Record the row of step `k`, shape (columns,) of float64."""
        self.observe_block(k, row[None])

    def observe_block(self, first: int, rows: Array) -> None:
        """Record the rows of the steps from `first` on, shape (steps, columns) of float64."""
        size = self._columns.shape[1]
        for begin in range(0, len(rows), size):
            part = rows[begin : begin + size]
            if self._filled + len(part) > size or time.monotonic() > self._due:
                self._flush()
            n = self._filled + len(part)
            self._columns[:, self._filled : n] = part.T
            self._filled = n

    def close(self) -> None:
        """Write the remaining rows, and replace the stream by a Parquet file."""
        # after an error the stream keeps all rows for which the disk had space, and it may be called again
        if not (self._folder / RECORD).exists():
            self._flush()
            self._convert()
        (self._folder / STREAM).unlink(missing_ok=True)

    def _flush(self) -> None:
        """Append the rows of the columns to the stream."""
        self._write()
        if self._filled:
            columns = self._columns[:, : self._filled]
            # not pa.array, which imports pandas where it is installed
            arrays = [
                pa.Array.from_buffers(pa.float64(), self._filled, [None, pa.py_buffer(column)]) for column in columns
            ]
            message = pa.RecordBatch.from_arrays(arrays, schema=self._schema).serialize()
            self._message, self._flushed, self._filled = message, self.rows, 0
            self._write()
        self._due = time.monotonic() + _PERIOD

    def _write(self) -> None:
        """Append the message to the file, in place of what an interrupted or failed write has left of it."""
        if len(self._message):
            with io.FileIO(self._folder / STREAM, "r+") as file:
                file.truncate(self._end)
                file.seek(self._end)
                rest = memoryview(self._message)
                while rest:
                    rest = rest[file.write(rest) :]
            self._end, self._message = self._end + len(self._message), pa.py_buffer(b"")

    def _convert(self) -> None:
        """Write the rows of the stream to a Parquet file."""
        size = max(1, min(max(_BATCH, self.rows // _GROUPS), _GROUP_VALUES // len(self._schema)))
        # written by name: the writer's destructor would fail on a closed `file`
        with (
            stream_batches(self._folder / STREAM, is_mapped=False) as (_, batches),  # else all of it stays in memory
            atomic_file(self._folder / RECORD) as file,
            pq.ParquetWriter(file.name, self._schema, **_WRITING) as writer,
        ):
            for group in _groups(batches, size):
                writer.write_table(pa.Table.from_batches(group).combine_chunks())


def _groups(batches: Iterator[pa.RecordBatch], size: int) -> Iterator[list[pa.RecordBatch]]:
    """Yield successive batches together, each group of at least `size` rows but the last."""
    group: list[pa.RecordBatch] = []
    for batch in batches:
        group.append(batch)
        if sum(len(batch) for batch in group) >= size:
            yield group
            group = []
    if group:
        yield group


def record_schema(columns: Sequence[Column]) -> pa.Schema:
    """Return the Arrow schema of a record, with units and descriptions."""
    return pa.schema(
        [
            pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit, "description": c.description})
            for c in columns
        ],
        metadata={"format": str(FORMAT)},
    )
