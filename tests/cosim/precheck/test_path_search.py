"""Path search: found paths are free, and blocked scenes have none."""

import numpy as np
import pytest

from controller.laws.deployable.gains import DeployableGains
from controller.regions import Box, Region, Sphere
from controller.regions.region_set import clearances_at
from cosim.precheck.path_search import find_path

ORIGIN, GAINS = (0.0, 0.0, 5.0), DeployableGains()


def ball(name, x, radius, keep="in", **given):
    return Region(name, Sphere((x, 0.0, 5.0), radius), keep, **given)


def box(name, x, size, keep):
    return Region(name, Box((x, 0.0, 5.0), size), keep)


WALL = box("wall", 3.0, (0.5, 400.0, 400.0), "out")
GOAL = ball("goal", 6.0, 0.5)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("regions", "found"),
    [
        ([], True),
        ([ball("rock", 3.0, 1.0, "out")], True),
        ([ball("soft rock", 3.0, 1.0, "out", hard=False)], True),
        ([WALL], False),
        ([box("wall of 20 m", 3.0, (0.5, 20.0, 40.0), "out")], True),
        # a shell about the start, closed, and one that ends above the goal
        ([ball("lid", 0.0, 2.0)], False),
        ([box("tube", 3.0, (8.0, 1.2, 1.2), "in")], True),
        ([box("tube", 3.0, (8.0, 1.2, 1.2), "in"), ball("plug", 3.0, 1.0, "out")], False),
        ([ball("at the start", -1.001, 1.0, "out")], True),
    ],
    ids=["open", "rock", "soft", "wall", "wide wall", "shut in", "tube", "plugged tube", "start at a surface"],
)
def test_path_is_found_if_one_exists(regions, found):
    way = find_path(regions, GOAL, ORIGIN, GAINS, 60.0)
    assert way.found is found
    if not found:
        assert way.searched == pytest.approx(60.0)
        return
    assert np.array_equal(way.corners[0], ORIGIN) and clearances_at(np.array(way.corners[-1:]), GOAL)[0] > 0.0
    for a, b in zip(way.corners[:-1], way.corners[1:], strict=True):
        points = np.linspace(a, b, 500)
        assert all(clearances_at(points, region).min() >= way.clearance - 0.01 > -0.01 for region in regions)


def test_the_length_is_that_of_the_path():
    way = find_path([], GOAL, ORIGIN, GAINS, 60.0)
    assert way.length == pytest.approx(5.8, abs=1e-6)  # 0.3 m into the ball
    assert way.clearance == np.inf and way.searched < 1.0


def test_search_time_is_bounded_by_the_run_duration():
    assert find_path([WALL], GOAL, ORIGIN, GAINS, 3.0).searched == pytest.approx(3.0)
