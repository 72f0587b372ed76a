"""How much each criterion asks for attention, from the clearances of its regions: for the master and the fused loop."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cosim.simulation.signals import Array
from fuzzy_arbiter import ramp


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
        memberships[criteria[i]] = max(memberships[criteria[i]], ramp(clearances[i], width))
