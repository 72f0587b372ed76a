"""The quadratic program solved exactly in fractions, with bounds of rounding errors."""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

ROUNDING = 2.0**-53  # of a number, at most


class Exact(NamedTuple):
    """The one solution, in fractions."""

    forces: np.ndarray  # (m,) u
    multipliers: np.ndarray  # (r + 2 m,) y
    pull: np.ndarray  # (m,) A^T y, of barriers and limits


def in_fractions(numbers):
    """Return numbers as fractions: each float is one."""
    numbers = np.asarray(numbers, dtype=float)
    return np.array([Fraction(x) for x in numbers.ravel()] + [None], dtype=object)[:-1].reshape(numbers.shape)


def solved(A, b):
    """Return the solution of A x = b, A positive definite, by Bareiss's elimination in whole numbers."""
    scale = math.lcm(*(x.denominator for x in A.ravel()), *(x.denominator for x in b))
    rows = [[int(x * scale) for x in (*row, right)] for row, right in zip(A, b, strict=True)]
    n, before = len(rows), 1
    for k in range(n):
        for i in range(k + 1, n):
            first = rows[i][k]
            for j in range(k, n + 1):
                rows[i][j] = (rows[k][k] * rows[i][j] - first * rows[k][j]) // before
        before = rows[k][k]
    x = [Fraction(0)] * n
    for i in reversed(range(n)):
        x[i] = Fraction(rows[i][n] - sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return x


def exact_solution(thrusters, rows, right, price, wanted, start):
    """Return the solution, by the method of Lawson and Hanson, which begins with the rows whose `start` is above zero.

    It is the solution whatever the start: at the end the conditions of Kuhn and Tucker hold to the last digit, and the
    program is strictly convex.
    """
    m = len(wanted)
    A = in_fractions(np.vstack([rows, np.eye(m), -np.eye(m)]))
    b, price = (
        in_fractions(np.r_[right, thrusters.lower, -thrusters.upper]),
        in_fractions(np.r_[price, np.zeros(2 * m)]),
    )
    inverse, u0 = in_fractions(thrusters.inverse), in_fractions(wanted)
    assert np.array_equal(inverse, inverse.T)
    shaped, d = A @ inverse, b - A @ u0
    sizes = np.sum(shaped * A, axis=1) + price
    y, passive = 0 * b, list(np.flatnonzero(start > 0.0))
    y[passive] = Fraction(1)  # as good as any
    while True:
        while passive:
            G = shaped[passive] @ A[passive].T + np.diag(price[passive])
            trial = solved(G, d[passive])
            back = [k for k in range(len(passive)) if trial[k] <= 0]
            reach = min((y[passive[k]] / (y[passive[k]] - trial[k]) for k in back), default=Fraction(1))
            for i, end in zip(passive, trial, strict=True):
                y[i] += reach * (end - y[i])
            if not back:
                break
            passive = [i for i in passive if y[i] > 0]
        pull = A.T @ y
        u = u0 + inverse @ pull
        lack = b - A @ u - price * y
        if not any(lack > 0):
            break
        passive.append(max(np.flatnonzero(lack > 0), key=lambda i: lack[i] ** 2 / sizes[i]))
    assert all(y >= 0) and all(lack[y > 0] == 0)
    return Exact(u, y, pull)


def error(numbers, exact_ones):
    """Return |numbers - exact ones|."""
    return np.abs((in_fractions(numbers) - exact_ones).astype(float))


def rounding(thrusters, wanted, pull, roundings):
    """Return by how much forces may be off where u0 + H^-1 p was so often rounded: |e|_H = sqrt(e^T H e).

    Each of the terms is off by a share of 2^-53 each time, so their sum by no more than

        e = roundings 2^-53 (|u0| + |H^-1| |p|).

    Then forces and multipliers are corrected by what the active rows lack of u = u0 + e + H^-1 A^T y, A u + P y = b:

        G dy = -A e,   du = e + H^-1 A^T dy,   G = A H^-1 A^T + P.

    From that follow |dy|_G <= |e|_H and |du|_H <= |e|_H, and for a single one, by Cauchy and Schwarz,
    |du_j| <= sqrt((H^-1)_jj) |e|_H and |dy_i| <= sqrt((G^-1)_ii) |e|_H.

    Parameters
    ----------
    thrusters : Thrusters
        Whose `inverse` is H^-1.
    wanted, pull : ndarray, shape (m,)
        u0 [N], and |A^T y| where its terms, of which most cancel, were summed without loss; else |A|^T y.
    roundings : int
        Of each term.
    """
    e = roundings * ROUNDING * (np.abs(wanted) + np.abs(thrusters.inverse) @ pull)
    return np.sqrt(e @ np.abs(np.linalg.inv(thrusters.inverse)) @ e)
