"""Common points of regions: known points, and certificates checked by brute force."""

import numpy as np
import pytest

from controller.regions import Box, DepthBand, Ellipsoid, Region, Sphere
from cosim.precheck.region_intersection import TOLERANCE, box_about, box_within, common_depth, search

ORIGIN = (0.0, 0.0, 0.0)


def ball(name, x, radius, keep="in"):
    return Region(name, Sphere((x, 0.0, 0.0), radius), keep)


def searched(*regions):
    return search(regions, *box_about(regions, [ORIGIN], 3.0))


def test_deepest_common_point_of_two_spheres_is_midway():
    overlap = searched(ball("a", 0.0, 1.0), ball("b", 1.5, 1.0))
    assert overlap.found and not overlap.excluded
    assert overlap.point == pytest.approx((0.75, 0.0, 0.0), abs=1e-3)
    assert overlap.depth == pytest.approx(0.25, abs=1e-4)
    assert overlap.depth <= overlap.at_most <= overlap.depth + TOLERANCE


def test_two_balls_apart_have_no_common_point():
    overlap = searched(ball("a", 0.0, 1.0), ball("b", 2.5, 1.0))
    assert overlap.excluded and not overlap.found
    assert overlap.depth == pytest.approx(-0.25, abs=1e-4)


def test_a_gap_below_the_tolerance_is_neither_found_nor_excluded():
    overlap = searched(ball("a", 0.0, 1.0), ball("b", 2.002, 1.0))
    assert not overlap.found and not overlap.excluded


def test_a_covered_goal_is_known():
    overlap = searched(ball("goal", 5.0, 0.5), ball("rock", 5.0, 0.7, "out"))
    assert overlap.excluded
    assert overlap.depth == pytest.approx(-0.1, abs=1e-4)  # midway between the surfaces


@pytest.mark.slow
def test_intersection_matches_brute_force():
    rng = np.random.default_rng(4)
    for _ in range(4):
        regions = [
            Region("band", DepthBand(rng.uniform(-1, 1), rng.uniform(0.3, 1.0)), "in"),
            Region("egg", Ellipsoid(tuple(rng.uniform(-1, 1, 3)), (0.5, 1.0, 1.5)), "in"),
            Region("box", Box(tuple(rng.uniform(-1, 1, 3)), (1.0, 0.8, 2.0)), "out"),
            ball("rock", rng.uniform(-1, 1), 0.8, "out"),
        ]
        low, high = box_about(regions, [ORIGIN], 1.0)
        overlap = search(regions, low, high)
        best = common_depth(rng.uniform(low, high, (50_000, 3)), regions).max()
        assert best <= overlap.at_most
        assert best - 1e-6 <= overlap.depth + TOLERANCE
        assert overlap.depth == pytest.approx(common_depth(np.array([overlap.point]), regions)[0], abs=1e-9)


def test_search_box_is_clipped_to_finite_region_bounds():
    low, high = box_within(Region("band", DepthBand(2.0, 0.5), "in"), np.full(3, -9.0), np.full(3, 9.0))
    assert low.tolist() == [-9.0, -9.0, 1.5] and high.tolist() == [9.0, 9.0, 2.5]
