"""Rows of a long run at which signals have their minima and maxima, part by part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.results.record import Rows
from cosim.simulation.signals import Array


def extreme_rows(blocks: Iterable[Sequence[Array]], signals: int, edges: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the rows at which each signal is first least and first greatest in each part of a run."""
    extremes = _Extremes(len(edges) - 1, signals)
    first = 0
    for block in blocks:
        end = first + len(block[0])
        inner = edges[np.searchsorted(edges, first, "right") : np.searchsorted(edges, end)]
        for a, b in zip([first, *inner], [*inner, end], strict=True):
            part = int(np.searchsorted(edges, a, "right")) - 1
            if 0 <= part < len(edges) - 1 and a < b:
                for i, signal in enumerate(block):
                    extremes.add((part, i), signal[a - first : b - first], a)
        first = end
    return np.unique(extremes.rows[:, extremes.finite])


class _Extremes:
    """The minimum and the maximum of each signal in each part."""

    def __init__(self, parts: int, signals: int) -> None:
        self._bounds = np.full((2, parts, signals), np.inf)  # minima, and negated maxima
        self.rows = np.full((2, parts, signals), -1, np.intp)
        self.finite = np.zeros((parts, signals), dtype=bool)

    def add(self, key: tuple[int, int], signal: Array, first: int) -> None:
        """Update the extremes of a (part, signal) by its next rows, the first of which has index `first`."""
        missing = np.isnan(signal)
        self.finite[key] |= np.isfinite(signal).any()
        for side, signed in enumerate((signal, -signal)):
            known = np.where(missing, np.inf, signed)  # NaN is neither the least nor the greatest
            i = int(np.argmin(known))
            if known[i] < self._bounds[side, *key] or self.rows[side, *key] < 0:
                self._bounds[side, *key], self.rows[side, *key] = known[i], first + i


def even_edges(rows: int, parts: int) -> NDArray[np.intp]:
    """Return the edges of parts of equal length of a run; the first parts are one row longer if needed."""
    size, longer = divmod(rows, parts)
    part = np.arange(parts + 1)
    edges: NDArray[np.intp] = part * size + np.minimum(part, longer)
    return edges


def rows_at(rows: Rows, times: Sequence[float]) -> NDArray[np.intp]:
    """Return the index of the first row at or after each time; the number of rows for a time after the end."""
    # Units of arguments: times [s]
    indices = np.zeros(len(times), np.intp)
    for block in rows.blocks(["time"]):
        indices += np.searchsorted(block["time"], times)
    return indices
