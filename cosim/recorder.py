"""The record of a run, written: a Parquet file, and until it is whole, parts that can be read as well."""

from __future__ import annotations

import contextlib
import shutil
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.record import PARTS, RECORD, part_files
from cosim.signals import Array, Column

_WHOLE = "whole"  # among the parts, what a finished run makes of its rows
_PART_SECONDS = 1.0  # of the wall clock, after which a part is written even if it is small
_PART_NUMBERS = 2**23  # in a part at the most, unless another number of rows is asked for: 64 MiB
_GROUP = 10_000  # rows that go into the whole at once
_BLOCK = 250  # rows that wait to be turned into columns: as many as a processor's caches hold
# measured: bytes of a float64 column compress best when they are split by place, and dictionaries only cost
_WRITING = {"compression": "zstd", "use_dictionary": False, "use_byte_stream_split": True, "write_statistics": False}


class Recorder:
    """Observer that writes each step's row, in parts that a killed run leaves readable.

    Parameters
    ----------
    folder : Path
        The run folder.
    columns : sequence of Column
        Of the rows that will come.
    rows_per_part : int, optional
        The most in a part. One is written when there are about as many, or a second of the wall clock has passed.
        Default: as many as take 64 MiB.

    Attributes
    ----------
    rows : int
        That have come.
    """

    # Ctrl-C may come at every call. So that an interrupted run has each row once, what says where a row stands is
    # changed by assignments alone, side by side; and what was interrupted is done again.

    def __init__(self, folder: Path, columns: Sequence[Column], rows_per_part: int | None = None) -> None:
        self._folder, self._schema = folder, _schema(columns)
        self._rows_per_part = rows_per_part or max(1, _PART_NUMBERS // len(columns))
        block = min(_BLOCK, self._rows_per_part)
        self._group = min(_GROUP, self._rows_per_part) // block * block
        self._block: Array = np.empty((block, len(columns)))
        self._rows = [row.data for row in self._block]  # copied to in half the time of an array's row
        self._filled = 0
        self._columns: Array = np.empty((len(columns), self._group))
        self._turned = 0  # rows that stand in the columns already
        self._unsaved: list[pa.Table] = []  # in no part yet
        self._gathered: list[pa.Table] = []  # not in the whole yet
        self._parts = 0
        (folder / PARTS).mkdir()
        self._whole: pq.ParquetWriter | None = None  # what the record will be, begun with its first rows
        self._sound = True  # the whole has what it should have; not so once a write was cut off
        self._due = time.monotonic() + _PART_SECONDS
        self.rows = 0

    def observe(self, k: int, row: Array) -> None:
        """Keep the row of step `k`, shape (columns,) of float64.

        Raises
        ------
        OSError, pyarrow.ArrowException
            If rows that came before cannot be written. They are kept, and tried again with the next.
        """
        if self._filled == len(self._rows) or time.monotonic() > self._due:
            self._turn()
        self._rows[self._filled][:] = row.data
        self._filled += 1
        self.rows += 1

    def close(self) -> None:
        """Write what is left, and put the whole in the place of its parts; if that fails, these have all."""
        self._gather_block()
        self._gather_columns()
        try:
            if not self._sound:
                self._begin_anew()
            self._write_gathered()
            if self._whole is not None:
                self._whole.close()
            (self._folder / PARTS / _WHOLE).replace(self._folder / RECORD)
        except BaseException:
            self._save()
            raise
        shutil.rmtree(self._folder / PARTS)

    # ---- from rows to tables of columns ----

    def _turn(self) -> None:
        """Turn the rows of the block into columns, and write what is due."""
        self._gather_block()
        late = time.monotonic() > self._due
        if late or self._turned == self._group:
            self._gather_columns()
        if late or _rows(self._unsaved) + self._group > self._rows_per_part:
            self._save()
        if self._sound and _rows(self._gathered) >= self._group:
            self._write_gathered()

    def _gather_block(self) -> None:
        if self._turned + self._filled > self._group:
            self._gather_columns()
        n = self._turned + self._filled
        self._columns[:, self._turned : n] = self._block[: self._filled].T
        self._turned, self._filled = n, 0

    def _gather_columns(self) -> None:
        if self._turned:
            # not pa.array: that imports pandas where it is installed, for nothing
            columns = [
                pa.Array.from_buffers(pa.float64(), self._turned, [None, pa.py_buffer(column)])
                for column in self._columns[:, : self._turned]
            ]
            table = pa.Table.from_arrays(columns, schema=self._schema)
            unsaved, gathered, room = [*self._unsaved, table], [*self._gathered, table], np.empty_like(self._columns)
            self._unsaved, self._gathered, self._columns, self._turned = unsaved, gathered, room, 0

    # ---- from tables to files ----

    def _save(self) -> None:
        """Write a part of what is in none."""
        if self._unsaved:
            part = self._folder / PARTS / f"{self._parts:06}.parquet"
            scratch = part.with_suffix(".tmp")
            pq.write_table(pa.concat_tables(self._unsaved), scratch, **_WRITING)
            scratch.replace(part)
            self._parts, self._unsaved = self._parts + 1, []
        self._due = time.monotonic() + _PART_SECONDS

    def _write_gathered(self) -> None:
        """Write into the whole what is not in it."""
        if self._gathered:
            self._sound = False
            if self._whole is None:
                self._whole = pq.ParquetWriter(self._folder / PARTS / _WHOLE, self._schema, **_WRITING)
            self._whole.write_table(pa.concat_tables(self._gathered).combine_chunks())
            self._gathered, self._sound = [], True

    def _begin_anew(self) -> None:
        """Write the whole from its parts: Ctrl-C or a full disk came in the middle of it."""
        self._save()
        if self._whole is not None:
            with contextlib.suppress(OSError, pa.ArrowException):
                self._whole.close()
            self._whole = None
        self._gathered = []
        for part in part_files(self._folder):
            with pq.ParquetFile(part) as parquet:
                self._gathered.append(parquet.read())
            if _rows(self._gathered) >= self._group:
                self._write_gathered()


def _rows(tables: Sequence[pa.Table]) -> int:
    return sum(table.num_rows for table in tables)


def _schema(columns: Sequence[Column]) -> pa.Schema:
    return pa.schema(
        [
            pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit, "description": c.description})
            for c in columns
        ]
    )
