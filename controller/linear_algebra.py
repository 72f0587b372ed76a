"""Products and inverses of small vectors and matrices, in the order in which they are written."""

from __future__ import annotations

import math

import numpy as np

from controller.stack_array import Array, Vector3, array


def cross(a: Vector3, b: Vector3) -> Vector3:
    """Return a x b."""
    return array(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a: Array) -> float:
    """Return |a|."""
    return math.sqrt(a @ a)


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
