"""Writes the record of a run: a Parquet file, and until it is complete, parts that can be read as well."""

from __future__ import annotations

import contextlib
import shutil
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.io.format_number import FORMAT
from cosim.results.record import PARTS, RECORD, part_files
from cosim.simulation.signals import Array, Column

_WHOLE = "whole"  # name of the complete record while it is written in the folder of the parts
_PART_SECONDS = 1.0  # s of wall-clock time, after which a part is written even if it is small
_PART_NUMBERS = 2**21  # greatest number of values in a part, 16 MiB, unless `rows_per_part` is given
_GROUP_NUMBERS = 2**22  # greatest number of values in a row group
_GROUP = 10_000  # greatest number of rows in the first row groups
_DOUBLED = 100  # groups after which their size doubles, since a reader needs a kilobyte per group and signal
_BLOCK = 250  # rows that are buffered before they are transposed to columns: they fit into processor caches
# measured: float64 columns compress best with byte stream split; dictionaries only cost time
_WRITING = {"compression": "zstd", "use_dictionary": False, "use_byte_stream_split": True, "write_statistics": False}


class Recorder:
    """Observer that records each step's row, in parts that stay readable after a kill."""

    # Ctrl-C may interrupt every call. So that the record has each row once, the bookkeeping is changed by single
    # assignment statements, and interrupted operations are repeated.

    def __init__(self, folder: Path, columns: Sequence[Column], rows_per_part: int | None = None) -> None:
        self._folder, self._schema = folder, _schema(columns)
        self._rows_per_part = rows_per_part or max(1, _PART_NUMBERS // len(columns))
        block = min(_BLOCK, self._rows_per_part)
        self._block: Array = np.empty((block, len(columns)))
        self._rows = [row.data for row in self._block]  # memoryviews: copying takes half the time of arrays
        self._filled = 0
        self._group = min(_GROUP, self._rows_per_part) // block * block  # rows of a row group
        self._largest = max(self._group, _GROUP_NUMBERS // len(columns) // block * block)  # bound of `_group`
        self._groups = 0  # number of complete groups
        self._columns: Array = np.empty((len(columns), self._group))
        self._transposed = 0  # number of rows of the present group, in `_columns`
        self._saved = 0  # number of these rows that are in a part already
        self._unsaved: list[pa.Table] = []  # rows of earlier groups that are in no part
        self._parts = 0
        (folder / PARTS).mkdir()
        self._whole: pq.ParquetWriter | None = None  # writer of the complete record, opened with the first group
        self._intact = True  # True: `_whole` has all earlier groups; False after an interrupted write
        self._is_complete = False  # True once the complete record is at its final path
        self._due = time.monotonic() + _PART_SECONDS
        self.rows = 0

    def observe(self, k: int, row: Array) -> None:
        """Record the row of step `k`, shape (columns,) of float64."""
        if self._filled == len(self._rows) or time.monotonic() > self._due:
            self._transpose()
        self._rows[self._filled][:] = row.data
        self._filled += 1
        self.rows += 1

    def close(self) -> None:
        """Write the remaining rows, and replace the parts by the complete record."""
        # After an error the parts hold all rows, and it may be called again.
        if not self._is_complete:
            try:
                self._conclude()
            except BaseException:
                self._rescue()
                raise
        shutil.rmtree(self._folder / PARTS, ignore_errors=True)

    # ---- from rows to columns ----

    def _transpose(self) -> None:
        """Transpose the rows of the block to columns, and write the group or part that is due."""
        self._transpose_block()
        if self._transposed == self._group:
            self._end_group()
        if time.monotonic() > self._due or self._unsaved_rows() + len(self._block) > self._rows_per_part:
            self._save()

    def _unsaved_rows(self) -> int:
        return _rows(self._unsaved) + self._transposed - self._saved

    def _transpose_block(self) -> None:
        if self._transposed + self._filled > self._group:
            self._end_group()
        n = self._transposed + self._filled
        self._columns[:, self._transposed : n] = self._block[: self._filled].T
        self._transposed, self._filled = n, 0

    def _table(self, first: int) -> pa.Table:
        """Return the rows of the present group from `first` on, as a table that shares the memory of the columns."""
        # not pa.array, which imports pandas where it is installed
        arrays = [
            pa.Array.from_buffers(pa.float64(), self._transposed - first, [None, pa.py_buffer(column)])
            for column in self._columns[:, first : self._transposed]
        ]
        return pa.Table.from_arrays(arrays, schema=self._schema)

    def _end_group(self) -> None:
        """Write the present group into the complete record, and begin the next one."""
        group, groups, intact = self._table(0), self._groups + 1, self._intact
        rows = min(2 * self._group, self._largest) if groups % _DOUBLED == 0 else self._group
        unsaved, columns = [*self._unsaved, group.slice(self._saved)], np.empty((len(self._columns), rows))
        self._intact, self._unsaved, self._columns, self._transposed, self._saved = False, unsaved, columns, 0, 0
        self._group, self._groups = rows, groups
        if intact:
            self._append(group)
            self._intact = True

    # ---- from columns to files ----

    def _save(self) -> None:
        """Write a part with the unsaved rows."""
        tables = [*self._unsaved, self._table(self._saved)]
        if _rows(tables):
            self._write_part(tables)
            self._parts, self._unsaved, self._saved = self._parts + 1, [], self._transposed
        self._due = time.monotonic() + _PART_SECONDS

    def _rescue(self) -> None:
        """Discard the complete record, and write the unsaved rows as parts, as far as the disk has room."""
        self._drop_whole()
        self._transpose_block()
        while self._unsaved:
            self._write_part(self._unsaved[:1])
            self._parts, self._unsaved = self._parts + 1, self._unsaved[1:]
        self._save()

    def _write_part(self, tables: Sequence[pa.Table]) -> None:
        part = self._folder / PARTS / f"{self._parts:06}.parquet"
        scratch = part.with_suffix(".tmp")
        try:
            pq.write_table(pa.concat_tables(tables), scratch, row_group_size=_GROUP, **_WRITING)
            scratch.replace(part)
        except BaseException:
            with contextlib.suppress(OSError):
                scratch.unlink()
            raise

    def _append(self, table: pa.Table) -> None:
        if self._whole is None:
            self._whole = pq.ParquetWriter(self._folder / PARTS / _WHOLE, self._schema, **_WRITING)
        self._whole.write_table(table)

    def _conclude(self) -> None:
        """Finish the complete record, and move it to its final path."""
        self._transpose_block()
        intact, self._intact = self._intact, False  # after an error here the record is written from the parts
        if not intact:
            self._append_parts()
        elif self._transposed:
            self._append(self._table(0))
        if self._whole is not None:
            self._whole.close()
        (self._folder / PARTS / _WHOLE).replace(self._folder / RECORD)
        self._is_complete = True

    def _append_parts(self) -> None:
        """Write the complete record again from all parts, after Ctrl-C or a full disk interrupted it."""
        self._drop_whole()
        self._save()
        tables: list[pa.Table] = []
        for file in part_files(self._folder):
            with pq.ParquetFile(file, pre_buffer=False) as part:
                for batch in part.iter_batches(self._group):
                    tables.append(pa.Table.from_batches([batch]))
                    if _rows(tables) >= self._group:
                        self._append(pa.concat_tables(tables).combine_chunks())
                        tables = []
        if tables:
            self._append(pa.concat_tables(tables).combine_chunks())

    def _drop_whole(self) -> None:
        self._intact = False
        if self._whole is not None:
            with contextlib.suppress(OSError, pa.ArrowException):
                self._whole.close()
            with contextlib.suppress(OSError):
                (self._folder / PARTS / _WHOLE).unlink()
            self._whole = None


def _rows(tables: Sequence[pa.Table]) -> int:
    return sum(table.num_rows for table in tables)


def _schema(columns: Sequence[Column]) -> pa.Schema:
    return pa.schema(
        [
            pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit, "description": c.description})
            for c in columns
        ],
        metadata={"format": str(FORMAT)},
    )
