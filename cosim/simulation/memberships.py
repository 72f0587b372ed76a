"""How much each criterion asks for attention, from the clearances of its regions: for the master and the fused loop."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

import fuzzy_arbiter
from controller.jit.bound_call import BoundCall
from controller.jit.jit import inlined, jit_noalloc
from cosim.simulation.signals import Array
from fuzzy_arbiter import ramp

SOURCES = (
    Path(fuzzy_arbiter.__file__).parent,
    Path(__file__).parent,
)  # folders that the code of `compute_memberships` stands in
_ramp: Any = numba.njit(ramp)


@inlined
def compute_memberships(clearances: Array, criteria: NDArray[np.int64], width: float, memberships: Array) -> None:
    """Write the membership of each criterion, that of its most pressing region.

    Parameters
    ----------
    clearances : ndarray, shape (n,)
        Of each region [m], or [rad] of attitude; what is no number asks for nothing.
    criteria : ndarray of int, shape (n,)
        Of each region.
    width : float
        Where memberships reach 0 [m].
    memberships : ndarray, shape (criteria,)
        Receives them, in [0, 1].
    """
    for i in range(memberships.size):
        memberships[i] = 0.0
    for i in range(criteria.size):
        memberships[criteria[i]] = max(memberships[criteria[i]], _ramp(clearances[i], width))


class Memberships:
    """The memberships of a run's criteria, from clearances that change in place.

    Parameters
    ----------
    clearances : ndarray, shape (n,)
        As of `compute_memberships`; read at each call.
    criteria : ndarray of int, shape (n,)
        Of each region.
    width : float
        Where memberships reach 0 [m].
    count : int
        How many criteria.

    Attributes
    ----------
    width : float
        As given; may be set.
    """

    def __init__(self, clearances: Array, criteria: NDArray[np.int64], width: float, count: int) -> None:
        self.width = width
        self._clearances, self._criteria, self._values = clearances, criteria, np.zeros(count)
        self._compute = BoundCall(_compute)

    def compute(self) -> list[float]:
        """Return the membership of each criterion."""
        self._compute(self._clearances, self._criteria, self.width, self._values)
        values: list[float] = self._values.tolist()
        return values


def _compute(clearances: Array, criteria: NDArray[np.int64], width: float, memberships: Array) -> None:
    compute_memberships(clearances, criteria, width, memberships)


_compute = jit_noalloc(_compute, *SOURCES)
