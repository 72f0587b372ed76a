"""Outlines of shapes in figures, against ray casting."""

import numpy as np
import pytest

from controller.regions import (
    Box,
    Cone,
    Cylinder,
    DepthBand,
    Ellipsoid,
    HalfSpace,
    Pipe,
    Prism,
    Region,
    Sphere,
)
from controller.regions.region_set import clearances_at
from cosim.report.figures.path import ABOVE, SIDE
from cosim.report.figures.shape_outlines import lines_of_shape

TURNED = (0.9, 0.1, -0.3, 0.2)
LOW, HIGH = np.array([-4.0, -4.0, -4.0]), np.array([4.0, 4.0, 4.0])
ASLANT = np.array([[0.6, 0.8, 0.0], [0.48, -0.36, -0.8]])
SHAPES = {
    "sphere": Sphere((0.5, -1.0, 1.0), 1.5),
    "ellipsoid": Ellipsoid((0.0, 1.0, 0.0), (2.0, 0.5, 1.0), TURNED),
    "box": Box((0.0, 0.0, 1.0), (1.0, 2.0, 3.0), TURNED),
    "cylinder": Cylinder((0.0, 0.0, -1.0), (2.0, -1.0, 2.0), 0.7),
    "star": Prism(((-2.0, -2.0), (2.0, -1.5), (3.0, 0.0), (1.5, -1.0), (1.0, 1.0), (0.8, -1.0)), -1.0, 1.0),
    "cone": Cone((1.0, 1.0, 2.0), (-1.0, 0.5, -0.7), 0.5, 3.0),
    "bent pipe": Pipe(((-2.0, 0.0, 0.0), (2.0, 0.0, 0.5), (2.0, 2.0, 0.0), (0.0, 2.0, -2.0), (0.0, -2.0, -2.0)), 0.4),
    "band": DepthBand(1.0, 1.2),
    "half space": HalfSpace((1.0, 0.0, 0.0), (1.0, 1.0, 0.4)),
}


def within(areas, points):
    """Return whether closed lines go around points, by the angles that they turn about them."""
    turns = np.zeros(len(points))
    for area in areas:
        x, y = np.moveaxis(area[None] - points[:, None], 2, 0)
        turns += np.sum(np.diff(np.unwrap(np.arctan2(y, x), axis=1), axis=1), axis=1) / (2.0 * np.pi)
    return np.round(turns) != 0


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("view", [SIDE, ABOVE, ASLANT], ids=["side", "above", "aslant"])
@pytest.mark.parametrize("name", SHAPES)
def test_projected_area_matches_ray_casting(name, view):
    shape = SHAPES[name]
    lines = lines_of_shape(shape, LOW, HIGH, view)
    places = np.random.default_rng(5).uniform(-4.0, 4.0, (300, 2))
    along = np.linspace(-9.0, 9.0, 721)[:, None] * np.cross(view[0], view[1])
    clear = np.full(len(places), np.inf)
    for i, place in enumerate(places):
        line = place @ view + along
        line = line[((line >= LOW) & (line <= HIGH)).all(axis=1)]
        if len(line):
            clear[i] = clearances_at(line, Region("it", shape, "out")).min()
    covered = within(lines.areas, places)
    told = np.abs(clear) > 0.06  # flat faces cut some cm off what is round
    assert (clear[told] < 0.0).sum() > 5
    assert (covered == (clear < 0.0))[told].all()


@pytest.mark.parametrize("name", ["star", "bent pipe", "cylinder", "box", "cone"])
def test_outline_separates_covered_from_free_area(name):
    lines = lines_of_shape(SHAPES[name], LOW, HIGH, ASLANT)
    size = 8e-3
    for outline in lines.outline:
        ends = np.stack([outline[:-1], outline[1:]], axis=1)
        for a, b in ends[np.isfinite(ends).all(axis=(1, 2))]:
            across = np.array([(b - a)[1], -(b - a)[0]]) / np.linalg.norm(b - a)
            sides = (a + b) / 2.0 + size * np.array([[1.0], [-1.0]]) * across
            assert not within(lines.areas, sides).all()


def test_a_shape_beyond_the_box_is_not_drawn():
    for shape in (Sphere((9.0, 0.0, 0.0), 1.0), Box((9.0, 0.0, 0.0), (1.0, 1.0, 1.0)), DepthBand(9.0, 1.0)):
        assert lines_of_shape(shape, LOW, HIGH, SIDE) is None
