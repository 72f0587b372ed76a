"""The quadratic program of barriers: the thruster forces nearest to the nominal ones that keep every barrier."""

#     minimize    1/2 (u - u0)^T H (u - u0) + 1/2 sum rho_i s_i^2
#     subject to  a_i^T u + s_i >= b_i,   lower <= u <= upper
#
# Slack s_i of a barrier costs rho_i, so there is always exactly one solution. Its dual has a multiplier for each
# barrier and each limit, and only the constraint y >= 0,
#
#     minimize    1/2 y^T G y - d^T y,   y >= 0,   G = A H^-1 A^T + diag(1 / rho),   d = b - A u0,
#
# which the active-set method of Lawson and Hanson (Solving Least Squares Problems, 1974, ch. 23) solves. It adds the
# row that is violated most, measured by sqrt(G_ii), and moves to the minimum over the passive rows, dropping those
# whose multiplier would turn negative. Each such minimum is below the one before, so that no set of rows occurs twice
# and the search ends. Rounding could still cause a cycle: a row that cannot be added, because it depends on the passive
# rows or its multiplier would not grow, is set aside until another one has moved the forces, and three steps a row end
# the search in any case.
#
# It is not taken from a library, because it must compile into the loop (a call of quadprog costs 7 us, of which 1 us is
# work), allocate nothing, and end after a known number of steps.

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import square
from controller.stack_array import Array, Shape, VectorM
from controller.state import State

Barriers = Annotated[Array, Shape("r")]
BarrierRows = Annotated[Array, Shape("r", "m")]
VectorK = Annotated[Array, Shape("k")]
Indices = Annotated[NDArray[np.int64], Shape("k")]
MappedRows = Annotated[Array, Shape("k", "m")]
Factor = Annotated[Array, Shape("k", "k")]

_TOLERANCE = 1e-11  # violation below which a row counts as kept, as a fraction of the greatest one at the start
_DEPENDENT = 1e-12  # remainder of a row beside the other rows, as a fraction of G_ii, below which it depends on them
_STEPS_A_ROW = 3  # maximum number of steps for each row
_HALF = 2.0**27 + 1.0  # splits the 53 bits of a number into two exact halves
_FREE, _PASSIVE, _ASIDE, _NOTHING = 0, 1, 2, 3  # state of a row: may be added, is passive, is set aside, moves no force


class Workspace(State):
    """Arrays for a program of up to r barriers and m thrusters, which has k = r + 2 m rows."""

    # The rows are the barriers in use, then the lower limits, then the upper ones.

    rows: BarrierRows  # a_i
    rhs: Barriers  # b_i
    price: Barriers  # 1 / rho_i
    mapped_rows: MappedRows  # H^-1 a_i
    size: VectorK  # sqrt(G_ii)
    residual: VectorK  # d
    multipliers: VectorK  # y
    trial: VectorK  # multipliers that minimize over the passive rows, in their order
    row_state: Indices  # state of each row
    passive: Indices  # rows whose multiplier is free, in order of addition
    factor: Factor  # Cholesky factor of G over the passive rows
    nominal: VectorM  # u0
    dual_force: VectorM  # N, A^T y
    refined: VectorM  # u after refinement


def empty_workspace(barriers: int, thrusters: int) -> Workspace:
    """Return a workspace for programs of a size."""
    return Workspace(r=barriers, m=thrusters, k=barriers + 2 * thrusters)


def solve(work: Workspace, barriers: int, inverse: Array, lower: Array, upper: Array, forces: Array) -> int:
    """Solve the program with `barriers` rows, right sides and prices in `work`, and with u0 in `nominal`."""
    # Units of arguments: lower, upper [N]; forces [N]
    n = barriers + 2 * forces.size
    tolerance = _TOLERANCE * _prepare(work, barriers, inverse, lower, upper)
    forces[:] = work.nominal
    count, steps, max_steps = 0, 0, _STEPS_A_ROW * n
    row = _most_violated(work, barriers, lower, upper, forces, tolerance)
    while row >= 0 and steps < max_steps:
        steps += 1
        work.passive[count] = row
        added = _append_factor_row(work, barriers, count)
        if added:
            _solve_passive(work, count + 1)
            added = work.trial[count] > 0.0
        if not added:
            work.row_state[row] = _ASIDE
            row = _most_violated(work, barriers, lower, upper, forces, tolerance)
            continue
        work.row_state[row] = _PASSIVE
        count += 1
        drop = _advance(work, count)
        while drop >= 0 and steps < max_steps:
            steps += 1
            count -= 1
            for k in range(drop, count):
                work.passive[k] = work.passive[k + 1]
            for k in range(drop, count):
                _append_factor_row(work, barriers, k)
            _solve_passive(work, count)
            drop = _advance(work, count)
        for j in range(forces.size):
            total = work.nominal[j]
            for k in range(count):
                total += work.mapped_rows[work.passive[k], j] * work.multipliers[work.passive[k]]
            forces[j] = total
        for i in range(n):
            if work.row_state[i] == _ASIDE:
                work.row_state[i] = _FREE
        row = _most_violated(work, barriers, lower, upper, forces, tolerance)
    if row < 0 and count > 0:
        _refine(work, barriers, count, inverse, lower, upper, forces)
    finite = _clip_to_limits(work, lower, upper, forces)
    return steps if row < 0 and finite else -steps


def _clip_to_limits(work: Workspace, lower: Array, upper: Array, forces: Array) -> bool:
    """Clip the forces to their limits; replace each that is not finite by its nominal one, and return False then."""
    finite = True
    for j in range(forces.size):
        if not np.isfinite(forces[j]):
            forces[j], finite = work.nominal[j], False
        forces[j] = min(max(forces[j], lower[j]), upper[j])  # rounding; more if the search was cut short
    if not finite:
        work.multipliers[:] = np.where(np.isfinite(work.multipliers), work.multipliers, 0.0)
    return finite


def _prepare(work: Workspace, barriers: int, inverse: Array, lower: Array, upper: Array) -> float:
    """Prepare all rows, none of them passive, and return the greatest |d_i| / sqrt(G_ii)."""
    m, scale = lower.size, 0.0
    work.nominal[:] = np.where(np.isfinite(work.nominal), work.nominal, 0.0)
    for i in range(barriers):
        if not np.isfinite(work.rhs[i] + work.price[i] + np.sum(work.rows[i])):
            work.rows[i, :], work.rhs[i], work.price[i] = 0.0, 0.0, 1.0
        work.mapped_rows[i] = inverse @ work.rows[i]
        squared_norm = work.rows[i] @ work.mapped_rows[i]
        work.residual[i] = work.rhs[i] - work.rows[i] @ work.nominal
        work.size[i] = np.sqrt(squared_norm + work.price[i])
        work.multipliers[i], work.row_state[i] = 0.0, _FREE
        if not squared_norm > 0.0:
            work.multipliers[i] = max(work.rhs[i], 0.0) / work.price[i] if work.price[i] > 0.0 else 0.0
            work.row_state[i] = _NOTHING
        else:
            scale = max(scale, abs(work.residual[i]) / work.size[i])
    for j in range(m):
        low, high = barriers + j, barriers + m + j
        work.mapped_rows[low] = inverse[j]
        work.mapped_rows[high] = -inverse[j]
        work.residual[low], work.residual[high] = lower[j] - work.nominal[j], work.nominal[j] - upper[j]
        for i in (low, high):
            work.size[i] = np.sqrt(inverse[j, j])
            work.multipliers[i], work.row_state[i] = 0.0, _FREE
            scale = max(scale, abs(work.residual[i]) / work.size[i])
    return scale


def _most_violated(work: Workspace, barriers: int, lower: Array, upper: Array, forces: Array, tolerance: float) -> int:
    """Return the free row that is violated most, -1 if none is by more than the tolerance."""
    m, worst, row = forces.size, tolerance, -1
    for i in range(barriers + 2 * m):
        if work.row_state[i] != _FREE:
            continue
        if i < barriers:
            lack = work.rhs[i]
            for j in range(m):
                lack -= work.rows[i, j] * forces[j]
        elif i < barriers + m:
            lack = lower[i - barriers] - forces[i - barriers]
        else:
            lack = forces[i - barriers - m] - upper[i - barriers - m]
        if lack > worst * work.size[i]:
            worst, row = lack / work.size[i], i
    return row


def _refine(
    work: Workspace, barriers: int, count: int, inverse: Array, lower: Array, upper: Array, forces: Array
) -> None:
    """Correct forces and multipliers of the passive rows by their residuals: iterative refinement."""
    # The conditions are u = u0 + H^-1 A^T y and A u + y / rho = b. Where rows contradict each other, A^T y is a million
    # times less than its terms, so that their rounding would show in the forces. The residuals are summed in twice the
    # precision; the correction itself is small, and does not need that.
    m, refined, finite = forces.size, work.refined, 0.0
    _sum_dual_force(work, barriers, count)
    for j in range(m):
        refined[j] = work.nominal[j]
        for q in range(m):
            refined[j] += inverse[j, q] * work.dual_force[q]
    for a in range(count):
        i = work.passive[a]
        work.residual[i] = _row_residual(work, barriers, i, lower, upper, refined)
    _solve_passive(work, count)
    for a in range(count):
        finite += work.trial[a]
        for j in range(m):
            refined[j] += work.mapped_rows[work.passive[a], j] * work.trial[a]
    for j in range(m):
        finite += refined[j]
    if not np.isfinite(finite):  # numbers too great
        return
    forces[:] = refined
    for a in range(count):
        i = work.passive[a]
        work.multipliers[i] = max(work.multipliers[i] + work.trial[a], 0.0)
        if barriers <= i < barriers + m:
            forces[i - barriers] = lower[i - barriers]
        elif i >= barriers + m:
            forces[i - barriers - m] = upper[i - barriers - m]


def _sum_dual_force(work: Workspace, barriers: int, count: int) -> None:
    """Write A^T y into `dual_force`, summed over the passive rows in twice the precision."""
    m, dual_force, remainders = work.nominal.size, work.dual_force, work.refined
    dual_force[:], remainders[:] = 0.0, 0.0
    for a in range(count):
        i = work.passive[a]
        y = work.multipliers[i]
        if i < barriers:
            for j in range(m):
                dual_force[j], remainders[j] = _add_product(dual_force[j], remainders[j], work.rows[i, j], y)
        else:
            j, sign = (i - barriers, 1.0) if i < barriers + m else (i - barriers - m, -1.0)
            dual_force[j], remainders[j] = _add_product(dual_force[j], remainders[j], sign, y)
    dual_force += remainders


def _row_residual(work: Workspace, barriers: int, i: int, lower: Array, upper: Array, forces: Array) -> float:
    """Return the residual of row i at these forces and its multiplier, summed in twice the precision."""
    m = forces.size
    if i >= barriers + m:
        return float(forces[i - barriers - m] - upper[i - barriers - m])
    if i >= barriers:
        return float(lower[i - barriers] - forces[i - barriers])
    total, rest = _add_product(work.rhs[i], 0.0, -work.price[i], work.multipliers[i])
    for j in range(m):
        total, rest = _add_product(total, rest, -work.rows[i, j], forces[j])
    return total + rest


def _add_product(total: float, rest: float, a: float, b: float) -> tuple[float, float]:
    """Return total + a b, rounded, and rest plus the rounding errors of product and sum."""
    # Both are exact, by Dekker, Veltkamp and Knuth: Ogita, Rump and Oishi, SIAM J. Sci. Comput. 26 (2005), 1955-1988.
    product = a * b
    wide_a, wide_b = _HALF * a, _HALF * b
    high_a, high_b = wide_a - (wide_a - a), wide_b - (wide_b - b)
    low_a, low_b = a - high_a, b - high_b
    of_product = ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b
    after = total + product
    there = after - total
    return after, rest + (of_product + ((total - (after - there)) + (product - there)))


def _append_factor_row(work: Workspace, barriers: int, a: int) -> bool:
    """Write row `a` of the Cholesky factor, of the passive row in that place; return False if it is dependent."""
    m, L, i = work.nominal.size, work.factor, work.passive[a]
    for b in range(a + 1):
        k = work.passive[b]
        if i < barriers:
            total = float(work.rows[i] @ work.mapped_rows[k])
        elif i < barriers + m:
            total = work.mapped_rows[k, i - barriers]
        else:
            total = -work.mapped_rows[k, i - barriers - m]
        if a == b and i < barriers:
            total += work.price[i]
        for q in range(b):
            total -= L[a, q] * L[b, q]
        if b < a:
            L[a, b] = total / L[b, b]
        else:
            least = _DEPENDENT * square(work.size[i])
            L[a, a] = np.sqrt(max(total, least))
            return bool(total > least)
    return False


def _solve_passive(work: Workspace, count: int) -> None:
    """Write the multipliers that minimize over the passive rows into `trial`."""
    L = work.factor
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


def _advance(work: Workspace, count: int) -> int:
    """Move the multipliers towards `trial` as far as all stay >= 0; return the place of the row that leaves, or -1."""
    reach, drop = 1.0, -1
    for k in range(count):
        if work.trial[k] <= 0.0:
            now = work.multipliers[work.passive[k]]
            part = now / (now - work.trial[k]) if now > 0.0 else 0.0
            if drop < 0 or part < reach:
                reach, drop = min(part, 1.0), k
    for k in range(count):
        i = work.passive[k]
        work.multipliers[i] = max(work.multipliers[i] + reach * (work.trial[k] - work.multipliers[i]), 0.0)
    if drop >= 0:
        work.multipliers[work.passive[drop]] = 0.0
        work.row_state[work.passive[drop]] = _FREE
    return drop
