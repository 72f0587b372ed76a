"""Select the rows of a record for a page: a limited number, with extremes and events."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.results.extremes import even_edges, extreme_rows
from cosim.results.record import Rows
from cosim.simulation.signals import Array

_BYTES = 400_000  # of numbers, for the first minute
_BYTES_A_MINUTE = 150_000  # for each further one
MOST_BYTES = 6_000_000
FLYING_BYTES = 650_000  # most of a page that flies, whose own flight has more rows
_PARTS = 100  # most parts of the run, from each of which the extremes are kept
_OF_EXTREMES = 0.5  # most of the rows for extremes


def sampled_rows(
    record: Rows,
    columns: int,
    telling: Iterable[Sequence[Array]],
    signals: int,
    moments: NDArray[np.intp],
    most_bytes: int = MOST_BYTES,
) -> NDArray[np.intp]:
    """Return the rows of a page: evenly spaced ones, extremes of the main signals, and events.

    Parameters
    ----------
    record : Rows
        Record of the run, with its ``time`` [s].
    columns : int
        Number of columns of the page.
    telling : iterable of sequence of ndarray
        Signals whose extremes are kept, block by block of the record.
    signals : int
        Number of these signals.
    moments : ndarray of int
        Steps of events, which are kept with the steps before them.
    most_bytes : int
        Most bytes of numbers, however long the run.

    Returns
    -------
    ndarray of int
        Rising steps, including the first and the last.
    """
    n = len(record)
    minutes = (record.value("time", -1) - record.value("time", 0)) / 60.0
    budget = min(_BYTES + _BYTES_A_MINUTE * max(0.0, minutes - 1.0), most_bytes)
    most = max(2, int(budget / (8 * columns)))
    if n <= most:
        return np.arange(n)
    keep = {int(i) for i in np.concatenate([moments, moments - 1]) if 0 <= i < n}
    parts = int(np.clip(_OF_EXTREMES * most / (2 * max(1, signals)), 1, _PARTS))
    keep |= set(extreme_rows(telling, signals, even_edges(n, parts)).tolist())
    keep |= {int(i) for i in np.linspace(0, n - 1, max(2, most - len(keep)))}
    return np.array(sorted(keep), dtype=np.intp)
