"""Time spans of a run in which a condition holds, found block by block."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.simulation.signals import Array

Flags = NDArray[np.bool_]
SETTLED_FOR = 10.0  # s, minimum time in the goal at the end of a run that counts as settled


@dataclass
class Span:
    """A time span in which a condition holds."""

    start: float  # s, first instant at which it holds
    end: float  # s, first instant at which it no longer holds; while it holds, the last instant so far
    least: float = np.nan  # minimum value of a signal in the span


class Spans:
    """Finds the spans in which a condition holds, from one block of rows to the next."""

    def __init__(self) -> None:
        self.open: Span | None = None

    def add(self, flags: Flags, time: Array, signal: Array | None = None) -> list[Span]:
        """Add the next rows, and return the spans that end in them; flags (rows,), time (rows,) [s], signal (rows,)."""
        completed = []
        edges = np.flatnonzero(np.diff(flags, prepend=self.open is not None)).tolist()
        for first, end in zip([0, *edges], [*edges, len(flags)], strict=True):
            if end == first:
                pass
            elif flags[first]:
                span = self.open = self.open or Span(float(time[first]), float(time[first]))
                span.end = float(time[end - 1])
                if signal is not None:
                    span.least = float(np.fmin(span.least, np.fmin.reduce(signal[first:end])))
            elif self.open is not None:
                self.open.end = float(time[first])
                completed.append(self.open)
                self.open = None
        return completed


def spans(flags: Flags, time: Array) -> list[tuple[float, float]]:
    """Return the spans [s] in which a condition holds, each up to the first instant at which it no longer does."""
    finder = Spans()
    ended = finder.add(flags, time)
    return [(span.start, span.end) for span in (*ended, *([finder.open] if finder.open else []))]
