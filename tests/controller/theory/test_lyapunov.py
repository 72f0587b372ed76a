"""V of (31) and -W of (41): along a closed loop that SciPy integrates, and against quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.spatial.transform import Rotation

from controller import Gains
from controller.paper_law import primary_error, secondary_error
from controller.quaternion import error, rotation_matrix
from controller.regions import Box, DepthBand, Region, Sphere, pack
from controller.theory import (
    Model,
    lower_bound,
    mapped_error,
    mapped_error_rate,
    normalized_secondary,
    primary_value,
    printed_secondary,
    unit_gradient_secondary,
    value_rate,
)
from plant_fmu import load_vehicle

GAINS = Gains()
DESIRED = np.array([1.0, 0.0, 0.0, 0.0])
PHI = np.array([-2.0, 0.5, -1.0, 61.3])
ODIN = load_vehicle("odin")
MODEL = Model(ODIN.mass_matrix, np.array(ODIN.linear_damping), np.array(ODIN.quadratic_damping), PHI)
GOAL = Region("goal", Sphere((1.5, 0.0, 1.0), 0.5), "in")
SPHERE = Region("ball", Sphere((0.2, 0.1, 0.1), 0.9), "out")
FLAT = Region("box", Box((0.0, 0.0, 0.0), (1.5, 1.5, 1.5)), "out")
BETAS = np.array([1.0, 0.7])
rng = np.random.default_rng(7)


def evaluated(regions, position):
    n = len(regions)
    values, gradients, clearances = np.empty(n), np.empty((n, 3)), np.empty(n)
    pack(regions).evaluate(np.asarray(position, float), DESIRED, values, gradients, np.empty((n, 3)), clearances)
    return values, gradients, clearances


def region_error(regions, position, betas):
    values, gradients, _ = evaluated(regions, position)
    e_s = secondary_error(values[1:], gradients[1:], betas)
    return primary_error(values[0], gradients[0]), e_s


class Loop:
    """The closed loop (30) with constant weights, its terms written out with cross products."""

    def __init__(self, regions, betas):
        self.regions, self.betas = [GOAL, *regions], betas

    def parts(self, x):
        p, e, nu, phi_hat = np.split(x, [3, 7, 13])
        R = rotation_matrix(e)
        turned = error(DESIRED, e)
        e_p, e_s = region_error(self.regions, p, self.betas)
        return p, e, nu, phi_hat, R, turned, e_p, e_s

    def __call__(self, t, x):
        _, e, nu, phi_hat, R, turned, e_p, e_s = self.parts(x)
        v, w = nu[:3], nu[3:]
        a, b = np.split(MODEL.mass @ nu, 2)
        turning = np.concatenate([np.cross(w, a), np.cross(v, a) + np.cross(w, b)])
        drag = MODEL.linear_damping * nu + MODEL.quadratic_damping * np.abs(nu) * nu
        k = R.T @ [0.0, 0.0, 1.0]

        def restoring(phi):
            return np.concatenate([-phi[0] * k, np.cross(k, phi[1:])])

        pull = np.concatenate([R.T @ (GAINS.k_p1 * e_p + GAINS.k_q * e_s), GAINS.k_p2 * turned[1:]])
        held = np.r_[GAINS.k_v1 * v, GAINS.k_v2 * w]
        nu_rate = np.linalg.solve(MODEL.mass, -turning - drag - pull - held - restoring(PHI - phi_hat))
        drive = nu + np.r_[GAINS.sigma_p * R.T @ (e_p + GAINS.k_q / GAINS.k_p1 * e_s), GAINS.sigma_a * turned[1:]]
        Z = np.column_stack([restoring(column) for column in np.eye(4)])
        e_rate = 0.5 * np.r_[-e[1:] @ w, e[0] * w + np.cross(e[1:], w)]
        return np.concatenate([R @ v, e_rate, nu_rate, -Z.T @ drive / GAINS.gamma])

    def values(self, x):
        """Return V without secondary sum, and the three last sums."""
        p, _, nu, phi_hat, R, turned, e_p, e_s = self.parts(x)
        g, dg, clearance = evaluated(self.regions, p)
        y = mapped_error(e_p, e_s, turned[1:], R, GAINS)
        base = primary_value(MODEL, GAINS, g[0], turned, y, nu, phi_hat)
        return (
            base + printed_secondary(g[1:], dg[1:], self.betas, GAINS),
            base + unit_gradient_secondary(g[1:], self.betas, GAINS),
            base + normalized_secondary(g[1:], dg[1:], clearance[1:], self.betas, GAINS),
        )

    def rate(self, x):
        p, _, nu, _, R, turned, e_p, e_s = self.parts(x)
        y = mapped_error(e_p, e_s, turned[1:], R, GAINS)
        h, velocity = 1e-5, R @ nu[:3]
        ahead, behind = (region_error(self.regions, p + s * h * velocity, self.betas) for s in (1.0, -1.0))
        kappa = GAINS.k_q / GAINS.k_p1
        moving = (ahead[0] + kappa * ahead[1] - behind[0] - kappa * behind[1]) / (2.0 * h)
        return value_rate(MODEL, GAINS, y, mapped_error_rate(moving, y, turned, R, nu[3:]), nu)


def followed(loop, until=0.6, samples=25):
    """Return -W and, by central differences of the dense solution, the rates of the three V."""
    tilt = Rotation.from_euler("xyz", [0.3, -0.2, 0.4]).as_quat(scalar_first=True)
    start = np.concatenate([[0.05, -0.1, -0.2], tilt, [0.2, -0.1, 0.1, 0.1, -0.2, 0.3], np.zeros(4)])
    path = solve_ivp(loop, (0.0, until), start, method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True).sol
    h = 1e-4
    times = np.linspace(2 * h, until - 2 * h, samples)
    rates = [(np.array(loop.values(path(t + h))) - loop.values(path(t - h))) / (2.0 * h) for t in times]
    return np.array([loop.rate(path(t)) for t in times]), np.array(rates).T


@pytest.mark.slow
def test_rate_is_minus_w_where_the_force_has_the_potential():
    expected, (printed, unit_gradient, normalized) = followed(Loop([SPHERE, FLAT], BETAS))
    scale = np.abs(expected).max()
    assert np.abs(normalized - expected).max() < 1e-6 * scale
    # inside the ball |dg/dp| is not 1: (31) and (33) are not the potential of (22)
    assert np.abs(printed - expected).max() > 1e-3 * scale
    assert np.abs(unit_gradient - expected).max() > 1e-3 * scale


@pytest.mark.medium
def test_with_unit_gradients_the_three_forms_are_one():
    expected, rates = followed(Loop([FLAT], BETAS[:1]))
    for rate in rates:
        assert np.abs(rate - expected).max() < 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize(
    ("region", "position", "inward"),
    [
        (Region("s", Sphere((0, 0, 0), 2.0), "out"), (0.5, 0.0, 0.0), (1.5, 0.0, 0.0)),
        (Region("s", Sphere((0, 0, 0), 2.0), "in"), (3.0, 0.0, 0.0), (-1.0, 0.0, 0.0)),
        (Region("a", Sphere((0, 0, 0), 5.0), "out"), (1.0, 2.0, 2.0), (2.0 / 3.0, 4.0 / 3.0, 4.0 / 3.0)),
        (Region("c", Sphere((0, 0, 0), 2.0), "out"), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0)),
        (Region("d", DepthBand(2.5, 1.8), "out"), (0.0, 0.0, 1.0), (0.0, 0.0, -0.3)),
        (Region("d", DepthBand(2.5, 1.8), "in"), (0.0, 0.0, 5.0), (0.0, 0.0, -0.7)),
        (FLAT, (0.0, 0.1, 0.5), (0.0, 0.0, 0.25)),
    ],
    ids=["sphere out", "sphere in", "sphere aslant", "its center", "band out", "band in", "box out"],
)
def test_potential_is_the_integral_of_g_along_the_normal(region, position, inward):
    g, dg, clearance = evaluated([region], position)
    length = np.linalg.norm(inward)
    assert clearance[0] == pytest.approx(-length)
    expected, _ = quad(lambda t: evaluated([region], position + t * np.array(inward))[0][0] * length, 0.0, 1.0)
    value = normalized_secondary(g, dg, clearance, np.array([0.7]), GAINS)
    assert value == pytest.approx(0.7 * (100.0 + 0.08 * 100.0 * 90.0 / 18.8) * expected, rel=1e-9)


def test_papers_sum_divides_by_the_squared_full_gradient():
    g, dg, _ = evaluated([Region("s", Sphere((0, 0, 0), 5.0), "out")], (1.0, 2.0, -2.0))
    assert np.sum(dg**2) == pytest.approx(36.0)
    value = printed_secondary(g, dg, np.array([0.7]), GAINS)
    assert value == pytest.approx(0.5 * (100.0 + 0.08 * 100.0 * 90.0 / 18.8) * 0.7 * 16.0**2 / 36.0, rel=1e-12)


def test_satisfied_or_zero_weight_regions_contribute_nothing():
    g, dg, clearance = evaluated([SPHERE, FLAT], (5.0, 0.0, 0.0))
    assert printed_secondary(g, dg, BETAS, GAINS) == normalized_secondary(g, dg, clearance, BETAS, GAINS) == 0.0
    g, dg, clearance = evaluated([SPHERE, FLAT], (0.3, 0.0, 0.0))
    none = np.zeros(2)
    assert printed_secondary(g, dg, none, GAINS) == normalized_secondary(g, dg, clearance, none, GAINS) == 0.0
    assert unit_gradient_secondary(g, none, GAINS) == 0.0


def test_papers_sum_diverges_at_vanishing_gradient():
    near, nearer = (
        printed_secondary(*evaluated([SPHERE], (0.2 + x, 0.1, 0.1))[:2], BETAS[:1], GAINS) for x in (1e-2, 1e-3)
    )
    assert nearer == pytest.approx(100.0 * near, rel=1e-3)


def test_completed_square_bounds_v():
    for _ in range(50):
        x = rng.normal(size=17)
        x[3:7] /= np.linalg.norm(x[3:7])
        p, _, nu, phi_hat, R, turned, e_p, e_s = Loop([SPHERE], BETAS[:1]).parts(x)
        f = evaluated([GOAL], p)[0][0]
        y = mapped_error(e_p, e_s, turned[1:], R, GAINS)
        arguments = (MODEL, GAINS, f, turned, y)
        value, bound = primary_value(*arguments, nu, phi_hat), lower_bound(*arguments, nu, phi_hat)
        assert value >= bound - 1e-9 * abs(value)
        doubled = nu + 2.0 * np.r_[GAINS.sigma_p * y[:3], GAINS.sigma_a * y[3:]]
        assert value - bound == pytest.approx(0.25 * doubled @ MODEL.mass @ doubled, rel=1e-6, abs=1e-6)
