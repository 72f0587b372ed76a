"""Rows on disk during a campaign: a part for each batch, merged to bound the number of parts."""

from __future__ import annotations

import itertools
import logging
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from cosim.campaigns.workers.work import Rows
from cosim.errors import RunError
from plant_fmu.archive import atomic_file

log = logging.getLogger(__name__)

MERGED = 64  # number of parts of about one size that are merged
_CHUNK = 8192  # number of rows that are read at once from a part
_GROUP = 65536  # least number of rows of a row group, except the last
_NAME = re.compile(r"[0-9]{8,}-[0-9]{8,}\.parquet")


class Parts:
    """Parquet files of one schema in a folder, each written atomically."""

    # The name of a part is the range of its batches, `00000003-00000003`, or `00000000-00000063` for a merged one. A
    # kill after merging and before the removal of the sources leaves both, which the names show.

    def __init__(self, folder: Path, schema: Any) -> None:
        self._folder, self._schema = folder, schema
        folder.mkdir(exist_ok=True)
        for scratch in folder.glob(".*"):  # incomplete parts
            scratch.unlink()
        self._files: list[Path] = []
        parts = [file for file in folder.glob("*.parquet") if _NAME.fullmatch(file.name)]  # other files are ignored
        for file in sorted(parts, key=lambda file: (_span(file)[0], -_span(file)[1])):
            if self._files and _span(file)[1] <= _span(self._files[-1])[1]:
                file.unlink()
            else:
                self._files.append(file)
        self._next = _span(self._files[-1])[1] + 1 if self._files else 0

    def keys(self) -> Rows:
        """Return the keys of all rows, shape (n,)."""
        # Parts that cannot be read, or that hold a row of another part, are removed.
        found: list[Rows] = []
        for file in tuple(self._files):
            try:
                found.append(_keys(file, self._schema))
            except RunError as error:
                log.warning("%s; its rows are flown again", error)
                self._drop(file)
        keys = np.concatenate([np.empty(0, dtype=np.int64), *found])
        if len(np.unique(keys)) == len(keys):
            return keys
        keys = keys[:0]
        for file, of in zip(tuple(self._files), found, strict=True):
            if np.isin(of, keys).any():
                log.warning("%s: holds rows that another part holds; it is removed", file)
                self._drop(file)
            else:
                keys = np.concatenate([keys, of])
        return keys

    def _drop(self, file: Path) -> None:
        file.unlink()
        self._files.remove(file)

    def add(self, table: Any) -> None:
        """Write a part."""
        file = self._folder / f"{self._next:08}-{self._next:08}.parquet"
        write_tables(file, [table], self._schema)
        self._files.append(file)
        self._next += 1
        level = 0
        while len(alike := self._last_of(level)) >= MERGED:
            self._merge(alike)
            level += 1

    def _last_of(self, level: int) -> list[Path]:
        """Return the last files that were merged `level` times."""
        return list(itertools.takewhile(lambda file: _level(file) == level, reversed(self._files)))[::-1]

    def _merge(self, files: list[Path]) -> None:
        merged = self._folder / f"{_span(files[0])[0]:08}-{_span(files[-1])[1]:08}.parquet"
        write_tables(merged, in_order(files, self._schema), self._schema)
        self._files[-len(files) :] = [merged]
        for file in files:
            file.unlink()

    def table(self) -> Any:
        """Return all rows in order of key, a pyarrow.Table; parts that cannot be read are removed."""
        self.keys()
        return pa.concat_tables([self._schema.empty_table(), *in_order(self._files, self._schema)])

    def join(self, path: Path) -> None:
        """Write all rows to one file in order of key."""
        write_tables(path, in_order(self._files, self._schema), self._schema)

    def remove(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self._folder, ignore_errors=True)


def _span(file: Path) -> tuple[int, int]:
    first, _, last = file.stem.partition("-")
    return int(first), int(last)


def _level(file: Path) -> int:
    """Return the number of times that a part was merged."""
    first, last = _span(file)
    level, batches = 0, last - first + 1
    while batches >= MERGED:
        level, batches = level + 1, batches // MERGED
    return level


def _keys(file: Path, schema: Any) -> Any:
    """Return the keys of a part, after reading all of it, so that damage is found before parts are joined."""
    try:
        check_schema(file, schema)
        with pq.ParquetFile(file) as parquet:
            found = [np.from_dlpack(batch.column(0)) for batch in parquet.iter_batches(_CHUNK)]
    except (OSError, pa.ArrowException, BufferError) as error:
        raise RunError(f"{file}: cannot be read: {error}") from error
    keys = np.concatenate([np.empty(0, dtype=np.int64), *found])
    if not len(keys) or (np.diff(keys) <= 0).any():
        raise RunError(f"{file}: cannot be read: its rows are not in order, or there are none")
    return keys


def _type(schema: Any, name: str) -> str:
    """Describe the type of a column."""
    field = schema.field(name)
    return f"{field.type}{', perhaps null' if field.nullable else ''}"


def check_schema(file: Path, schema: Any) -> None:
    """Raise a RunError that names the first column in which a Parquet file differs from a schema."""
    found = pq.read_schema(file)
    if found.equals(schema):
        return
    for field in schema:
        if found.names.count(field.name) != 1:
            there = "two columns" if field.name in found.names else "no column"
            raise RunError(f"{file}: cannot be read: has {there} {field.name!r}, expected one")
        if not found.field(field.name).equals(field):
            holds, expected = _type(found, field.name), _type(schema, field.name)
            raise RunError(f"{file}: cannot be read: column {field.name!r} holds {holds}, expected {expected}")
    odd = next((name for name in found.names if name not in schema.names), found.names[0])
    raise RunError(f"{file}: cannot be read: column {odd!r} is not expected there")


def write_tables(path: Path, tables: Any, schema: Any) -> None:
    """Write tables to one Parquet file atomically."""
    with atomic_file(path) as file, pq.ParquetWriter(file, schema, compression="zstd") as writer:
        for table in _grouped(tables):
            writer.write_table(table)


def _grouped(tables: Any) -> Iterator[Any]:
    """Concatenate small tables to larger ones."""
    waiting: list[Any] = []
    rows = 0
    for table in tables:
        waiting.append(table)
        rows += len(table)
        if rows >= _GROUP:
            yield pa.concat_tables(waiting)
            waiting, rows = [], 0
    if waiting:
        yield pa.concat_tables(waiting)


def in_order(files: Sequence[Path], schema: Any) -> Iterator[Any]:
    """Merge the rows of sorted files in order of key; only files with overlapping keys are open at a time."""
    key = schema.names[0]
    closed = sorted(((_least(file), file) for file in files), reverse=True)
    open_files: list[_Reader] = []
    while closed or open_files:
        if not open_files:
            open_files.append(_Reader(closed.pop()[1], schema))
        # all rows up to the bound are loaded: unread rows have greater keys
        bound = min(reader.last for reader in open_files)
        while closed and closed[-1][0] <= bound:
            open_files.append(_Reader(closed.pop()[1], schema))
            bound = min(bound, open_files[-1].last)
        yield pa.concat_tables([reader.up_to(bound) for reader in open_files]).sort_by(key)
        open_files = [reader for reader in open_files if reader.more]


def _least(file: Path) -> int:
    with pq.ParquetFile(file) as parquet:
        return int(next(parquet.iter_batches(1, columns=parquet.schema_arrow.names[:1])).column(0)[0].as_py())


class _Reader:
    """A file that is read chunk by chunk."""

    def __init__(self, file: Path, schema: Any) -> None:
        self._file = pq.ParquetFile(file)
        self._schema = schema
        self._chunks = self._file.iter_batches(_CHUNK)
        self._load()

    def _load(self) -> None:
        chunk = next(self._chunks, None)
        self.more = chunk is not None
        if chunk is None:
            self._file.close()
        else:
            self._table = pa.Table.from_batches([chunk]).cast(self._schema)
            self._keys = np.from_dlpack(chunk[0])  # not to_numpy: see `cosim.campaigns.store.columns`
            self.last = int(self._keys[-1])

    def up_to(self, bound: int) -> Any:
        """Return the loaded rows up to a key, and load the next chunk if none are left."""
        n = int(np.searchsorted(self._keys, bound, side="right"))
        rows, self._table, self._keys = self._table.slice(0, n), self._table.slice(n), self._keys[n:]
        if not len(self._keys):
            self._load()
        return rows
