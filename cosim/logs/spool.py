"""Samples of a log on disk, one file for each source, so that memory stays as it is however long the log is."""

from __future__ import annotations

import math
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cosim.errors import ImportLogError
from cosim.logs.quantities import QUANTITIES
from cosim.simulation.signals import Array

BLOCK = 2**15  # samples that are looked at together
_WAITING = 2**14  # numbers of a source in memory before they go to disk


@dataclass
class Source:
    """What one message or column of a log says of one quantity, in a file: two times, then the components.

    The first time [s] is the stamp of whoever measured, NaN where there is none. The second one is when the log's
    writer got it.
    """

    quantity: str
    name: str  # of the message, topic or columns
    path: Path
    size: int  # components
    count: int = 0
    broken: int = 0  # samples with a number that is none
    _waiting: array[float] = field(default_factory=lambda: array("d"))

    def put(self, stamp: float, written: float, values: Sequence[float]) -> None:
        """Append a sample; one with a number that is none is counted and left out."""
        if not (math.isfinite(written) and all(map(math.isfinite, values))):
            self.broken += 1
            return
        self._waiting.extend((stamp, written, *values))
        self.count += 1
        if len(self._waiting) > _WAITING:
            self.flush()

    def put_many(self, written: Array, values: Array) -> None:
        """Append samples with one time: shapes (n,) and (n, size)."""
        known = np.isfinite(written) & np.isfinite(values).all(axis=1)
        self.broken += int(np.count_nonzero(~known))
        rows = np.column_stack([np.full(len(written), np.nan), written, values])[known]
        self.flush()
        with self.path.open("ab") as file:
            rows.tofile(file)
        self.count += len(rows)

    def flush(self) -> None:
        """Write what waits."""
        if self._waiting:
            with self.path.open("ab") as file:
                self._waiting.tofile(file)
            self._waiting = array("d")

    def blocks(self) -> Iterator[Array]:
        """Yield the samples in their order, each block of shape (n, 2 + size)."""
        self.flush()
        if not self.count:
            return
        width = 2 + self.size
        with self.path.open("rb") as file:
            while (block := np.fromfile(file, count=BLOCK * width)).size:
                yield block.reshape(-1, width)


class LogContents:
    """What a reader finds in a log.

    Parameters
    ----------
    folder : Path
        For the files of the samples.

    Attributes
    ----------
    sources : dict
        By quantity and name.
    parameters : dict of str to float
        Of the autopilot, where the log has them.
    frame : str
        What the log calls the arrangement of the thrusters; empty where it does not say.
    autopilot : str
        Who flew, such as ``ardupilot``; empty where the log does not say.
    kind : str
        What it is of, where that is no underwater vehicle.
    unread : Counter
        Messages, topics or columns of which nothing is made, and how often each comes.
    remarks : list of str
        What a reader of the run must know.
    preferences : dict
        Of a quantity, the names of sources, the first one first.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.sources: dict[tuple[str, str], Source] = {}
        self.parameters: dict[str, float] = {}
        self.frame = ""
        self.autopilot = ""
        self.kind = ""
        self.unread: Counter[str] = Counter()
        self.remarks: list[str] = []
        self.preferences: dict[str, tuple[str, ...]] = {}

    def source(self, quantity: str, name: str, size: int | None = None) -> Source:
        """Return the source of a name for a quantity, new where there is none.

        Parameters
        ----------
        quantity : str
            One of `QUANTITIES`.
        name : str
            Of the message, topic or columns.
        size : int, optional
            How many components; default: as the quantity has.

        Raises
        ------
        ImportLogError
            If it had another size before.
        """
        found = self.sources.get((quantity, name))
        wanted = size or QUANTITIES[quantity].size
        if found is None:
            path = self._folder / f"{len(self.sources)}.samples"
            found = self.sources[quantity, name] = Source(quantity, name, path, wanted)
        if found.size != wanted:
            raise ImportLogError(f"{name}: has {wanted} values, expected {found.size} as before")
        return found

    def put(self, quantity: str, name: str, stamp: float, written: float, values: Sequence[float]) -> None:
        """Append a sample of a quantity, as `Source.put`."""
        self.source(quantity, name, len(values)).put(stamp, written, values)

    def best(self, quantity: str) -> Source | None:
        """Return the source to take for a quantity: the preferred one, else the one with the most samples."""
        found = {name: s for (q, name), s in self.sources.items() if q == quantity and s.count}
        preferred = next((name for name in self.preferences.get(quantity, ()) if name in found), None)
        if preferred is not None:
            return found[preferred]
        return max(found.values(), key=lambda source: source.count, default=None)
