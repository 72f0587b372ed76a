"""Samples of a log on disk, one file for each source, so that memory is independent of the log's length."""

from __future__ import annotations

import math
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cosim.errors import ImportLogError
from cosim.logs.quantities import QUANTITIES
from cosim.simulation.signals import Array

BLOCK = 2**15  # samples that are processed together
_MAX_STAMP = 1e10  # s, 300 years
_MAX_PENDING = 2**14  # numbers of a source in memory before they go to disk


@dataclass
class Source:
    """Samples of one quantity from one message or column, in a file: two times, then the components."""

    # The first time [s] is the stamp of the sender, NaN without one. The second one is the time of writing.

    quantity: str
    name: str  # name of the message, topic or columns
    path: Path
    size: int  # number of components
    count: int = 0  # number of samples
    broken: int = 0  # number of omitted samples with a number that is not finite
    offset: float | None = None  # s, added to the times of writing, which then replace the stamps
    _pending: array[float] = field(default_factory=lambda: array("d"))

    def put(self, stamp: float, written: float, values: Sequence[float]) -> None:
        """Append a sample; count and omit one with a number that is not finite, drop an implausible stamp."""
        if not (math.isfinite(written) and all(map(math.isfinite, values))):
            self.broken += 1
            return
        stamp = stamp if abs(stamp) <= _MAX_STAMP else math.nan
        self._pending.extend((stamp, written, *values))
        self.count += 1
        if len(self._pending) > _MAX_PENDING:
            self.flush()

    def put_many(self, written: Array, values: Array) -> None:
        """Append samples without stamps: times of writing and values, shapes (n,) and (n, size)."""
        known = np.isfinite(written) & np.isfinite(values).all(axis=1)
        self.broken += int(np.count_nonzero(~known))
        rows = np.column_stack([np.full(len(written), np.nan), written, values])[known]
        self.flush()
        with self.path.open("ab") as file:
            rows.tofile(file)
        self.count += len(rows)

    def flush(self) -> None:
        """Write the buffer to disk."""
        if self._pending:
            with self.path.open("ab") as file:
                self._pending.tofile(file)
            self._pending = array("d")

    def blocks(self) -> Iterator[Array]:
        """Yield the samples in their order, each block of shape (n, 2 + size)."""
        self.flush()
        if not self.count:
            return
        width = 2 + self.size
        with self.path.open("rb") as file:
            while (block := np.fromfile(file, count=BLOCK * width)).size:
                rows = block.reshape(-1, width)
                if self.offset is not None:
                    rows[:, 0], rows[:, 1] = np.nan, rows[:, 1] + self.offset
                yield rows

    def rows(self, index: NDArray[np.int64]) -> Array:
        """Return the samples of indices, shape (n, 2 + size)."""
        self.flush()
        width, first = 2 + self.size, int(index.min())
        count = int(index.max()) + 1 - first
        samples = np.fromfile(self.path, count=count * width, offset=first * width * 8)
        return samples.reshape(-1, width)[index - first]


class LogContents:
    """Contents of a log, filled by a reader."""

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
        """Return the source of a name for a quantity; create it if there is none."""
        size = size or QUANTITIES[quantity].size
        if (quantity, name) not in self.sources:
            path = self._folder / f"{len(self.sources)}.samples"
            self.sources[quantity, name] = Source(quantity, name, path, size)
        source = self.sources[quantity, name]
        if source.size != size:
            raise ImportLogError(f"{name}: has {size} values, expected {source.size} as before")
        return source

    def put(self, quantity: str, name: str, stamp: float, written: float, values: Sequence[float]) -> None:
        """Append a sample of a quantity to its source, like `Source.put`."""
        self.source(quantity, name, len(values)).put(stamp, written, values)

    def put_parameter(self, name: str, value: float) -> None:
        """Store a parameter of the autopilot; omit one that is not finite."""
        if math.isfinite(value):
            self.parameters[name] = value

    def join(self, other: LogContents, offset: float) -> None:
        """Add the sources of another log of the run, with the time [s] that puts them on the clock of this one."""
        for (quantity, name), source in other.sources.items():
            source.offset = offset
            self.sources[quantity, name if (quantity, name) not in self.sources else f"{name} (2)"] = source
        self.unread += other.unread
        self.remarks += other.remarks
        self.parameters = other.parameters | self.parameters
        self.preferences = other.preferences | self.preferences
        self.frame, self.kind = self.frame or other.frame, self.kind or other.kind
        self.autopilot = self.autopilot or other.autopilot

    def best(self, quantity: str) -> Source | None:
        """Return the source to use for a quantity: the preferred one, else the one with most samples, or None."""
        sources = {s.name: s for s in self.sources.values() if s.quantity == quantity and s.count}
        preferred = (sources[name] for name in self.preferences.get(quantity, ()) if name in sources)
        return next(preferred, max(sources.values(), key=lambda source: source.count, default=None))


def handled_names(reader: type) -> frozenset[str]:
    """Return the names of the messages X that a class converts by a method ``_read_x``."""
    return frozenset(name.removeprefix("_read_").upper() for name in vars(reader) if name.startswith("_read_"))
