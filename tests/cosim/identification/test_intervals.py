"""Intervals by a jackknife with few pieces, beside what is known of the mean of a sample and of a regression."""

import numpy as np
import pytest
from scipy.stats import t as student

from cosim.identification.intervals import estimate_intervals
from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Reduced
from cosim.identification.windows import Window


def intervals_of(jacobians, residuals):
    """Intervals of windows of 20 s, whose model is wrong: each is a piece of its own."""
    count = jacobians[0].shape[1]
    parameters = [Parameter(f"n{i}", "", "plant", 0.0, 1e6) for i in range(count)]
    reduced = [Reduced(r, j, np.zeros(len(r))) for j, r in zip(jacobians, residuals, strict=True)]
    windows = [Window(0, 0, 1, 20.0 * k + 1.0, (), np.zeros(13)) for k in range(len(reduced))]
    return estimate_intervals(parameters, np.zeros(count), reduced, windows, 0, True)


def test_interval_of_a_mean_is_that_of_student():
    """Of n equal pieces the mean has n - 1 degrees of freedom."""
    rng = np.random.default_rng(3)
    means = 10.0 * rng.standard_normal(6)
    rows = 4
    residuals = [np.full(rows, x - means.mean()) for x in means]
    found = intervals_of([np.ones((rows, 1))] * 6, residuals)
    expected = means.std(ddof=1) / np.sqrt(6) * student.ppf(0.975, 5)
    assert found.half[0] == pytest.approx(expected, rel=1e-6)
    assert found.clusters == "each of 6 pieces of 20 s"


def test_jackknife_is_that_of_fits_without_a_piece():
    """Of a regression, each piece left out in turn and fitted anew."""
    rng = np.random.default_rng(4)
    jacobians = [rng.standard_normal((8, 2)) for _ in range(5)]
    samples = [20.0 * rng.standard_normal(8) for _ in range(5)]
    J, y = np.concatenate(jacobians), np.concatenate(samples)
    all_of_them = np.linalg.lstsq(J, y, rcond=None)[0]
    moved = []
    for k in range(5):
        rest = [i for i in range(5) if i != k]
        J_k, y_k = np.concatenate([jacobians[i] for i in rest]), np.concatenate([samples[i] for i in rest])
        moved.append(np.linalg.lstsq(J_k, y_k, rcond=None)[0] - all_of_them)
    deviations = np.sqrt(4 / 5 * np.square(moved).sum(axis=0))
    found = intervals_of(jacobians, [s - j @ all_of_them for j, s in zip(jacobians, samples, strict=True)])
    factors = found.half / deviations
    assert (factors > student.ppf(0.975, 4) - 1e-9).all() and (factors < student.ppf(0.975, 2)).all()


def test_number_that_two_pieces_determine_has_one_degree_of_freedom():
    rng = np.random.default_rng(5)
    jacobians = [np.column_stack([np.ones(4), np.full(4, float(k < 2))]) for k in range(20)]
    found = intervals_of(jacobians, [10.0 * rng.standard_normal() * np.ones(4) for _ in range(20)])
    only_first = intervals_of([j[:, :1] for j in jacobians], [np.ones(4) * (-1.0) ** k for k in range(20)])
    # about 12.7 times a deviation and about twice: of one and of nineteen degrees of freedom
    assert found.half[1] / found.nominal[1] > 20.0
    assert only_first.half[0] / np.sqrt(19 / 20 * 20 / 19**2) == pytest.approx(student.ppf(0.975, 19), rel=0.01)


def test_number_that_no_piece_determines_rests_on_its_prior():
    found = intervals_of([np.column_stack([np.ones(4), np.zeros(4)])] * 6, [np.full(4, (-1.0) ** k) for k in range(6)])
    assert found.half[1] == pytest.approx(1e6 * 1.95996, rel=1e-4)
    assert found.prior_fraction[1] == pytest.approx(1.0) and np.isfinite(found.half).all()
