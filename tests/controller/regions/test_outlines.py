"""Outlines of prisms: self-intersection, convexity, and bounding circle in any pose."""

import itertools

import numpy as np
import pytest

from controller.errors import RegionError
from controller.regions import Prism
from controller.regions.rays import _circle_about, _is_convex

SOUND = {
    "triangle": ((0, 0), (2, 0), (0, 3)),
    "notched": ((0, 0), (6, 0), (6, 4), (3, 1), (0, 4)),
    "straight on, flat": ((0, 0), (4, 1), (8, 2), (0, 6)),
    "straight on, steep": ((0, 0), (1, 4), (2, 8), (-6, 0)),
}
TOUCHING = {
    "bow tie": ((0, 0), (2, 2), (2, 0), (0, 2)),
    "through a corner": ((0, 0), (2, 0), (2, 2), (1, 0), (0, 2)),
    "back on itself, flat": ((0, 0), (8, 2), (4, 1), (0, 6)),
    "back on itself, steep": ((0, 0), (2, 8), (1, 4), (-6, 0)),
    "crossing far away": ((0, 0), (9, 1), (10, 7), (9, 3), (11, 4), (1, 8)),
    "a corner twice": ((0, 0), (2, 0), (2, 0), (0, 2)),
}


def images(corners):
    """Return an outline mirrored, turned by right angles and moved, in whole numbers, either way round."""
    for swap, a, b, back in itertools.product((False, True), (1, -1), (1, -1), (1, -1)):
        moved = [(a * x + 5, b * y - 7) for x, y in corners][::back]
        yield tuple((float(y), float(x)) if swap else (float(x), float(y)) for x, y in moved)


@pytest.mark.parametrize("name", TOUCHING)
def test_self_intersecting_outline_is_rejected(name):
    for corners in images(TOUCHING[name]):
        with pytest.raises(RegionError, match="corners"):
            Prism(corners, 0.0, 1.0)


@pytest.mark.parametrize("name", SOUND)
def test_simple_outline_is_accepted(name):
    for corners in images(SOUND[name]):
        packed = np.array(Prism(corners, 0.0, 1.0).packed())
        points = packed[2:].reshape(-1, 2)
        edges = np.roll(points, -1, axis=0) - points
        turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
        assert _is_convex(packed) == np.all(turns >= 0.0) == (name != "notched")
        x, y, radius = _circle_about(packed)
        assert (x, y) == pytest.approx(points.mean(axis=0))
        assert radius == pytest.approx(np.linalg.norm(points - points.mean(axis=0), axis=1).max())
