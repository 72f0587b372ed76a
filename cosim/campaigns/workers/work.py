"""Interfaces of a campaign's work: numbered rows, and flyers that fly batches of them in any process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.int64]


class Flyer(Protocol):
    """Flies batches, one after the other, in the process in which it was created."""

    def fly(self, batch: Any) -> Any:
        """Fly a batch; return a pyarrow.Table of the work's schema with its rows in order."""

    def close(self) -> None:
        """Free the flyer's resources. May be called twice."""


class Task(Protocol):
    """The data that all rows of a campaign share: small, hashable, and picklable."""

    def flyer(self) -> Flyer:
        """Create a flyer."""


class Work:
    """Rows 0 to ``len(work)`` - 1, and the task by which they are flown."""

    name: str  # name for the progress bar
    unit: str  # word for a row, such as "scene"
    task: Task
    schema: Any  # pyarrow.Schema of the rows; its first column, a 64-bit integer, is the key, which rises with the rows
    plan: Mapping[str, Any]  # all inputs that determine the rows, for JSON
    files: Mapping[str, bytes] = {}  # further files of the folder, by name

    def __len__(self) -> int:
        raise NotImplementedError

    def batch(self, rows: Rows) -> Any:
        """Return the picklable batch of some rows for a flyer."""
        raise NotImplementedError

    def rows_of(self, keys: Rows) -> Rows:
        """Return the rows of some keys; -1 for a key that no row has."""
        return np.where((keys >= 0) & (keys < len(self)), keys, -1)

    def refused_table(self, row: int, reason: str) -> Any:
        """Return the table of one row that could not be flown."""
        raise NotImplementedError
