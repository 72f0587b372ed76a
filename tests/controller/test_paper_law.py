"""The paper's law against a transcription of its equations in plain matrices."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controller import Gains, IsmailDunniganLaw, VehicleState
from controller.paper_law import primary_error, secondary_error, step
from controller.regions import Region, Sphere, pack
from tests.controller.test_baseline_laws import random_unit

GAINS = Gains()
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
rng = np.random.default_rng(11)


def evaluate_law(e, nu, goal, regions, alphas, e_d=None, gains=GAINS, period=0.001, phi=(0.0, 0.0, 0.0, 0.0)):
    """Return the wrench and the next estimate; goal and regions are pairs of values and gradients."""
    (f, df), (gs, dgs) = goal, regions
    estimate, tau = np.array(phi, float), np.empty(6)
    gs, dgs = np.array(gs, float), np.array(dgs, float).reshape(-1, 3)
    step(e, nu, e if e_d is None else e_d, f, np.array(df, float), gs, dgs, alphas, gains, period, estimate, tau)
    return tau, estimate


NOTHING = ([], [])


def textbook(e, e_d, nu, f, df, gs, dgs, alphas, phi):
    """(20)-(29) as matrices, by NumPy and SciPy alone."""
    R = Rotation.from_quat(np.roll(e, -1)).as_matrix()
    e_p = max(0.0, f) * df
    e_s = sum(
        (
            alpha / GAINS.k_q * max(0.0, g) * dg / np.linalg.norm(dg)
            for g, dg, alpha in zip(gs, dgs, alphas, strict=True)
        ),
        start=np.zeros(3),
    )
    between = Rotation.from_quat(np.roll(e_d, -1)).inv() * Rotation.from_quat(np.roll(e, -1))
    e_e = between.as_quat(canonical=True)[:3]
    K_0 = np.block([[R.T * GAINS.k_p1, np.zeros((3, 3))], [np.zeros((3, 3)), GAINS.k_p2 * np.eye(3)]])
    K_s = np.vstack([GAINS.k_q * R.T, np.zeros((3, 3))])
    K_v = np.diag([GAINS.k_v1] * 3 + [GAINS.k_v2] * 3)
    k = R.T @ [0.0, 0.0, 1.0]
    Z = np.zeros((6, 4))
    Z[:3, 0] = -k
    Z[3:, 1:] = [[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]]
    tau = -K_0 @ np.r_[e_p, e_e] - K_s @ e_s - K_v @ nu + Z @ phi
    sigma = np.diag([GAINS.sigma_p] * 3 + [GAINS.sigma_a] * 3)
    J_e = np.r_[R.T @ (e_p + GAINS.k_q / GAINS.k_p1 * e_s), e_e]
    rate = -np.linalg.inv(GAINS.gamma * np.eye(4)) @ Z.T @ (nu + sigma @ J_e)
    return tau, rate


def test_wrench_and_adaptation_are_the_equations():
    for _ in range(50):
        e, e_d, nu, phi = random_unit(rng), random_unit(rng), rng.normal(size=6), rng.normal(size=4)
        f, df = rng.normal() * 5, rng.normal(size=3)
        gs, dgs, alphas = rng.normal(size=4), rng.normal(size=(4, 3)), rng.uniform(0, 100, 4)
        tau, estimate = evaluate_law(e, nu, (f, df), (gs, dgs), alphas, e_d, period=0.01, phi=phi)
        expected, rate = textbook(e, e_d, nu, f, df, gs, dgs, alphas, phi)
        assert tau == pytest.approx(expected, rel=1e-12, abs=1e-10)
        assert estimate == pytest.approx(phi + 0.01 * rate, rel=1e-12, abs=1e-12)


def test_force_at_the_papers_start():
    """26.82 kN: k_p1 f |grad f| with f = 79.75 m2 and |grad f| = 2 sqrt(80) m; SR3 pushes with 0.5 (1.8^2 - 1.5^2)."""
    tau, _ = evaluate_law(IDENTITY, np.zeros(6), (79.75, [-16.0, 0.0, -8.0]), NOTHING, np.empty(0))
    assert np.linalg.norm(tau[:3]) == pytest.approx(18.8 * 79.75 * 2 * math.sqrt(80.0), rel=1e-12)
    assert tau[0] > 0.0 and tau[2] > 0.0


def test_errors_are_gradients_of_the_potentials():
    """(18) of (16); (19) of (17) where the gradient of g has length 1."""
    h, alphas = 1e-6, np.array([3.0, 5.0])
    slope = 18.8 * (max(0.0, 2.0 + h) ** 2 - max(0.0, 2.0 - h) ** 2) / (4 * h)  # (16)
    assert slope == pytest.approx(18.8 * primary_error(2.0, np.ones(1))[0])
    values, unit = np.array([0.3, -0.2]), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    sums = [alphas @ np.maximum(0.0, values + s * h * axis) ** 2 for axis in np.eye(2) for s in (1, -1)]  # (17)
    slopes = np.array([sums[0] - sums[1], sums[2] - sums[3], 0.0]) / (4 * h)
    assert slopes == pytest.approx(100.0 * secondary_error(values, unit, alphas / 100.0), abs=1e-8)


def test_missing_measurement_gives_nan_errors():
    assert np.isnan(primary_error(math.nan, np.ones(3))).all()
    assert np.isnan(secondary_error(np.array([math.nan]), np.ones((1, 3)), np.ones(1))).all()


def test_k_q_has_no_effect():
    taus = []
    for k_q in (0.1, 100.0, 1e5):
        slope = [1.0, 2.0, 3.0]
        gains = GAINS._replace(k_q=k_q)
        tau, estimate = evaluate_law(
            IDENTITY, np.zeros(6), (0.2, slope), ([0.2], [slope]), np.array([50.0]), gains=gains, period=0.01
        )
        taus.append([*tau, *estimate])
    assert np.ptp(taus, axis=0) == pytest.approx(np.zeros(10), abs=1e-12)


def test_the_law_evaluates_its_regions_and_weighs_them():
    """At a quarter of a meter from the center of a sphere of one meter to be kept out of: 0.5 * 100 * (1 - 1/16) N."""
    law, tau = IsmailDunniganLaw(GAINS, IDENTITY, 0.001, 1), np.empty(6)
    goal, rock = (
        pack([Region("goal", Sphere((0.0, 0.0, 0.0), 1.0), "in")]),
        pack([Region("rock", Sphere((0.0, 0.25, 0.0), 1.0), "out", gain=100.0)]),
    )
    state = VehicleState(np.zeros(3), IDENTITY, np.zeros(6), np.ones(8))
    law.step(state, goal, rock, np.array([0.5]), tau)
    assert tau == pytest.approx([0.0, -50.0 * (1.0 - 0.0625), 0.0, 0.0, 0.0, 0.0])
    assert law.estimate[0] == pytest.approx(0.0) and law.report.shape == (0,)


def test_a_region_without_gradient_contributes_nothing():
    assert secondary_error(np.array([0.25]), np.zeros((1, 3)), np.array([1.0])) == pytest.approx(np.zeros(3))


def test_a_repulsive_sphere_pushes_at_most_gain_times_radius_squared():
    """Inside SR1, at its center, 100 * 0.25 = 25 N: against 26.8 kN there is no avoidance."""
    depth = 1e-9  # from the center
    sphere = ([0.25 - depth**2], [[-2.0 * depth, 0.0, 0.0]])
    tau, _ = evaluate_law(IDENTITY, np.zeros(6), (-1.0, np.zeros(3)), sphere, np.array([100.0]))
    assert tau[:3] == pytest.approx([25.0, 0.0, 0.0])


def test_defaults_are_those_of_section_vii():
    assert Gains() == (18.8, 36.0, 100.0, 90.0, 40.0, 0.08, 0.9, 2.0)
