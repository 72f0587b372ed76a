"""Which region matters, as the weights and memberships of a record say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cosim.simulation.signals import Array


def active_regions(
    criteria: Sequence[int], memberships: Array, weights: Array, clearances: Array
) -> NDArray[np.float64]:
    """Return which region the arbiter gives way to.

    It is the most pressing region, that of the least clearance, of the criterion with the greatest weight; the goal
    where that criterion asks for no attention.

    Parameters
    ----------
    criteria : sequence of int
        Place of the criterion of each of the n secondary regions.
    memberships, weights : ndarray, shape (rows, criteria)
        Of each criterion.
    clearances : ndarray, shape (rows, n)
        Of the secondary regions [m or rad].

    Returns
    -------
    ndarray, shape (rows,)
        0 for the goal, i + 1 for the secondary region i.
    """
    rows = np.arange(len(weights))
    criterion = np.argmax(np.where(np.isnan(weights), -np.inf, weights), axis=1)
    of = np.array(criteria, dtype=int)
    if not of.size:
        return np.zeros(len(rows))
    belongs = of[None, :] == criterion[:, None]
    pressing = np.where(belongs & ~np.isnan(clearances), clearances, np.inf)
    asked = (memberships[rows, criterion] > 0.0) & np.isfinite(pressing).any(axis=1)
    return np.where(asked, np.argmin(pressing, axis=1) + 1, 0).astype(float)
