"""Surfaces as triangles: on the shape, closed, facing outward, of nearly the shape's volume."""

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from controller.errors import RegionError
from controller.regions import (
    Box,
    Cone,
    Cylinder,
    DepthBand,
    Ellipsoid,
    HalfSpace,
    Orientation,
    Pipe,
    Prism,
    Region,
    Sphere,
)
from controller.regions.region_set import clearances_at, surface_of
from controller.regions.shapes import ENTRIES
from controller.regions.triangle_mesh import AROUND, closed_grid, patches, sector

LIMITS = ((-4.0, -3.0, 0.0), (4.0, 5.0, 6.0))
TURNED = (0.9, 0.1, -0.3, 0.2)
BENT = ((0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (2.0, 2.0, 1.0), (2.5, 3.0, 3.0))
STAR = ((0.0, 0.0), (2.0, 0.5), (3.0, 2.0), (1.5, 1.0), (1.0, 3.0), (0.8, 1.0))


def area(corners):
    x, y = np.array(corners).T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0


FAN = math.tau / 3.0 * (1.0 - math.cos(0.6))
# each with its volume, where a formula has it
SOLIDS = {
    "sphere": (Sphere((2.0, 0.0, 1.8), 0.5), math.pi / 6.0),
    "ellipsoid": (Ellipsoid((1.0, 2.0, 3.0), (0.5, 1.0, 2.0), TURNED), 4.0 / 3.0 * math.pi),
    "box": (Box((1.0, 2.0, 3.0), (0.5, 1.0, 2.0), TURNED), 1.0),
    "cylinder": (Cylinder((0.0, 0.0, 1.0), (1.0, 2.0, 3.0), 0.4), math.pi * 0.4**2 * 3.0),
    "prism": (Prism(STAR, 1.0, 3.0), 2.0 * area(STAR)),
    "prism the other way around": (Prism(STAR[::-1], 1.0, 3.0), 2.0 * area(STAR)),
    "cone": (Cone((0.0, 0.0, 2.0), (1.0, 0.0, -0.2), 0.6, 2.0), FAN * 2.0**3),
    "half a ball": (Cone((0.0, 0.0, 2.0), (0.0, 1.0, 0.0), math.pi / 2.0, 2.0), math.tau / 3.0 * 2.0**3),
    "straight pipe": (Pipe(((0.0, 0.0, 1.0), (3.0, 0.0, 1.0)), 0.5), math.pi * 0.5**2 * 3.0 + math.pi / 6.0),
    "bent pipe": (Pipe(BENT, 0.3), None),
}


def signed_volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def assert_closed(mesh):
    """Assert that each edge is there once in each direction."""
    edges = Counter((a, b) for t in mesh.triangles.tolist() for a, b in zip(t, [*t[1:], t[0]], strict=True))
    assert set(edges.values()) == {1} and all((b, a) in edges and a != b for a, b in edges)


def distances(shape, mesh):
    return np.abs(clearances_at(mesh.vertices, Region("shape", shape, "in")))


@pytest.mark.parametrize("name", SOLIDS)
def test_every_corner_is_on_the_surface(name):
    shape, _ = SOLIDS[name]
    assert distances(shape, surface_of(shape, LIMITS)).max() < 1e-9


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_face_outward(name):
    mesh = surface_of(SOLIDS[name][0], LIMITS)
    assert_closed(mesh)
    places = np.round(mesh.vertices, 7)
    assert len(np.unique(places, axis=0)) == len(places)  # one corner at each place
    assert signed_volume(mesh) > 0.0


@pytest.mark.parametrize("name", [name for name, (_, volume) in SOLIDS.items() if volume])
def test_solids_have_nearly_the_volume_of_the_formula(name):
    shape, volume = SOLIDS[name]
    flat = isinstance(shape, Box | Prism)
    assert signed_volume(surface_of(shape, LIMITS)) == pytest.approx(volume, rel=1e-12 if flat else 0.05)


def test_bent_pipe_volume_matches_monte_carlo():
    pipe = SOLIDS["bent pipe"][0]
    low, high = np.array(pipe.bounds())
    points = np.random.default_rng(1).uniform(low, high, (40_000, 3))
    inside = (clearances_at(points, Region("pipe", pipe, "in")) > 0.0).mean() * np.prod(high - low)
    assert signed_volume(surface_of(pipe, LIMITS)) == pytest.approx(inside, rel=0.06)


@pytest.mark.parametrize(
    "shape", [DepthBand(2.5, 1.0), HalfSpace((0.0, 1.0, 2.0), (1.0, 1.0, 0.2))], ids=lambda s: type(s).__name__
)
def test_plane_surfaces_span_the_view_limits(shape):
    mesh = surface_of(shape, LIMITS)
    assert distances(shape, mesh).max() < 1e-9
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert np.linalg.norm(normals, axis=1).min() >= (np.ptp(LIMITS, axis=0) ** 2).sum() * 0.99
    outside = (a + b + c) / 3.0 + 1e-3 * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    assert (clearances_at(outside, Region("shape", shape, "in")) < 0.0).all()


coordinate = st.floats(-3.0, 3.0)


@pytest.mark.medium
@given(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=2, max_size=5), st.floats(0.05, 1.0))
@example([(0.0, 0.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.125, 0.0)], 0.125)  # a ray along 3 m, 5 mm inside the surface
@example([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], 1.0)  # the way back, after a bend
def test_pipes_of_any_bends_have_their_corners_on_the_surface(points, radius):
    points = tuple(tuple(round(x, 2) for x in point) for point in points)
    if any(math.dist(a, b) < 0.1 for a, b in zip(points, points[1:], strict=False)):
        return
    pipe = Pipe(points, radius)
    assert distances(pipe, surface_of(pipe, LIMITS)).max() < 1e-6


@given(st.lists(st.floats(0.3, 3.0), min_size=3, max_size=9))
def test_star_shaped_polygons_are_triangulated_completely(radii):
    angles = np.linspace(0.0, math.tau, len(radii), endpoint=False)
    corners = tuple((r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True))
    mesh = surface_of(Prism(corners, 0.0, 2.0), LIMITS)
    assert signed_volume(mesh) == pytest.approx(2.0 * area(corners), rel=1e-9)


def test_a_sector_of_more_than_half_a_turn_is_closed_too():
    mesh = sector((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 2.5, 1.0)
    assert signed_volume(mesh) == pytest.approx(math.tau / 3.0 * (1.0 - math.cos(2.5)), rel=0.05)
    on_end = mesh.vertices[np.linalg.norm(mesh.vertices, axis=1) > 0.5]  # which is rounded in even steps
    steps = np.diff(np.unique(np.round(np.arccos(on_end[:, 0]), 6)))
    assert len(on_end) == len(mesh.vertices) - 1 and np.ptp(steps) < 1e-5 and steps.max() <= math.tau / AROUND


def test_a_ring_is_closed_faces_outward_and_has_its_volume():
    turn, around = (np.linspace(0.0, math.tau, n, endpoint=False) for n in (24, 16))
    turn, around = np.meshgrid(turn, around, indexing="ij")
    out = 3.0 + 0.5 * np.cos(around)
    mesh = closed_grid(np.stack([out * np.cos(turn), out * np.sin(turn), 0.5 * np.sin(around)], axis=-1))
    assert_closed(mesh)
    sides = np.linalg.norm(np.diff(mesh.vertices[mesh.triangles], axis=1), axis=2)
    assert sides.max() < 1.0  # of neighbors alone
    assert signed_volume(mesh) == pytest.approx(2.0 * math.pi**2 * 3.0 * 0.5**2, rel=0.05)


def test_patches_are_squares_about_the_middle_that_reach_across_the_limits():
    mesh = patches([(np.zeros(3), np.array([0.0, 0.0, 1.0]))], LIMITS)
    low, high = np.array(LIMITS)
    assert mesh.vertices[:, 2] == pytest.approx(0.0)
    assert mesh.vertices[:, :2].mean(axis=0) == pytest.approx(((low + high) / 2.0)[:2])
    sides = np.linalg.norm(np.diff(np.vstack([mesh.vertices, mesh.vertices[:1]]), axis=0), axis=1)
    assert sides == pytest.approx(np.full(4, np.linalg.norm(high - low)))


def test_shapes_of_attitude_have_no_surface():
    with pytest.raises(RegionError, match="'orientation' has no surface"):
        surface_of(Orientation((1.0, 0.0, 0.0, 0.0), 0.5), LIMITS)


@pytest.mark.parametrize("name", [name for name, entry in ENTRIES.items() if entry.half_axes or entry.planes])
def test_half_axes_and_planes_of_shapes_lie_on_the_surface(name):
    entry = ENTRIES[name]
    shape = entry.example
    if entry.half_axes:
        center, axes = entry.half_axes(shape)
        ways = np.random.default_rng(6).normal(size=(50, 3))
        points = center + ways / np.linalg.norm(ways, axis=1, keepdims=True) @ axes
        outward = np.empty((0, 3))
    else:
        points = np.array([point for point, _ in entry.planes(shape)])
        outward = points + 1e-3 * np.array([normal for _, normal in entry.planes(shape)])
    region = Region("it", shape, "out")
    np.testing.assert_allclose(clearances_at(points, region), 0.0, atol=1e-9)
    if len(outward):
        np.testing.assert_allclose(clearances_at(outward, region), 1e-3, atol=1e-9)
