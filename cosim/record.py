"""The record of a run: a Parquet file with a column for each signal and its unit in the metadata."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.errors import RunError
from cosim.signals import Array, Column

RECORD = "record.parquet"
_PARTS = "record.parts"  # what a killed run leaves


class Recorder:
    """Observer that writes each step's row, in parts that a killed run leaves readable.

    Parameters
    ----------
    folder : Path
        The run folder.
    columns : sequence of Column
        Of the rows that will come.
    rows_per_part : int
        A part is written when so many rows have come.

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
        self.rows = 0
        (folder / _PARTS).mkdir()

    def observe(self, k: int, row: Array) -> None:
        """Keep the row of step `k`."""
        if self._filled == len(self._block):
            self._flush()
        self._block[self._filled] = row
        self._filled += 1
        self.rows += 1

    def close(self) -> None:
        """Write what is left, and join the parts to one file."""
        self._flush()
        parts = _part_files(self._folder)
        scratch = self._folder / f".{RECORD}"
        with pq.ParquetWriter(scratch, self._schema, **_WRITING) as writer:
            for part in parts:
                writer.write_table(pq.read_table(part, schema=self._schema))
        scratch.replace(self._folder / RECORD)
        shutil.rmtree(self._folder / _PARTS)

    def _flush(self) -> None:
        if not self._filled:
            return
        columns = [pa.array(column) for column in np.ascontiguousarray(self._block[: self._filled].T)]
        part = self._folder / _PARTS / f"{self._parts:06}.parquet"
        scratch = part.with_suffix(".tmp")
        pq.write_table(pa.Table.from_arrays(columns, schema=self._schema), scratch, **_WRITING)
        scratch.replace(part)
        self._parts += 1
        self._filled = 0


# measured: bytes of a float64 column compress best when they are split by place, and dictionaries only cost
_WRITING = {"compression": "zstd", "use_dictionary": False, "use_byte_stream_split": True}


@dataclass(frozen=True, eq=False)
class Record:
    """A run's signals, each an array over its steps."""

    columns: Mapping[str, Array]  # by name, all of one length
    units: Mapping[str, str]  # by name

    def __getitem__(self, name: str) -> Array:
        """Return one signal, shape (steps,)."""
        return self.columns[name]

    def stack(self, names: Sequence[str]) -> Array:
        """Return several signals side by side, shape (steps, len(names))."""
        return np.column_stack([self.columns[name] for name in names])


def load_record(folder: Path) -> Record:
    """Read the record of a run, whether it was finished or killed.

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
    files = [folder / RECORD] if (folder / RECORD).exists() else _part_files(folder)
    if not files:
        raise RunError(f"{folder}: holds no record of a run")
    try:
        table = pa.concat_tables([pq.read_table(file) for file in files])
    except (OSError, pa.ArrowException) as error:
        raise RunError(f"{folder}: the record cannot be read: {error}") from error
    return Record(
        columns={name: table[name].to_numpy() for name in table.column_names},
        units={f.name: (f.metadata or {}).get(b"unit", b"").decode() for f in table.schema},
    )


def _part_files(folder: Path) -> list[Path]:
    return sorted((folder / _PARTS).glob("*.parquet"))


def _schema(columns: Sequence[Column]) -> pa.Schema:
    return pa.schema(
        [
            pa.field(c.name, pa.float64(), nullable=False, metadata={"unit": c.unit, "description": c.description})
            for c in columns
        ]
    )
