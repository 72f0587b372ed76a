"""Rows on disk during a campaign: an append-only Arrow stream of each session, joined in order of key at the end."""

from __future__ import annotations

import contextlib
import logging
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from cosim.campaigns.store.results import to_array, to_column
from cosim.campaigns.workers.work import Rows
from cosim.errors import RunError
from plant_fmu.archive import atomic_file

log = logging.getLogger(__name__)

_GROUP = 65536  # number of rows that are joined at once


class RowLog:
    """The tables of a campaign in a folder: a file for each session, to which the session appends."""

    # A killed session leaves at most one incomplete table, the last of its file. So each session begins a new file.

    def __init__(self, folder: Path, schema: Any) -> None:
        self._folder, self._schema = folder, schema
        self._file: Any = None
        folder.mkdir(exist_ok=True)

    def add(self, table: Any) -> None:
        """Append a table, and pass it to the system, so that it survives a kill."""
        if self._file is None:
            number = max((int(file.stem) for file in self._files()), default=-1) + 1
            self._file = (self._folder / f"{number:06}.arrows").open("wb")
            self._stream = pa.ipc.new_stream(self._file, self._schema)
        self._stream.write_table(table)
        self._file.flush()  # of a buffered file: PyArrow does not look whether a raw one has written all

    def close(self) -> None:
        """Close the file of this session. May be called twice."""
        if self._file is not None:
            with contextlib.suppress(OSError):  # `add` has raised it
                self._file.close()
            self._file = None

    def keys(self) -> Rows:
        """Return the keys of all complete rows, shape (n,), in rising order."""
        keys = np.sort(
            np.concatenate([np.empty(0, np.int64), *(np.from_dlpack(batch[0]) for batch in self._batches())])
        )
        if (np.diff(keys) == 0).any():
            raise RunError(f"{self._folder}: holds row {keys[np.argmin(np.diff(keys))]} twice, expected each row once")
        return keys

    def table(self) -> Any:
        """Return all complete rows in order of key, a pyarrow.Table."""
        return pa.Table.from_batches(self._batches(), self._schema).sort_by(self._schema.names[0])

    def join(self, path: Path) -> None:
        """Write all rows to one Parquet file in order of key."""
        key, keys = self._schema.names[0], self.keys()
        batches = [(pc.min_max(batch[0]).as_py(), batch) for batch in self._batches()]
        with atomic_file(path) as file, pq.ParquetWriter(file, self._schema, compression="zstd") as writer:
            for i in range(0, len(keys), _GROUP):
                low, high = keys[i], keys[i : i + _GROUP][-1]
                near = [batch for span, batch in batches if span["min"] <= high and span["max"] >= low]
                table = pa.Table.from_batches(near, self._schema)
                near_keys = to_array(table[key])
                order = np.argsort(near_keys)
                rows = order[np.isin(near_keys[order], keys[i : i + _GROUP])]
                writer.write_table(table.take(to_column(pa.int64(), rows)))

    def remove(self) -> None:
        """Remove the folder."""
        self.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _files(self) -> list[Path]:
        return sorted(file for file in self._folder.glob("*.arrows") if file.stem.isdecimal())

    def _batches(self) -> Iterator[Any]:
        """Yield the tables of all sessions as record batches, whose memory is that of the files."""
        for file in self._files():
            try:
                with pa.memory_map(str(file)) as content:
                    for batch in pa.ipc.open_stream(content):
                        if not batch.schema.equals(self._schema):
                            raise pa.ArrowInvalid("its columns are not those of the campaign")
                        batch.validate(full=True)  # a damaged length would be read beyond the file's end
                        if len(batch):
                            yield batch
            except (pa.ArrowException, OSError) as error:
                log.warning("%s: its end cannot be read (%s); the rows there are flown again", file, error)
