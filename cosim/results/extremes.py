"""Which rows of a long run tell most of it: where signals are least and greatest, part by part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.results.record import Rows
from cosim.simulation.signals import Array


def extreme_rows(blocks: Iterable[Sequence[Array]], signals: int, edges: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the first rows at which signals are least and greatest in each part of a run.

    Parameters
    ----------
    blocks : iterable of sequence of ndarray
        The signals, each of shape (rows,), block by block of the run.
    signals : int
        How many they are.
    edges : ndarray of int, shape (parts + 1,)
        The first row of each part and the one behind the last, rising.

    Returns
    -------
    ndarray of int
        Rising. None of a signal in a part in which it has no finite number.
    """
    found = _Extremes(len(edges) - 1, signals)
    first = 0
    for block in blocks:
        end = first + len(block[0])
        inner = edges[np.searchsorted(edges, first, "right") : np.searchsorted(edges, end)]
        for a, b in zip([first, *inner], [*inner, end], strict=True):
            part = int(np.searchsorted(edges, a, "right")) - 1
            if 0 <= part < len(edges) - 1 and a < b:
                for i, signal in enumerate(block):
                    found.add((part, i), signal[a - first : b - first], a)
        first = end
    return np.unique(found.rows[:, found.finite])


class _Extremes:
    """The least and the greatest of each signal in each part."""

    def __init__(self, parts: int, signals: int) -> None:
        self._bounds = np.full((2, parts, signals), np.inf)  # of the greatest, minus it
        self.rows = np.full((2, parts, signals), -1, np.intp)
        self.finite = np.zeros((parts, signals), dtype=bool)

    def add(self, of: tuple[int, int], signal: Array, first: int) -> None:
        """Take the next rows of one signal in one part."""
        missing = np.isnan(signal)
        self.finite[of] |= np.isfinite(signal).any()
        for which, signed in enumerate((signal, -signal)):
            known = np.where(missing, np.inf, signed)  # NaN is neither the least nor the greatest
            at = int(np.argmin(known))
            if known[at] < self._bounds[which, *of] or self.rows[which, *of] < 0:
                self._bounds[which, *of], self.rows[which, *of] = known[at], first + at


def even_edges(rows: int, parts: int) -> NDArray[np.intp]:
    """Return where parts of a run begin, and its end; the first ones are a row longer where not all can be as long.

    Parameters
    ----------
    rows : int
        Of the run.
    parts : int
        At least one.

    Returns
    -------
    ndarray of int, shape (parts + 1,)
        As `numpy.array_split` has them.
    """
    size, longer = divmod(rows, parts)
    at = np.arange(parts + 1)
    edges: NDArray[np.intp] = at * size + np.minimum(at, longer)
    return edges


def rows_at(rows: Rows, times: Sequence[float]) -> NDArray[np.intp]:
    """Return the first row at or after each time, as many as there are rows for one that is behind the end.

    Parameters
    ----------
    rows : Rows
        With their ``time``, rising.
    times : sequence of float
        [s].

    Returns
    -------
    ndarray of int, shape (len(times),)
        From 0.
    """
    found = np.zeros(len(times), np.intp)
    for block in rows.blocks(["time"]):
        found += np.searchsorted(block["time"], times)
    return found
