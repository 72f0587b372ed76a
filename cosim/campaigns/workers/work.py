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


class Work(Protocol):
    """Rows 0 to ``len(work)`` - 1, and the task by which they are flown."""

    # The first column of the schema, a 64-bit integer, is the key of a row; keys rise with the rows.

    @property
    def name(self) -> str:
        """Name of the work, for the progress bar."""

    @property
    def unit(self) -> str:
        """Word for a row, such as ``"scene"``."""

    @property
    def task(self) -> Task:
        """The task by which rows are flown."""

    @property
    def schema(self) -> Any:
        """The pyarrow.Schema of the rows."""

    @property
    def plan(self) -> Mapping[str, Any]:
        """All inputs that determine the rows, for JSON."""

    @property
    def files(self) -> Mapping[str, bytes]:
        """Further files of the folder beside the plan, by name."""

    def __len__(self) -> int: ...

    def batch(self, rows: Rows) -> Any:
        """Return the picklable batch of some rows for a flyer."""

    def rows_of(self, keys: Rows) -> Rows:
        """Return the rows of some keys; -1 for a key that no row has."""

    def refused(self, row: int, reason: str) -> Any:
        """Return the table of one row that could not be flown."""
