"""What regions are at one position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from controller.regions import Region, pack

Array = NDArray[np.float64]


def evaluated(regions: Sequence[Region], position: Sequence[float] | Array) -> tuple[Array, Array, Array]:
    """Return what regions are at a position, as they are at time 0.

    Parameters
    ----------
    regions : sequence of Region
        n of them.
    position : sequence of float
        [m, NED].

    Returns
    -------
    tuple of ndarray
        Values, shape (n,), gradients, shape (n, 3), clearances, shape (n,) [m].
    """
    n = len(regions)
    result = np.empty(n), np.empty((n, 3)), np.empty(n)
    pack(regions).evaluate(np.array(position, dtype=float), *result)
    return result
