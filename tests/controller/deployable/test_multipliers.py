"""The multipliers of the quadratic program against its equations solved in fractions, without any rounding."""

from fractions import Fraction

import numpy as np
import pytest

from controller.laws.deployable.quadratic_program import solve, workspace
from tests.controller.deployable.test_quadratic_program import program


def exact(numbers):
    return np.vectorize(Fraction)(np.asarray(numbers, dtype=float))


def solved(A, b):
    """Return the solution of A x = b, by Gauss's elimination."""
    rows = np.hstack([A, b[:, None]])
    for i in range(len(b)):
        rows[i] = rows[i] / rows[i, i]
        for k in range(len(b)):
            if k != i:
                rows[k] = rows[k] - rows[k, i] * rows[i]
    return rows[:, -1]


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["any", "parallel", "contradictory"])
def test_rounding_is_taken_back(kind):
    """(A H^-1 A^T + diag(rho)) y = b - A u0 over the rows that hold; without the last correction 1e-8 is missed."""
    rng, held = np.random.default_rng(5), 0
    for _ in range(25):
        thrusters, rows, right, price, wanted = program(rng, kind)
        count, m = rows.shape
        work, forces = workspace(count, m), np.empty(m)
        work.rows[:], work.right[:], work.price[:], work.wanted[:] = rows, right, price, wanted
        solve(work, count, thrusters.inverse, thrusters.lower, thrusters.upper, forces)
        holds = np.flatnonzero(work.multipliers > 0.0)
        if not len(holds):
            continue
        A = exact(np.vstack([rows, np.eye(m), -np.eye(m)])[holds])
        bounds = exact(np.r_[right, thrusters.lower, -thrusters.upper][holds])
        slack = np.diag(exact(np.r_[price, np.zeros(2 * m)][holds]))
        y = solved(A @ exact(thrusters.inverse) @ A.T + slack, bounds - A @ exact(wanted)).astype(float)
        assert work.multipliers[holds] == pytest.approx(y, abs=1e-11 * np.abs(y).max())
        held += len(holds)
    assert held > 80
