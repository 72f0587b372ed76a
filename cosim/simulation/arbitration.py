"""The arbiter within a run: clearances in, memberships and weights out, into the row of the step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.compiling.function import CompiledFunction
from cosim.simulation.memberships import compute_memberships
from cosim.simulation.signals import Array
from fuzzy_arbiter import Arbiter


class Arbitration:
    """Decides by the clearances of the regions; arrays are read and written in place.

    Parameters
    ----------
    arbiter : Arbiter
        Of as many criteria as there are.
    clearances : ndarray, shape (n,)
        Of each region [m], or [rad] of attitude.
    criteria : ndarray of int, shape (n,)
        Of each region.
    ramp : float
        Clearance at which memberships reach 0 [m].
    memberships, weights : ndarray, shape (criteria,)
        Receive those of each criterion.

    Attributes
    ----------
    ramp : float
        As given; may be set.
    region_weights : ndarray, shape (n,)
        Weight of the criterion of each region.
    """

    def __init__(
        self,
        arbiter: Arbiter,
        clearances: Array,
        criteria: NDArray[np.int64],
        ramp: float,
        memberships: Array,
        weights: Array,
    ) -> None:
        self.ramp = ramp
        self.region_weights: Array = np.zeros(criteria.size)
        self._arbiter, self._clearances, self._criteria = arbiter, clearances, criteria
        self._memberships, self._weights = memberships, weights
        self._computed: Array = np.zeros(memberships.size)
        self._compute = CompiledFunction(compute_memberships)
        self._weighed: list[float] | None = None  # memberships that the weights are of

    def decide(self) -> None:
        """Write the memberships and their weights."""
        memberships = self._current()
        # the same memberships have the same weights, which stand in the row still
        if memberships != self._weighed:
            self._weighed = memberships
            self._memberships[:] = memberships
            self._weigh(memberships)

    def weigh(self) -> None:
        """Write the weights of the memberships that stand in the row."""
        self._weigh(self._memberships.tolist())

    def update_memberships(self) -> None:
        """Write the memberships, and leave the weights as they are."""
        self._memberships[:] = self._current()

    def _current(self) -> list[float]:
        self._compute(self._clearances, self._criteria, self.ramp, self._computed)
        memberships: list[float] = self._computed.tolist()
        return memberships

    def _weigh(self, memberships: list[float]) -> None:
        self._weights[:] = self._arbiter(memberships)
        self.region_weights[:] = self._weights[self._criteria]
