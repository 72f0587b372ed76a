"""The quadratic program of the barriers: the thruster forces nearest to the wanted ones that keep every barrier.

    minimise    1/2 (u - u0)^T H (u - u0) + 1/2 sum rho_i s_i^2
    subject to  a_i^T u + s_i >= b_i,   lower <= u <= upper

A barrier may give way by s_i at the price rho_i, so there is always a solution. Its dual has a multiplier for each barrier
and each limit and asks only that they be >= 0,

    minimise    1/2 y^T G y - d^T y,   y >= 0,   G = A H^-1 A^T + diag(1 / rho),   d = b - A u0,

which the active-set method of Lawson and Hanson (Solving Least Squares Problems, 1974, ch. 23) solves in finitely many
steps, each a Cholesky factor of the few rows that are active. It is written here, and not taken from a library, because
it must compile into the loop (a call of quadprog costs 7 us of which 1 us is work), allocate nothing and end after
a stated number of steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.compiled import compiled

Array = NDArray[np.float64]

_TOLERANCE = 1e-9  # of the greatest |d|, below which a row counts as kept


class Workspace(NamedTuple):
    """Where a program of up to r barriers and m thrusters is worked out."""

    rows: Array  # (r + 2 m, m) a_i, then +-1 rows of the limits
    right: Array  # (r + 2 m,) b_i
    price: Array  # (r + 2 m,) 1 / rho_i; 0 for the limits
    shaped: Array  # (r + 2 m, m) H^-1 a_i
    residual: Array  # (r + 2 m,) d
    multipliers: Array  # (r + 2 m,) y
    trial: Array  # (r + 2 m,)
    passive: NDArray[np.int64]  # (r + 2 m,) rows whose multiplier is free, in order of coming
    factor: Array  # (r + 2 m, r + 2 m) Cholesky factor of G over the passive rows
    wanted: Array  # (m,) u0


def workspace(barriers: int, thrusters: int) -> Workspace:
    """Return room for programs of a size.

    Parameters
    ----------
    barriers, thrusters : int
        How many at most.

    Returns
    -------
    Workspace
        All zero.
    """
    n = barriers + 2 * thrusters
    return Workspace(
        rows=np.zeros((n, thrusters)),
        right=np.zeros(n),
        price=np.zeros(n),
        shaped=np.zeros((n, thrusters)),
        residual=np.zeros(n),
        multipliers=np.zeros(n),
        trial=np.zeros(n),
        passive=np.zeros(n, dtype=np.int64),
        factor=np.zeros((n, n)),
        wanted=np.zeros(thrusters),
    )


@compiled
def solve(work: Workspace, barriers: int, inverse: Array, lower: Array, upper: Array, forces: Array) -> int:
    """Solve the program whose first `barriers` rows, right sides and prices stand in `work`, with u0 in `wanted`.

    Parameters
    ----------
    work : Workspace
        Holds the program; its multipliers hold the solution's afterwards.
    barriers : int
        How many rows count.
    inverse : ndarray, shape (m, m)
        H^-1, symmetric positive definite.
    lower, upper : ndarray, shape (m,)
        Limits [N].
    forces : ndarray, shape (m,)
        Receives u [N], within the limits.

    Returns
    -------
    int
        Steps taken; negative if the bound on steps ended the search, with the best forces so far.
    """
    m = forces.size
    n = barriers + 2 * m
    for j in range(m):
        above, below = barriers + 2 * j, barriers + 2 * j + 1
        work.rows[above, :], work.rows[below, :] = 0.0, 0.0
        work.rows[above, j], work.right[above], work.price[above] = 1.0, lower[j], 0.0
        work.rows[below, j], work.right[below], work.price[below] = -1.0, -upper[j], 0.0
    scale = 0.0
    for i in range(n):
        kept = 0.0
        for j in range(m):
            kept += work.rows[i, j] * work.wanted[j]
        work.residual[i] = work.right[i] - kept
        scale = max(scale, abs(work.residual[i]))
        work.multipliers[i] = 0.0
    for i in range(barriers):
        for j in range(m):
            total = 0.0
            for q in range(m):
                total += inverse[j, q] * work.rows[i, q]
            work.shaped[i, j] = total
    for j in range(m):
        for q in range(m):
            work.shaped[barriers + 2 * j, q] = inverse[j, q]
            work.shaped[barriers + 2 * j + 1, q] = -inverse[j, q]

    forces[:] = work.wanted
    count, steps, most = 0, 0, 3 * n
    while steps < most:
        # the row that is violated most, in the measure of its own length
        worst, at = _TOLERANCE * (1.0 + scale), -1
        for i in range(n):
            if work.multipliers[i] <= 0.0:
                lack = work.right[i]
                for j in range(m):
                    lack -= work.rows[i, j] * forces[j]
                if lack > worst and not _is_passive(work, count, i):
                    worst, at = lack, i
        if at < 0:
            break
        work.passive[count] = at
        count += 1
        # move to the minimum over the passive rows, dropping those whose multiplier would turn negative on the way
        while True:
            steps += 1
            if not _minimum(work, count):
                count -= 1  # it depends on those before it: leave it
                work.multipliers[at] = 0.0
                return -steps if steps else -1
            reach, drop = 1.0, -1
            for k in range(count):
                i = work.passive[k]
                if work.trial[k] <= 0.0:
                    part = work.multipliers[i] / (work.multipliers[i] - work.trial[k])
                    if part < reach or drop < 0:
                        reach, drop = min(part, reach), k
            for k in range(count):
                i = work.passive[k]
                work.multipliers[i] += reach * (work.trial[k] - work.multipliers[i])
            if drop < 0:
                break
            work.multipliers[work.passive[drop]] = 0.0
            for k in range(drop, count - 1):
                work.passive[k] = work.passive[k + 1]
            count -= 1
            if steps >= most:
                break
        for j in range(m):
            total = work.wanted[j]
            for k in range(count):
                i = work.passive[k]
                total += work.shaped[i, j] * work.multipliers[i]
            forces[j] = total
    for j in range(m):  # of the last bit
        forces[j] = min(max(forces[j], lower[j]), upper[j])
    return steps if steps < most else -steps


@compiled
def _is_passive(work: Workspace, count: int, row: int) -> bool:
    for k in range(count):
        if work.passive[k] == row:
            return True
    return False


@compiled
def _minimum(work: Workspace, count: int) -> bool:
    """Write the multipliers that minimise over the passive rows into `trial`; False if their rows are dependent."""
    m = work.wanted.size
    L = work.factor
    for a in range(count):
        i = work.passive[a]
        for b in range(a + 1):
            k = work.passive[b]
            total = 0.0
            for j in range(m):
                total += work.rows[i, j] * work.shaped[k, j]
            whole = total
            if a == b:
                total += work.price[i]
                whole = total
            for q in range(b):
                total -= L[a, q] * L[b, q]
            if a == b:
                if not total > 1e-12 * whole:
                    return False
                L[a, a] = np.sqrt(total)
            else:
                L[a, b] = total / L[b, b]
    for a in range(count):
        total = work.residual[work.passive[a]]
        for q in range(a):
            total -= L[a, q] * work.trial[q]
        work.trial[a] = total / L[a, a]
    for a in range(count - 1, -1, -1):
        total = work.trial[a]
        for q in range(a + 1, count):
            total -= L[q, a] * work.trial[q]
        work.trial[a] = total / L[a, a]
    return True
