"""What a law reports of thrusters and samples: isolations, and samples that it rejects."""

from __future__ import annotations

import numpy as np

from cosim.results.spans import Flags
from cosim.simulation.signals import Array

ISOLATED = "law.failed_thruster"  # column with the number of the thruster that was isolated last, 0 for none
DRAG = "law.drag"  # column with the estimated drag, relative to the vehicle's file
REJECTED = "law.rejected"  # column with the fraction of the samples so far that the law rejected


class Isolations:
    """Finds when thrusters are isolated and used again, block by block."""

    def __init__(self) -> None:
        # time [s], number of the thruster, and True if it is isolated, False if it is used again
        self.changes: list[tuple[float, int, bool]] = []
        self._isolated: list[int] = []  # in the order of their isolation

    def add(self, time: Array, isolated: Array) -> None:
        """Add the next rows of `ISOLATED`; time [s]."""
        known = np.isfinite(isolated)
        time, numbers = time[known], isolated[known].astype(int)
        before = self._isolated[-1] if self._isolated else 0
        for row in np.flatnonzero(np.diff(numbers, prepend=before)).tolist():
            when, number = float(time[row]), int(numbers[row])
            while self._isolated and self._isolated[-1] != number and (number in self._isolated or not number):
                self.changes.append((when, self._isolated.pop(), False))
            if number and number not in self._isolated:
                self._isolated.append(number)
                self.changes.append((when, number, True))


def rejects(fraction: Array, before: float) -> Flags:
    """Return where samples are rejected: where the fraction of rejected samples, shape (rows,), rises."""
    rises: Flags = fraction > np.append(before, fraction[:-1])  # no difference, which warns of infinities
    return rises
