"""Values of regions at one pose."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from controller.regions import Region, pack

Array = NDArray[np.float64]


def evaluate_regions(
    regions: Sequence[Region], position: Sequence[float] | Array, quaternion: Sequence[float]
) -> tuple[Array, Array, Array]:
    """Evaluate regions at a pose, at their positions at time 0; position [m, NED], returns (n,) [m]."""
    n = len(regions)
    values, gradients, rotation_gradients, clearances = np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    pose = np.array(position, dtype=float), np.array(quaternion, dtype=float)
    pack(regions).evaluate(*pose, values, gradients, rotation_gradients, clearances)
    return values, gradients, clearances
