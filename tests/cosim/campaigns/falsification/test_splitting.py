"""Probabilities of rare events against closed forms and plain counting."""

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import chi2, norm

from cosim.campaigns.falsification.splitting import estimate_probability

DIMENSION = 40


class HalfSpace:
    """Cost below 0 beyond a plane at `beta` standard deviations; a part of what decides may be noise of each call."""

    def __init__(self, beta, noise=0.0):
        self.beta, self.noise, self.calls = beta, noise, 0
        self.rng = np.random.default_rng(11)
        self.normal = np.sqrt(np.arange(1, DIMENSION + 1))
        self.normal *= np.sqrt(1.0 - noise**2) / np.linalg.norm(self.normal)

    def __call__(self, points):
        self.calls += len(points)
        assert ((points >= 0.0) & (points <= 1.0)).all()
        return self.beta - ndtri(points) @ self.normal - self.noise * self.rng.standard_normal(len(points))


def outside_a_ball(points):
    """Return a cost below 0 where the normal numbers are beyond a radius: the event is not to one side."""
    return 9.0 - np.linalg.norm(ndtri(points), axis=1)


def estimates(cost, budget, runs):
    return [estimate_probability(cost, DIMENSION, budget, seed) for seed in range(runs)]


@pytest.mark.medium
@pytest.mark.parametrize(
    ("cost", "probability"),
    [
        (HalfSpace(2.0), norm.sf(2.0)),
        (HalfSpace(3.1), norm.sf(3.1)),
        (HalfSpace(3.8), norm.sf(3.8)),
        (HalfSpace(3.1, noise=0.5), norm.sf(3.1)),
        (outside_a_ball, chi2.sf(81.0, DIMENSION)),
    ],
)
def test_estimates_and_intervals_meet_the_closed_form(cost, probability):
    found = estimates(cost, 2000, 60)
    values = np.array([one.probability for one in found])
    error = values.std() / np.sqrt(len(values))
    assert abs(values.mean() - probability) < 3.5 * error < 0.6 * probability
    inside = sum(one.low <= probability <= one.high for one in found)
    assert inside >= 50  # of 60; 95 % would be 57, and P(at most 49 | 90 %) is 3 %
    assert all(one.low < one.probability < one.high for one in found)


def test_large_rate_equals_plain_counting():
    (one,) = estimates(HalfSpace(0.8), 4000, 1)
    points = np.random.default_rng(5).random((20_000, DIMENSION))
    assert one.low < (HalfSpace(0.8)(points) < 0.0).mean() < one.high
    assert one.high / one.low < 2.0


@pytest.mark.parametrize("budget", [100, 999, 3000])
def test_no_more_points_are_evaluated_than_the_budget(budget):
    cost = HalfSpace(8.0)
    (one,) = estimates(cost, budget, 1)
    assert 0.8 * budget < cost.calls <= budget
    assert one.probability == one.low == 0.0 < norm.sf(8.0) < one.high < 30.0 / budget


def test_the_levels_fall_and_end_in_the_estimate():
    (one,) = estimates(HalfSpace(3.1), 2000, 1)
    costs, shares = np.array(one.levels).T
    assert (np.diff(costs) < 0.0).all() and (np.diff(shares) < 0.0).all()
    assert costs[-1] == 0.0 and shares[-1] == one.probability


def test_certain_and_impossible_events_have_exact_probability():
    def constant(value):
        return lambda points: np.full(len(points), value)

    (certain,), (never,) = estimates(constant(-1.0), 200, 1), estimates(constant(1.0), 200, 1)
    assert (certain.probability, certain.high) == (1.0, 1.0)
    assert never.probability == 0.0 and 0.0 < never.high < 0.2


def test_the_same_seed_gives_the_same_estimate():
    assert estimates(HalfSpace(3.1), 500, 2) == estimates(HalfSpace(3.1), 500, 2)
    assert len(set(estimates(HalfSpace(3.1), 500, 2))) == 2
