"""The quadratic program against quadprog and the conditions that its solution fulfils."""

from fractions import Fraction

import numpy as np
import pytest

from controller.compiling.function import BoundCall
from controller.laws.deployable.model import make_thrusters, reallocate
from controller.quadratic_program import _add_product, _row_residual, _sum_dual_force, empty_workspace, solve
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu.vehicle import load_vehicle

quadprog = pytest.importorskip("quadprog")
MODELS = {name: vehicle_model(load_vehicle(name)) for name in ("odin", "bluerov2_heavy")}
ROUNDING = 2.0**-53  # of a number, at most
KINDS = ("any", "one", "parallel", "contradictory", "zero", "enclosed", "saturated", "firm")


def program(rng, kind):
    """Return a program as the law makes them: thrusters, slopes of clearances times what thrusters push, prices."""
    model = MODELS[str(rng.choice(list(MODELS)))]
    thrusters = make_thrusters(model)
    for lost in rng.choice(8, size=rng.choice([0, 0, 1, 2]), replace=False):
        thrusters.health[lost] = 0.0
    reallocate(thrusters)
    mass = model.rigid_mass[0, 0] + model.added_mass[0, 0]
    count = 1 if kind == "one" else int(rng.integers(2, 15))
    slopes = rng.normal(size=(count, 3))
    if kind == "parallel":
        slopes = slopes[0] * rng.choice([1.0, 1.0 + 1e-13, 2.0], size=(count, 1))
    elif kind in ("contradictory", "firm"):
        slopes[1::2] = -slopes[0:-1:2][: slopes[1::2].shape[0]]
    slopes /= np.linalg.norm(slopes, axis=1)[:, None]
    if kind == "zero":
        slopes[::2] = 0.0
    rows = slopes @ thrusters.matrix[:3] / mass
    reach = np.abs(rows) @ np.maximum(thrusters.upper, -thrusters.lower)
    rhs = reach * rng.uniform(0.2, 3.0, count) if kind == "enclosed" else rng.normal(size=count) * (0.05 + reach)
    price = 10.0 ** -rng.uniform(3.0, 6.0, count) / mass**2
    if kind == "firm":  # a hundred times more so than the law ever asks for
        price *= 0.01
    wanted = rng.normal(size=8) * (300.0 if kind == "saturated" else 15.0) * thrusters.health
    return thrusters, rows, rhs, price, wanted


def _solve(work, count, inverse, lower, upper, forces, steps):
    steps[0] = solve(work, count, inverse, lower, upper, forces)


def solve_program(thrusters, rows, rhs, price, wanted):
    """Return forces, multipliers and steps of our own solver."""
    count, m = rows.shape
    work, forces = empty_workspace(count + 2, m), np.full(m, np.nan)
    work.rows[:count], work.rhs[:count], work.price[:count], work.nominal[:] = rows, rhs, price, wanted
    steps = np.zeros(1, np.int64)
    BoundCall(_solve, (work, count, thrusters.inverse, thrusters.lower, thrusters.upper, forces, steps)).call()
    return forces, work.multipliers[: count + 2 * m].copy(), steps[0]


def by_quadprog(thrusters, rows, rhs, price, wanted):
    """Return its forces; each slack is counted in the measure in which it costs 1."""
    count, m = rows.shape
    H = np.linalg.inv(thrusters.inverse)
    G = np.block([[(H + H.T) / 2.0, np.zeros((m, count))], [np.zeros((count, m)), np.eye(count)]])
    rooms = np.hstack([np.vstack([np.eye(m), -np.eye(m)]), np.zeros((2 * m, count))])
    C = np.vstack([np.hstack([rows, np.diag(np.sqrt(price))]), rooms])
    b = np.r_[rhs, thrusters.lower, -thrusters.upper]
    return quadprog.solve_qp(G, np.r_[H @ wanted, np.zeros(count)], C.T, b)[0][:m]


def test_products_are_summed_in_double_double_precision():
    """In plain Python: total and rest hold what the fractions do, but for a rounding of a rounding."""
    add, rng = getattr(_add_product, "py_func", _add_product), np.random.default_rng(3)
    for total, rest, a, b in rng.normal(size=(300, 4)) * 10.0 ** rng.integers(-6, 7, (300, 4)):
        rest *= ROUNDING
        expected = Fraction(total) + Fraction(rest) + Fraction(a) * Fraction(b)
        after, left = add(total, rest, a, b)
        assert after == total + a * b
        off = abs(Fraction(after) + Fraction(left) - expected)
        assert off <= 8 * ROUNDING**2 * (abs(total) + abs(a * b) + abs(rest) / ROUNDING)


def test_residual_and_dual_force_are_accurate_under_cancellation():
    work, rng = empty_workspace(2, 8), np.random.default_rng(4)
    work.passive[:2] = 0, 1
    for _ in range(100):
        forces, work.rows[0] = rng.normal(size=8) * 20.0, rng.normal(size=8)
        work.price[0], work.multipliers[0] = rng.uniform(0.0, 1e-6), rng.uniform(0.0, 1e6)
        work.rhs[0] = work.rows[0] @ forces + work.price[0] * work.multipliers[0]
        expected = Fraction(work.rhs[0]) - Fraction(work.price[0]) * Fraction(work.multipliers[0])
        expected -= sum(Fraction(a) * Fraction(u) for a, u in zip(work.rows[0], forces, strict=True))
        lack = _row_residual(work, 1, 0, forces, forces, forces)
        assert lack == pytest.approx(float(expected), rel=1e-9, abs=1e-28)
        work.rows[1], work.multipliers[1] = -1.1 * work.rows[0], work.multipliers[0] / 1.1
        a, b = (Fraction(work.rows[i, 3]) * Fraction(work.multipliers[i]) for i in range(2))
        _sum_dual_force(work, 2, 2)
        assert work.dual_force[3] == pytest.approx(float(a + b), rel=1e-9)


def test_uncontrollable_row_is_paid_by_slack():
    """Of rhs - price y <= 0 with the least y: rhs / price, and forces as they were wanted."""
    thrusters, wanted = make_thrusters(MODELS["odin"]), np.linspace(-3.0, 4.0, 8)
    forces, y, _ = solve_program(thrusters, np.zeros((1, 8)), np.array([0.5]), np.array([1e-6]), wanted)
    assert forces == pytest.approx(wanted)
    assert y[0] == pytest.approx(0.5e6)


def test_weakly_controllable_row_is_partly_paid_by_slack():
    """(rhs - row u) = price y and u = wanted + H^-1 row y."""
    thrusters, wanted, row = make_thrusters(MODELS["odin"]), np.linspace(-3.0, 4.0, 8), np.full((1, 8), 1e-3)
    forces, y, _ = solve_program(thrusters, row, np.array([0.5]), np.array([0.02]), wanted)
    shaped = thrusters.inverse @ row[0]
    expected = (0.5 - row[0] @ wanted) / (row[0] @ shaped + 0.02)
    assert 0.0 < row[0] @ shaped < 0.02
    assert y[0] == pytest.approx(expected)
    assert forces == pytest.approx(wanted + shaped * expected)


@pytest.mark.medium
@pytest.mark.parametrize("programs", [5, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_solution_is_optimal_and_that_of_quadprog(kind, programs):
    """Stationary to the last roundings, within the limits, multipliers >= 0 and only where a row holds.

    In extended precision. As the program is strictly convex, nothing else fulfils them.
    """
    rng, tolerance = np.random.default_rng(100 + KINDS.index(kind)), 1e-9 if kind == "firm" else 1e-12
    for _ in range(programs):
        thrusters, rows, rhs, price, nominal = given = program(rng, kind)
        forces, y, steps = solve_program(*given)
        count, m = rows.shape
        scale = 1.0 + np.abs(nominal).max()
        assert np.count_nonzero(y[count:]) <= steps <= 3 * y.size
        assert np.all(forces >= thrusters.lower) and np.all(forces <= thrusters.upper)
        assert np.all(y >= 0.0)
        barriers, low, high = y[:count], y[count : count + m], y[count + m :]
        A, inverse = np.vstack([rows, np.eye(m), -np.eye(m)]).astype(np.longdouble), thrusters.inverse
        sizes = np.abs(nominal) + np.abs(forces) + np.abs(inverse) @ np.abs(A.T) @ y
        assert np.all(np.abs(forces - nominal - inverse @ (A.T @ y)) <= 4.0 * ROUNDING * sizes)
        residual = rhs - A[:count] @ forces - price.astype(np.longdouble) * barriers
        residual /= np.sqrt(np.sum(rows @ inverse * rows, axis=1) + price)
        assert np.all(np.where(barriers > 0.0, np.abs(residual), residual) <= tolerance * scale)
        assert np.array_equal(forces[low > 0.0], thrusters.lower[low > 0.0])
        assert np.array_equal(forces[high > 0.0], thrusters.upper[high > 0.0])
        assert forces == pytest.approx(by_quadprog(*given), abs=1e-5 * scale)


def test_unconstrained_desired_force_is_returned_exactly():
    thrusters = make_thrusters(MODELS["odin"])
    wanted = np.linspace(-20.0, 20.0, 8)
    forces, y, steps = solve_program(thrusters, np.ones((1, 8)), np.array([-1e3]), np.array([1e-6]), wanted)
    assert steps == 0 and not y.any()
    assert np.array_equal(forces, wanted)


def test_the_barrier_of_greater_price_yields_less():
    """Two that contradict each other, and cannot both hold within what the forces cost: s_1 / s_2 = rho_2 / rho_1."""
    thrusters = make_thrusters(MODELS["odin"])
    along = thrusters.matrix[0] / 187.5
    price = np.array([1e-3, 1e-5]) / 187.5**2
    forces, y, _ = solve_program(thrusters, np.array([along, -along]), np.array([0.2, 0.2]), price, np.zeros(8))
    yielding = y[:2] * price
    assert yielding[0] / yielding[1] == pytest.approx(100.0, rel=0.02)
    assert yielding == pytest.approx([0.2 - along @ forces, 0.2 + along @ forces], rel=1e-6)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_rows_are_ignored(bad):
    thrusters = make_thrusters(MODELS["odin"])
    rows, rhs, price = np.ones((3, 8)) / 187.5, np.full(3, 0.3), np.full(3, 1e-8)
    alone, _, _ = solve_program(thrusters, rows[:1], rhs[:1], price[:1], np.zeros(8))
    rows[1, 3], rhs[2] = bad, bad
    forces, _, steps = solve_program(thrusters, rows, rhs, price, np.r_[bad, np.zeros(7)])
    assert steps > 0
    assert np.array_equal(forces, alone)


@pytest.mark.medium
def test_forces_stay_within_limits_for_extreme_numbers():
    """Whose products may be beyond the greatest number."""
    rng, far = np.random.default_rng(2), np.array([1.0, 1.0, 1.0, 1e-300, 1e-150, 1e-30, 1e30, 1e150, 1e300])
    ended = 0
    for _ in range(200):
        thrusters, rows, rhs, price, wanted = program(rng, str(rng.choice(KINDS[:-1])))
        n = len(rhs)
        rows, wanted = rows * rng.choice(far, (n, 1)), wanted * rng.choice(far, 8)
        with np.errstate(over="ignore", invalid="ignore"):
            rhs, price = rhs * rng.choice(far, n), price * rng.choice(far, n)
            forces, y, steps = solve_program(thrusters, rows, rhs, price, wanted)
        ended += steps < 0
        assert np.all(forces >= thrusters.lower) and np.all(forces <= thrusters.upper)
        assert np.all(y >= 0.0)
    assert 0 < ended < 50


def test_step_count_is_negative_if_the_search_is_truncated(monkeypatch):
    """In plain Python, with one step allowed where four limits are in the way."""
    plain = getattr(solve, "py_func", solve)
    thrusters = make_thrusters(MODELS["odin"])
    wanted, forces, work = np.r_[100.0, -100.0, np.zeros(6)], np.empty(8), empty_workspace(1, 8)
    for allowed, steps in ((1, -1), (48, 4)):
        monkeypatch.setitem(plain.__globals__, "_STEPS_A_ROW", allowed / 16.0)
        work.nominal[:] = wanted
        assert plain(work, 0, thrusters.inverse, thrusters.lower, thrusters.upper, forces) == steps
        assert np.all(forces >= thrusters.lower) and np.all(forces <= thrusters.upper)


def test_steps_count_row_additions_and_removals(monkeypatch):
    """In plain Python: each moves the multipliers once, where no row depends on those before."""
    plain, moves, rng = getattr(solve, "py_func", solve), [], np.random.default_rng(0)
    advance = plain.__globals__["_advance"]

    def counting(work, count):
        moves.append(advance(work, count))
        return moves[-1]

    monkeypatch.setitem(plain.__globals__, "_advance", counting)
    gone = 0
    for _ in range(40):
        thrusters, rows, rhs, price, wanted = program(rng, "any")
        work, forces = empty_workspace(len(rows), 8), np.empty(8)
        work.rows[:], work.rhs[:], work.price[:], work.nominal[:] = rows, rhs, price, wanted
        moves.clear()
        steps = plain(work, len(rows), thrusters.inverse, thrusters.lower, thrusters.upper, forces)
        assert steps >= len(moves)
        gone += sum(drop >= 0 for drop in moves)
        dependent = steps - len(moves)
        assert dependent == 0 or (thrusters.health == 0.0).any()
    assert gone > 3
