"""Ray distances against closed forms and dense sampling."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

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
    Visibility,
    pack,
)
from controller.regions.rays import TOUCHING, ray_distances
from controller.regions.region_set import clearances_at
from tests.examples import examples

NORTH, EAST, DOWN = np.eye(3)
FARTHEST = 30.0
TURNED = tuple(np.array([0.9, 0.1, -0.3, 0.2]) / np.linalg.norm([0.9, 0.1, -0.3, 0.2]))
L_SHAPED = Prism(((0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (1.0, 0.5), (0.0, 2.0)), 1.0, 3.0)
CONVEX = [
    Sphere((2.0, 0.0, 1.8), 0.5),
    DepthBand(2.5, 0.4),
    HalfSpace((0.0, 0.0, 1.0), (1.0, 1.0, 0.2)),
    Box((1.0, 1.0, 1.0), (2.0, 3.0, 1.0), TURNED),
    Cylinder((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), 0.7),
    Ellipsoid((1.0, 0.0, 1.0), (2.0, 1.0, 0.5), TURNED),
    Prism(((0.0, 0.0), (3.0, 0.0), (2.0, 2.0)), 1.0, 3.0),
    Cone((1.0, 1.0, 1.0), (-1.0, 0.0, 0.3), 0.6, 3.0),
]
BENT = [Pipe(((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 1.0)), 0.4), L_SHAPED]
each_shape = pytest.mark.parametrize("shape", CONVEX + BENT, ids=lambda shape: type(shape).__name__)
origins = st.lists(st.floats(-5.0, 6.0), min_size=3, max_size=3).map(np.array)
directions = (
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3)
    .map(np.array)
    .filter(lambda d: np.linalg.norm(d) > 0.1)
    .map(lambda d: d / np.linalg.norm(d))
)


def rays(regions, origin, *ways, farthest=FARTHEST):
    packed = pack(regions)
    distances = np.full(len(ways), -1.0)
    ray_distances(packed, np.asarray(origin, float), np.array(ways, float), farthest, distances)
    return distances


def out(*shapes):
    return [Region(f"r{i}", shape, "out") for i, shape in enumerate(shapes)]


# ---- closed forms --------------------------------------------------------------------------------------------------


@given(origins, directions, st.floats(0.1, 2.0))
def test_ray_to_sphere_matches_closed_form(origin, way, radius):
    (met,) = rays(out(Sphere((1.0, 2.0, 0.5), radius)), origin, way)
    to_center = np.array([1.0, 2.0, 0.5]) - origin
    along = to_center @ way
    aside = math.sqrt(max(to_center @ to_center - along * along, 0.0))
    if np.linalg.norm(to_center) <= radius:
        assert met == 0.0
    elif along <= 0.0 or aside > radius + 2.0 * TOUCHING:
        assert met == math.inf
    elif aside < radius - 0.01:
        assert met == pytest.approx(along - math.sqrt(radius**2 - aside**2), abs=20.0 * TOUCHING)


@given(origins, directions, directions)
def test_ray_to_plane_matches_closed_form(origin, way, normal):
    point = np.array([0.5, -1.0, 2.0])
    (met,) = rays(out(HalfSpace(tuple(point), tuple(normal))), origin, way)
    height, sinking = (origin - point) @ normal, -way @ normal
    if height <= 0.0:
        assert met == 0.0
    elif sinking * FARTHEST < height * (1.0 - 1e-9):
        assert met == math.inf
    elif sinking * FARTHEST > height * (1.0 + 1e-9):
        assert met == pytest.approx(height / sinking, rel=1e-9)


def test_direction_components_near_zero_count_as_zero():
    assert rays(out(DepthBand(2.5, 0.4)), (0.0, 0.0, 0.0), (0.0, 1.0, 2e-309)) == math.inf
    below_edge = (0.0, 0.0, 0.0)  # the prism's vertical edge is straight below
    (met,) = rays(out(L_SHAPED), below_edge, (0.0, 1e-190, 1.0))
    assert met == pytest.approx(1.0, abs=20.0 * TOUCHING)


# ---- any shape -----------------------------------------------------------------------------------------------------


@pytest.mark.medium(fast=5)
@each_shape
@settings(max_examples=examples(60), deadline=None)
@given(origins, directions)
def test_ray_distance_matches_dense_sampling(shape, origin, way):
    (region,) = regions = out(shape)
    (met,) = rays(regions, origin, way)
    steps = np.arange(0.0, 15.0, 0.01)
    walked = clearances_at(origin + steps[:, None] * way, region)
    inside = np.flatnonzero(walked <= 0.0)
    first = steps[inside[0]] if inside.size else math.inf
    assert met <= first + 1e-9
    if met < math.inf:
        ended = clearances_at((origin + met * way)[None], region)[0]
        grazed = shape is L_SHAPED and walked[steps <= met].min() < 0.1  # which may use up all looks
        assert (ended <= TOUCHING + 1e-9 or grazed) and (met == 0.0 or ended >= -1e-9)


@given(origins, directions)
def test_ray_ends_at_nearest_of_several_regions(origin, way):
    together = out(*CONVEX[:1], *CONVEX[3:], *BENT)
    alone = [rays([region], origin, way)[0] for region in together]
    assert rays(together, origin, way)[0] == pytest.approx(min(alone), abs=1e-9)


def test_batched_rays_equal_single_rays():
    regions, angles = out(*CONVEX, *BENT), np.arange(0.0, 2.0 * math.pi, 0.1)
    ways = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    origin = (4.0, 3.5, 1.5)
    assert rays(regions, origin, *ways).tolist() == [rays(regions, origin, way)[0] for way in ways]


def test_ray_from_inside_a_keep_in_region_meets_its_boundary():
    tank = [Region("tank", Sphere((0.0, 0.0, 0.0), 5.0), "in")]
    met = rays(tank, (3.0, 0.0, 0.0), NORTH, -NORTH, EAST)
    assert met == pytest.approx([2.0, 8.0, 4.0], abs=1e-3)
    assert (rays(tank, (6.0, 0.0, 0.0), NORTH, -NORTH) == 0.0).all()


# ---- passing by ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "shape",
    [
        HalfSpace((0.0, 0.0, 5.0), (0.0, 0.0, -1.0)),
        DepthBand(6.0, 1.0),
        Box((0.0, 0.0, 6.0), (100.0, 100.0, 2.0)),
        Pipe(((-50.0, 0.0, 6.0), (0.0, 0.0, 6.0), (50.0, 0.0, 6.0)), 1.0),
        Prism(((-50.0, -50.0), (50.0, -50.0), (50.0, 50.0), (0.0, 5.0), (-50.0, 50.0)), 5.0, 7.0),
    ],
    ids=lambda shape: type(shape).__name__,
)
def test_level_ray_above_a_shape_misses_it(shape):
    angles = np.radians(range(0, 360, 5))
    ways = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    assert (rays(out(shape), (0.0, 0.0, 4.99), *ways) == math.inf).all()


def test_ray_along_a_notched_wall_is_conservative():
    wall = Prism(((-50.0, -5.0), (50.0, -5.0), (50.0, 0.0), (40.0, 0.0), (39.0, -1.0), (-50.0, 0.0)), 0.0, 9.0)
    met, closer = rays(out(wall), (42.0, 0.5, 5.0), NORTH, (0.8, -0.6, 0.0))
    assert met > 5.0 and closer == pytest.approx(0.5 / 0.6, abs=1e-3)


def test_regions_beyond_range_are_not_detected():
    regions = out(Sphere((10.0, 0.0, 0.0), 1.0))
    assert rays(regions, (0.0, 0.0, 0.0), NORTH, farthest=8.9)[0] == math.inf
    assert rays(regions, (0.0, 0.0, 0.0), NORTH, farthest=9.1)[0] == pytest.approx(9.0, abs=1e-3)


def test_ray_meets_a_shifted_region_at_its_position():
    packed, met = pack(out(Sphere((0.0, 0.0, 0.0), 1.0))), np.empty(2)
    packed.shifts[0] = 0.0, 6.0, 0.0
    ray_distances(packed, np.zeros(3), np.array([NORTH, EAST]), FARTHEST, met)
    assert met.tolist() == [math.inf, pytest.approx(5.0, abs=1e-3)]


def test_attitude_regions_do_not_block_rays():
    regions = out(Orientation(TURNED, 0.8), Visibility((5.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.9))
    assert rays(regions, (0.0, 0.0, 0.0), NORTH)[0] == math.inf
    assert rays([], (0.0, 0.0, 0.0), NORTH)[0] == math.inf


# ---- lost numbers --------------------------------------------------------------------------------------------------


def test_nan_input_gives_nan_ray_distance():
    near, met = out(Sphere((3.0, 0.0, 0.0), 1.0), *CONVEX[3:]), np.empty(1)
    assert np.isnan(rays(near, (math.nan, 0.0, 9.0), NORTH, EAST)).all()
    assert np.isnan(rays(near, (0.0, 0.0, 9.0), (math.nan, 0.0, 0.0))).all()
    packed = pack(near)
    packed.shifts[0] = math.nan
    ray_distances(packed, np.array([-6.0, 0.0, 1.0]), NORTH[None], FARTHEST, met)
    assert math.isnan(met[0])


@pytest.mark.parametrize("bearing", np.linspace(0.0, 2.0 * np.pi, 9)[:-1])
def test_distant_notched_shape_is_met_from_every_side(bearing):
    """Its circle passes by the rays that cannot meet it, and by no other."""
    origin = np.array([1.5 + 8.0 * np.cos(bearing), 0.9 + 8.0 * np.sin(bearing), 2.0])
    towards = np.array([0.5, 1.0, 2.0]) - origin
    length = np.linalg.norm(towards)
    distances, rays = np.empty(2), np.array([towards / length, -towards / length])
    ray_distances(pack([Region("notched", L_SHAPED, "out")]), origin, rays, 50.0, distances)
    assert 0.0 < distances[0] < length and distances[1] == np.inf
