"""What a campaign flies, whatever it is: rows with numbers, and something that flies a batch of them anywhere."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.int64]


class Flyer(Protocol):
    """Flies batches, one after the other, in the process that has made it."""

    def fly(self, batch: Any) -> Any:
        """Return a pyarrow.Table of the work's schema, with a row for each of a batch in its order."""

    def close(self) -> None:
        """Free what it holds. May be called twice."""


class Task(Protocol):
    """What all rows of a campaign have in common: small, hashable, and can be pickled."""

    def flyer(self) -> Flyer:
        """Return a flyer of its own."""


class Work(Protocol):
    """Rows 0 to ``len(work)`` - 1, and how they are flown.

    The first column of the schema, a 64-bit integer, is the key of a row; keys rise with the rows.
    """

    @property
    def name(self) -> str:
        """What it is called, for the bar."""

    @property
    def unit(self) -> str:
        """What a row is called, such as ``"scene"``."""

    @property
    def task(self) -> Task:
        """How rows are flown."""

    @property
    def schema(self) -> Any:
        """The pyarrow.Schema of the rows."""

    @property
    def plan(self) -> Mapping[str, Any]:
        """All that the rows rest on, for JSON."""

    @property
    def files(self) -> Mapping[str, bytes]:
        """What the folder holds beside the plan, by name."""

    def __len__(self) -> int: ...

    def batch(self, rows: Rows) -> Any:
        """Return what a flyer needs to fly some rows; it can be pickled."""

    def rows_of(self, keys: Rows) -> Rows:
        """Return the rows that have some keys; -1 for a key that no row has."""

    def refused(self, row: int, reason: str) -> Any:
        """Return the table of one row that could not be flown."""
