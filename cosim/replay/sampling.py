"""Which rows of a record a page has: few enough to be small, and all that a reader looks for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cosim.signals import Array

_BYTES = 400_000  # of numbers, for the first minute
_BYTES_A_MINUTE = 150_000  # for each further one
_MOST_BYTES = 6_000_000
_PARTS = 100  # of the run, from each of which the extremes are kept


def sampled_rows(
    time: Array, columns: int, telling: Array, moments: NDArray[np.intp] | None = None
) -> NDArray[np.intp]:
    """Return the rows that a page has: evenly spaced ones, and the extremes between them of what tells the story.

    Parameters
    ----------
    time : ndarray, shape (steps,)
        Of the record [s].
    columns : int
        That the page has of each row.
    telling : ndarray, shape (steps, m)
        Signals whose extremes are kept.
    moments : ndarray of int, optional
        Steps at which something happened: they are kept, and the ones before them.

    Returns
    -------
    ndarray of int
        Rising; the first and the last step among them.
    """
    n = len(time)
    minutes = float(time[-1] - time[0]) / 60.0 if n > 1 else 0.0
    budget = min(_BYTES + _BYTES_A_MINUTE * max(0.0, minutes - 1.0), _MOST_BYTES)
    even = min(n, max(2, int(budget / (8 * columns))))
    keep = {int(i) for i in np.linspace(0, n - 1, even)}
    if moments is not None:
        keep |= {int(i) for i in np.concatenate([moments, moments - 1]) if 0 <= i < n}
    if even < n:
        for part in np.array_split(np.arange(n), min(_PARTS, even)):
            for signal in telling[part].T:
                if np.isfinite(signal).any():
                    keep |= {int(part[np.nanargmin(signal)]), int(part[np.nanargmax(signal)])}
    return np.array(sorted(keep), dtype=np.intp)
