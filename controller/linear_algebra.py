"""Small dense products without allocation: in the order in which they are written, as C adds them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def product(A: Array, x: Array, out: Array) -> None:
    """Write A x into `out`."""
    for i in range(A.shape[0]):
        total = 0.0
        for j in range(A.shape[1]):
            total += A[i, j] * x[j]
        out[i] = total


def copy(values: Array, out: Array) -> None:
    """Write values, shape (n,), into `out`. A loop compiles in a tenth of the time of a slice."""
    for i in range(out.size):
        out[i] = values[i]


def norm(a: Array) -> float:
    """Return |a|."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * a[i]
    return float(np.sqrt(total))


def invert_symmetric(A: Array) -> None:
    """Replace a symmetric positive definite matrix (n, n) by its inverse, symmetric to the last bit."""
    # A^-1 = L^-T L^-1 with the Cholesky factor A = L L^T, in the place of A's lower triangle.
    n = A.shape[0]
    for i in range(n):  # L
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = np.sqrt(total) if i == j else total / A[j, j]
    for i in range(n):  # L^-1
        for j in range(i):
            total = 0.0
            for k in range(j, i):
                total += A[i, k] * (1.0 / A[j, j] if k == j else A[k, j])
            A[i, j] = -total / A[i, i]
    for i in range(n):
        A[i, i] = 1.0 / A[i, i]
    for i in range(n):  # L^-T L^-1
        for j in range(i + 1):
            total = 0.0
            for k in range(i, n):
                total += A[k, i] * A[k, j]
            A[i, j] = total
            A[j, i] = total
