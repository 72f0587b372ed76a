"""Small dense products without allocation: Numba calls BLAS for `@`, which costs more than they do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controller.compiled import compiled

Array = NDArray[np.float64]


@compiled
def product(A: Array, x: Array, out: Array) -> None:
    """Write A x into `out`."""
    for i in range(A.shape[0]):
        total = 0.0
        for j in range(A.shape[1]):
            total += A[i, j] * x[j]
        out[i] = total


@compiled
def norm(a: Array) -> float:
    """Return |a|."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * a[i]
    return float(np.sqrt(total))
