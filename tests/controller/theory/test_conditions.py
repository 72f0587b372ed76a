"""The gain conditions against independently computed figures of the ODIN-like vehicle in section VII."""

import math

import numpy as np
import pytest

from controller import Gains
from controller.theory import (
    damping_fit,
    error_jacobian_bound,
    gain_fits,
    greatest_gradient,
    potential_fits,
    secondary_fit,
    sphere_radii,
)
from controller.theory.conditions import least_of_potential_test
from plant_fmu import load_vehicle

GAINS = Gains()
ODIN = load_vehicle("odin")
M, DRAG = ODIN.mass_matrix, ODIN.linear_damping
START, GOAL, RADIUS = np.array([0.0, 0.0, 1.0]), np.array([8.0, 0.0, 5.0]), 0.5
FAR = float(np.linalg.norm(START - GOAL))
SLOPE, F = 2.0 * FAR, FAR**2 - RADIUS**2


def test_first_condition_of_38_fails_at_the_papers_start():
    first, _ = potential_fits(M, SLOPE, GAINS)
    assert first.have == pytest.approx(0.04, abs=0.001)
    assert first.need == pytest.approx(1.2, abs=0.01)
    assert not first.holds
    assert least_of_potential_test(M, SLOPE, GAINS) == pytest.approx(0.04 - 1.2, abs=0.01)


def test_second_condition_of_38_fails_as_printed_but_the_matrix_test_of_attitude_holds():
    """lambda_m is a mass where rotation has an inertia: 152 for it, 6.5 with the matrix."""
    _, second = potential_fits(M, SLOPE, GAINS)
    assert second.have == pytest.approx(72.0)
    assert second.need == pytest.approx(152.0, abs=0.1)
    assert not second.holds
    sigma = np.diag([GAINS.sigma_p] * 3 + [GAINS.sigma_a] * 3)
    assert 72.0 - (sigma @ M @ sigma)[3:, 3:].max() == pytest.approx(72.0 - 0.81 * 8.0)
    assert least_of_potential_test(M, 1.0, GAINS) > 0.0


def test_38_holds_within_1_64_meters_of_the_goals_center():
    potential, *_ = sphere_radii(M, DRAG, RADIUS, GAINS)
    assert potential == pytest.approx(1.64, abs=0.005)
    assert 2.0 * potential == pytest.approx(greatest_gradient(M, GAINS))
    assert least_of_potential_test(M, 2.0 * potential * 0.999, GAINS) > 0.0
    assert least_of_potential_test(M, 2.0 * potential * 1.001, GAINS) < 0.0


def test_greatest_gradient_of_38_is_zero_or_infinite_at_extreme_gains():
    assert greatest_gradient(M, GAINS._replace(sigma_a=30.0)) == 0.0
    assert greatest_gradient(M, GAINS._replace(sigma_p=0.0)) == math.inf


def test_third_condition_of_38_holds_with_all_three_regions_of_the_paper():
    betas, slopes = np.array([1.0, 1.0, 0.005]), np.array([1.0, 1.0, 3.6])  # the steepest within the regions
    fit = secondary_fit(M, slopes, betas, GAINS)
    assert fit.have == pytest.approx(0.5 * (100.0 + 0.08 * 100.0 * 90.0 / 18.8) * 1.0 / 3.6**2)
    assert fit.need == pytest.approx(3 * 0.08**2 * 187.7, rel=1e-3)
    assert fit.holds
    assert secondary_fit(M, np.empty(0), np.empty(0), GAINS).holds
    assert not secondary_fit(M, 10.0 * slopes, betas, GAINS).holds


def test_first_condition_of_45_fails_at_the_papers_start():
    offset = START - GOAL
    jacobian = 4.0 * np.outer(offset, offset) + 2.0 * F * np.eye(3)
    bound = error_jacobian_bound(jacobian)
    assert bound == pytest.approx(SLOPE**2 + 2.0 * F)
    fit = damping_fit(M, DRAG, bound, GAINS)
    assert fit.have == 40.0
    assert fit.need == pytest.approx(7190.0, rel=1e-3)
    assert not fit.holds
    translation = damping_fit(M, DRAG, bound, GAINS, translation_alone=True)
    assert translation.have == 90.0
    assert not translation.holds


def test_45_can_hold_within_0_73_or_1_04_meters():
    _, all_six, translation = sphere_radii(M, DRAG, RADIUS, GAINS)
    assert all_six == pytest.approx(0.73, abs=0.005)
    assert translation == pytest.approx(1.04, abs=0.005)
    for radius, alone in ((all_six, False), (translation, True)):
        for factor, holds in ((0.999, True), (1.001, False)):
            d = factor * radius
            assert damping_fit(M, DRAG, 4.0 * d**2 + 2.0 * (d**2 - RADIUS**2), GAINS, alone).holds is holds


def test_45_holds_inside_any_region_whatever_the_gains():
    _, all_six, translation = sphere_radii(M, DRAG, 3.0, GAINS._replace(sigma_p=100.0))
    assert all_six == translation == 3.0


def test_second_and_third_condition_of_45_hold():
    second, third = gain_fits(GAINS)
    assert second.holds and second.have == 18.8
    assert third.holds and third.have - third.need == pytest.approx(100.0 - 18.8)


def test_first_condition_of_45_takes_the_heaviest_direction_of_translation():
    fit = damping_fit(np.diag([10.0, 20.0, 30.0, 1.0, 2.0, 3.0]), np.full(6, 4.0), 2.0, GAINS._replace(sigma_p=0.5))
    assert fit.need == pytest.approx(0.5 * 30.0 * 2.0)


def test_38_holds_up_to_the_greatest_gradient_of_any_mass():
    rng, found = np.random.default_rng(3), 0
    for _ in range(20):
        root = rng.normal(size=(6, 6))
        mass = 4.0 * root @ root.T + np.diag([30.0, 60.0, 90.0, 5.0, 6.0, 7.0])
        most = greatest_gradient(mass, GAINS)
        if most > 0.0:
            found += 1
            assert least_of_potential_test(mass, most * 0.999, GAINS) > 0.0
            assert least_of_potential_test(mass, most * 1.001, GAINS) < 0.0
    assert found > 10
