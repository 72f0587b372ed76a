"""The search for the least cost against random sampling and the package's own bookkeeping."""

import numpy as np
import pytest

from cosim.campaigns.falsification.search import minimize

pytest.importorskip("cma")
DIMENSION = 60


class Valley:
    """A noisy cost with minimum 0 that depends on ten coordinates only."""

    def __init__(self, noise=0.0):
        self.place, self.points = np.linspace(0.05, 0.95, 10), []
        self.noise, self.rng = noise, np.random.default_rng(2)
        self.costs = []

    def __call__(self, points):
        self.points += list(points)
        costs = ((points[:, :10] - self.place) ** 2).sum(axis=1) + self.noise * self.rng.standard_normal(len(points))
        self.costs += costs.tolist()
        return costs


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_search_beats_random_sampling(noise):
    found, dice = Valley(noise), Valley(noise)
    minimize(found, DIMENSION, 1500, 0)
    dice(np.random.default_rng(0).random((1500, DIMENSION)))
    assert min(found.costs) < 0.3 * min(dice.costs)
    assert np.median(found.costs) < min(dice.costs)


@pytest.mark.parametrize("budget", [1, 2, 30, 400])
def test_exactly_the_budget_is_evaluated_inside_the_cube(budget):
    found = Valley()
    minimize(found, DIMENSION, budget, 0)
    points = np.array(found.points)
    assert points.shape == (budget, DIMENSION) and ((points >= 0.0) & (points <= 1.0)).all()


def test_minimum_at_a_corner_is_found():
    found = []

    def cost(points):
        found.extend(points)
        return points.sum(axis=1)

    minimize(cost, 3, 600, 1)
    assert min(point.sum() for point in found) < 0.02


def test_stalled_search_restarts():
    """The cost is flat, so no generation is better than the first of its search."""
    points = []

    def flat(some):
        points.append(some.copy())
        return np.zeros(len(some))

    minimize(flat, 5, 2000, 0)
    sizes = [len(some) for some in points[1:]]
    assert sizes[0] == 8 and max(sizes) >= 32


def test_the_same_seed_gives_the_same_points_and_no_state_is_shared():
    np.random.seed(3)
    before = np.random.get_state()[1].tolist()
    one, same, other = Valley(), Valley(), Valley()
    minimize(one, DIMENSION, 300, 4)
    minimize(same, DIMENSION, 300, 4)
    minimize(other, DIMENSION, 300, 5)
    assert np.array_equal(one.points, same.points) and not np.array_equal(one.points, other.points)
    assert np.random.get_state()[1].tolist() == before
