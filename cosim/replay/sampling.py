"""Select the rows of a record for a page: a limited number, with extremes and events."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.results.extremes import even_edges, extreme_rows
from cosim.results.record import Rows
from cosim.simulation.signals import Array

# bytes of numbers in a page
_BYTES = 400_000  # for the first minute
_BYTES_A_MINUTE = 150_000  # for each further minute
MAX_BYTES = 6_000_000
MAX_BYTES_INTERACTIVE = 650_000  # less, since the flight that the page itself simulates has more rows
_PARTS = 100  # maximum number of parts of the run, from each of which the extremes are kept
_EXTREME_ROWS = 0.5  # greatest part of the rows that are extremes


def sampled_rows(
    record: Rows,
    columns: int,
    extreme_signals: Iterable[Sequence[Array]],
    signals: int,
    moments: NDArray[np.intp],
    max_bytes: int = MAX_BYTES,
) -> NDArray[np.intp]:
    """Select the rows of a page: evenly spaced ones, extremes of the main signals, and events."""
    n = len(record)
    minutes = (record.value("time", -1) - record.value("time", 0)) / 60.0
    budget = min(_BYTES + _BYTES_A_MINUTE * max(0.0, minutes - 1.0), max_bytes)
    max_rows = max(2, int(budget / (8 * columns)))
    if n <= max_rows:
        return np.arange(n)
    keep = {int(i) for i in np.concatenate([moments, moments - 1]) if 0 <= i < n}
    parts = int(np.clip(_EXTREME_ROWS * max_rows / (2 * max(1, signals)), 1, _PARTS))
    keep |= set(extreme_rows(extreme_signals, signals, even_edges(n, parts)).tolist())
    keep |= {int(i) for i in np.linspace(0, n - 1, max(2, max_rows - len(keep)))}
    return np.array(sorted(keep), dtype=np.intp)
