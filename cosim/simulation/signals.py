"""One row of signals: measurements, decisions and forces of a step in one array."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Column:
    """One recorded quantity."""

    name: str
    unit: str
    description: str


class Signals:
    """A row of float64 in which every group of signals is a view: a step writes into it, an observer copies it once."""

    def __init__(self, columns: Sequence[Column]) -> None:
        self.columns = tuple(columns)
        self.row: Array = np.zeros(len(self.columns))
        self._at = {column.name: i for i, column in enumerate(self.columns)}

    def __contains__(self, name: str) -> bool:
        return name in self._at

    def index(self, name: str) -> int:
        """Return the index of the column `name` in the row."""
        return self._at[name]

    def view(self, first: str, n: int) -> Array:
        """Return the `n` signals from the column `first` on, shape (n,), as a view into the row."""
        # Raise an IndexError if there are fewer.
        at = self._at[first]
        if at + n > len(self.row):
            raise IndexError(f"{n} signals from {first!r} on: the row ends after {len(self.row) - at}")
        return self.row[at : at + n]
