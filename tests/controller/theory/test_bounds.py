"""The inequalities between the lines of the proof, over random states."""

import numpy as np
import pytest

from controller import Gains
from controller.theory import Model, bracket, decay_bound, norm_bound, square_bound, value_rate
from plant_fmu import load_vehicle

rng = np.random.default_rng(8)
GAINS = Gains()
ODIN = load_vehicle("odin")
MODEL = Model(ODIN.mass_matrix, ODIN.linear_damping, ODIN.quadratic_damping, np.zeros(4))


@pytest.mark.parametrize("n", [1, 2, 5])
def test_35_and_36_bound_the_norm_of_the_sum(n):
    for _ in range(50):
        errors = rng.normal(size=(n, 3)) * 10.0 ** rng.uniform(-3, 3, (n, 1))
        norm = np.linalg.norm(errors.sum(axis=0))
        assert norm <= norm_bound(errors) * (1.0 + 1e-12)
        assert norm**2 <= square_bound(errors) * (1.0 + 1e-12)
        assert norm_bound(errors) ** 2 <= square_bound(errors) * (1.0 + 1e-12)


def test_35_and_36_are_equalities_where_all_errors_are_equal():
    errors = np.tile([1.0, -2.0, 2.0], (4, 1))
    assert norm_bound(errors) == pytest.approx(12.0)
    assert square_bound(errors) == pytest.approx(144.0)


def test_44_adds_what_the_velocity_and_the_errors_give():
    gains, nu, y = GAINS._replace(k_v1=7.0, k_v2=5.0), np.zeros(6), np.array([1.0, -2.0, 0.0, 0.5, 0.0, 1.0])
    pull = min(gains.sigma_p * gains.k_p1, gains.sigma_a * gains.k_p2) * 6.25
    assert decay_bound(MODEL, gains, y, nu, 3.0) == pytest.approx(pull)
    nu[5] = 2.0  # the drag of translation is none at rest
    assert decay_bound(MODEL, gains, y, nu, 3.0) == pytest.approx(pull + (0.0 + 5.0 - 3.0) * 4.0)


@pytest.mark.slow
def test_44_bounds_w_where_43_holds():
    closest = np.inf
    for _ in range(300):
        y, y_rate, nu = rng.normal(size=6), rng.normal(size=6), rng.normal(size=6)
        sigma_c0 = -bracket(MODEL, GAINS, y, y_rate, nu) / np.sum(nu**2)
        w = -value_rate(MODEL, GAINS, y, y_rate, nu)
        closest = min(closest, (w - decay_bound(MODEL, GAINS, y, nu, sigma_c0)) / abs(w))
        assert closest >= -1e-12
    # along one axis of attitude, where drag and gains are least, nothing is lost
    nu, y = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1e-3]), np.zeros(6)
    w = -value_rate(MODEL, GAINS, y, np.zeros(6), nu)
    assert decay_bound(MODEL, GAINS, y, nu, 0.0) == pytest.approx(GAINS.k_v2 * 1e-6)
    assert w == pytest.approx((GAINS.k_v2 + 30.0) * 1e-6, rel=1e-2)
