"""Regions: values, gradients and distances of each shape against its definition."""

import dataclasses
import inspect
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from controller.errors import RegionError
from controller.regions import (
    Box,
    Cone,
    Cylinder,
    DepthBand,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Orientation,
    Pipe,
    Points,
    Prism,
    Region,
    Sphere,
    Visibility,
    pack,
)
from controller.regions.region_set import SHAPES, clearances_at, of_attitude, surface_of
from controller.regions.shapes import ENTRIES

TURNED = tuple(np.array([0.9, 0.1, -0.3, 0.2]) / np.linalg.norm([0.9, 0.1, -0.3, 0.2]))
R = Rotation.from_quat(np.roll(TURNED, -1)).as_matrix()

EXAMPLES = [entry.example for entry in ENTRIES.values()]
IN_SPACE = [shape for shape in EXAMPLES if not of_attitude(shape)]
each_shape = pytest.mark.parametrize("shape", EXAMPLES, ids=lambda shape: type(shape).__name__)
each_shape_in_space = pytest.mark.parametrize("shape", IN_SPACE, ids=lambda shape: type(shape).__name__)
points = st.lists(st.floats(-4.0, 5.0), min_size=3, max_size=3).map(np.array)
turns = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).map(np.array)
attitudes = turns.filter(lambda e: np.linalg.norm(e) > 0.1).map(lambda e: e / np.linalg.norm(e))
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def evaluated(shape, p, e=LEVEL, keep="in", velocity=(0.0, 0.0, 0.0)):
    """Return g, its derivatives by position and by rotation, and the clearance, after 1.5 s."""
    packed = pack([Region("r", shape, keep, velocity)])
    packed.move_to(1.5)
    values, gradients, rotation_gradients, clearances = np.empty(1), np.empty((1, 3)), np.empty((1, 3)), np.empty(1)
    packed.evaluate(np.asarray(p, float), np.asarray(e, float), values, gradients, rotation_gradients, clearances)
    return values[0], gradients[0], rotation_gradients[0], clearances[0]


def at(shape, p, keep="in"):
    """Return g, its gradient and the clearance."""
    g, gradient, _, clearance = evaluated(shape, p, keep=keep)
    return g, gradient, clearance


def turned(e, theta):
    """Return the attitude after a small rotation about the body's axes, by SciPy."""
    both = Rotation.from_quat(np.roll(e, -1)) * Rotation.from_rotvec(theta)
    return np.roll(both.as_quat(), 1)


def contains(shape, p, e=LEVEL):
    """Membership by the words of each definition; shares no code with the shapes."""
    p = np.asarray(p, float)
    attitude = Rotation.from_quat(np.roll(e, -1))
    match shape:
        case Orientation(quaternion, tolerance):
            return (Rotation.from_quat(np.roll(quaternion, -1)).inv() * attitude).magnitude() <= tolerance
        case Visibility(feature, camera_axis, half_angle, camera_position):
            sight = np.array(feature) - (p + attitude.apply(camera_position))
            cosine = sight @ attitude.apply(camera_axis) / np.linalg.norm(sight) / np.linalg.norm(camera_axis)
            return math.acos(np.clip(cosine, -1, 1)) <= half_angle
        case Sphere(center, radius):
            return np.linalg.norm(p - center) <= radius
        case DepthBand(depth, tolerance):
            return depth - tolerance <= p[2] <= depth + tolerance
        case HalfSpace(point, normal):
            return (p - point) @ normal <= 0.0
        case Box(center, size):
            return bool(np.all(np.abs(R.T @ (p - center)) <= np.array(size) / 2))
        case Cylinder(start, end, radius):
            axis = np.subtract(end, start)
            along = (p - start) @ axis / (axis @ axis)
            return 0.0 <= along <= 1.0 and np.linalg.norm(p - start - along * axis) <= radius
        case Ellipsoid(center, semi_axes):
            return np.linalg.norm(R.T @ (p - center) / semi_axes) <= 1.0
        case Prism(corners, top, bottom):
            return top <= p[2] <= bottom and winding(corners, p[:2]) != 0
        case Pipe(nodes, radius):
            ends = [np.linspace(a, b, 4001) for a, b in zip(nodes, nodes[1:], strict=False)]
            return np.linalg.norm(np.vstack(ends) - p, axis=1).min() <= radius
        case Cone(feature, axis, half_angle, reach):
            d = p - feature
            angle = math.acos(np.clip(d @ axis / np.linalg.norm(d) / np.linalg.norm(axis), -1, 1))
            return np.linalg.norm(d) <= reach and angle <= half_angle
        case Mesh():  # a cuboid grown by its offset
            return np.linalg.norm(np.maximum(np.abs(p - 1.0) - (1.0, 1.5, 0.5), 0.0)) <= shape.offset
        case Points():
            rows = np.loadtxt(shape.file, delimiter=",", skiprows=1) + shape.position
            return np.linalg.norm(rows - p, axis=1).min() <= shape.radius
    raise AssertionError(shape)


def winding(corners, p):
    turns = np.array(corners) - p
    angles = np.unwrap(np.arctan2(*np.vstack([turns, turns[:1]]).T))
    return round((angles[-1] - angles[0]) / (2 * math.pi))


@pytest.mark.medium(fast=4)
@each_shape
@given(p=points, e=attitudes)
def test_sign_of_clearance_matches_containment(shape, p, e):
    g, _, _, clearance = evaluated(shape, p, e)
    assert g * clearance <= 0.0
    if abs(clearance) > getattr(shape, "error", float)() + 1e-6:
        assert (clearance > 0.0) == contains(shape, p, e)


@pytest.mark.medium(fast=6)
@each_shape
def test_gradients_match_central_differences(shape):
    """At nearly all poses; at ridges, where a gradient has two sides, it is one of them."""
    rng, h, smooth = np.random.default_rng(3), 1e-6, 0
    for _ in range(60):
        p, e = rng.uniform(-4.0, 5.0, 3), rng.normal(size=4)
        e /= np.linalg.norm(e)
        g, gradient, turning, _ = evaluated(shape, p, e)
        ahead, behind = (
            [evaluated(shape, p + s * axis, e)[0] for axis in np.eye(3)]
            + [evaluated(shape, p, turned(e, s * axis))[0] for axis in np.eye(3)]
            for s in (h, -h)
        )
        kink = np.abs(np.array(ahead) + behind - 2.0 * g).max() / h
        derivatives, rough = np.r_[gradient, turning], kink > 1e-3 * max(1.0, np.abs(gradient).max())
        smooth += not rough
        assert rough or derivatives == pytest.approx(np.subtract(ahead, behind) / (2.0 * h), abs=0.5 * kink + 1e-6)
    assert smooth >= 58


@pytest.mark.medium(fast=3)
@each_shape_in_space
@given(p=points, e=attitudes)
def test_spatial_shapes_do_not_depend_on_attitude(shape, p, e):
    g, gradient, turning, clearance = evaluated(shape, p, e)
    level = at(shape, p)
    assert (g, *gradient, clearance) == (level[0], *level[1], level[2])
    assert not turning.any()


@pytest.mark.medium(fast=4)
@each_shape_in_space
@given(p=points, q=points)
def test_distance_changes_no_faster_than_one_moves(shape, p, q):
    assert abs(at(shape, p)[2] - at(shape, q)[2]) <= np.linalg.norm(p - q) * (1 + 1e-9) + 1e-12


@pytest.mark.slow
@each_shape_in_space
def test_distance_is_that_of_the_nearest_point_of_the_surface(shape):
    """Outside by minimizing |x - p| over the set, inside by growing a ball until it leaves the set."""
    rng = np.random.default_rng(5)
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for p in rng.uniform(-3.0, 4.0, (12, 3)):
        distance = -at(shape, p)[2]
        if distance > 0.0:
            inner = np.vstack([p + 12.0 * t * directions for t in np.linspace(0.0, 1.0, 60)])
            inner = inner[clearances_at(inner, Region("r", shape, "in")) > 0.0]
            nearest = np.linalg.norm(inner - p, axis=1)
            starts = inner[np.argsort(nearest)[:3]]
            best = min(
                minimize(
                    lambda x, p=p: float((x - p) @ (x - p)), start, method="SLSQP", options={"ftol": 1e-14},
                    constraints={"type": "ineq", "fun": lambda x: at(shape, x)[2]},
                ).fun
                for start in starts
            )  # fmt: skip
            assert distance == pytest.approx(math.sqrt(best), abs=2e-4)
        elif not isinstance(shape, Pipe):  # whose inside distance is a bound
            assert all(contains(shape, p + 0.999 * -distance * d) for d in directions[:400])
            assert not all(contains(shape, p + (0.03 - 1.02 * distance) * d) for d in directions)


@pytest.mark.medium(fast=4)
@each_shape
@given(p=points, e=attitudes)
def test_keep_out_negates_keep_in(shape, p, e):
    for kept_in, kept_out in zip(evaluated(shape, p, e, "in"), evaluated(shape, p, e, "out"), strict=True):
        assert np.array_equal(kept_in, -kept_out)


EDGES = [
    *IN_SPACE,
    Ellipsoid((0.0, 0.0, 0.0), (3.0, 2.0, 1.0)),
    Cone((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), math.pi / 2, 2.0),
]


@pytest.mark.parametrize("shape", EDGES, ids=lambda shape: type(shape).__name__)
def test_values_are_finite_at_centers_axes_and_corners(shape):
    """At corners of the surface and between each two of them, where axes and ridges lie."""
    corners = surface_of(shape, ((-4.0,) * 3, (5.0,) * 3)).vertices[:24]
    centers = [np.array(getattr(shape, name)) for name in ("center", "feature", "start") if hasattr(shape, name)]
    for p in [*(a + b for a in 0.5 * corners for b in 0.5 * corners), *centers]:
        g, gradient, clearance = at(shape, p)
        assert np.isfinite([g, *gradient, clearance]).all()


@pytest.mark.parametrize(
    ("axes", "p", "distance"),
    [
        ((3.0, 2.0, 1.0), (0.0, 0.0, 0.0), -1.0),
        ((3.0, 2.0, 1.0), (5.0, 0.0, 0.0), 2.0),
        ((3.0, 2.0, 1.0), (0.0, 0.0, 0.4), -0.6),
        # the nearest point (x, 0, z) has its normal through p: x = p a^2 / (a^2 - c^2) = 9/4
        ((3.0, 2.0, 1.0), (2.0, 0.0, 0.0), -math.sqrt(0.25**2 + 1.0 - 9.0 / 16.0)),
        ((1.0, 1.0, 1.0), (0.3, -0.4, 0.0), -0.5),
        ((100.0, 0.1, 0.1), (0.0, 0.0, 5.0), 4.9),
    ],
)
def test_distance_to_ellipsoids_by_hand(axes, p, distance):
    assert -at(Ellipsoid((0.0, 0.0, 0.0), axes), p)[2] == pytest.approx(distance, abs=1e-9)


def test_paper_regions_have_the_paper_values():
    """(49)-(52) at the start, with g <= 0 satisfied throughout."""
    start = (0.0, 0.0, 1.0)
    assert at(Sphere((8.0, 0.0, 5.0), 0.5), start)[0] == 64.0 + 16.0 - 0.25
    assert at(Sphere((2.0, 0.0, 1.8), 0.5), start, "out")[0] == pytest.approx(0.25 - 4.64)
    assert at(DepthBand(2.5, 1.8), start, "out")[0] == pytest.approx(1.8**2 - 1.5**2)
    assert at(DepthBand(2.5, 1.8), (8.0, 0.0, 5.0), "out")[0] < 0.0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Sphere((0.0, 0.0, 0.0), 0.0), "radius"),
        (lambda: Sphere((0.0, math.nan, 0.0), 1.0), "center"),
        (lambda: DepthBand(2.0, -1.0), "tolerance"),
        (lambda: HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "normal"),
        (lambda: Box((0.0, 0.0, 0.0), (1.0, 0.0, 1.0)), "size"),
        (lambda: Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0), "end"),
        (lambda: Ellipsoid((0.0, 0.0, 0.0), (1.0, -1.0, 1.0)), "semi_axes"),
        (lambda: Prism(((0.0, 0.0), (1.0, 0.0)), 0.0, 1.0), "corners"),
        (lambda: Prism(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)), 1.0, 1.0), "bottom"),
        (lambda: Pipe(((0.0, 0.0, 0.0),), 1.0), "points"),
        (lambda: Pipe(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 1.0), "points"),
        (lambda: Cone((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 2.0, 1.0), "half_angle"),
        (lambda: Orientation((0.0, 0.0, 0.0, 0.0), 1.0), "quaternion"),
        (lambda: Orientation((1.0, 0.0, 0.0, 0.0), 0.0), "tolerance"),
        (lambda: Visibility((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0), "camera_axis"),
        (lambda: Visibility((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 4.0), "half_angle"),
        (lambda: Visibility((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0, (math.nan, 0.0, 0.0)), "camera_position"),
        (lambda: Region("r", Sphere((0.0, 0.0, 0.0), 1.0), "off"), "keep"),
        (lambda: Region("r", Orientation((1.0, 0.0, 0.0, 0.0), 1.0), "in", (0.1, 0.0, 0.0)), "velocity"),
    ],
)
def test_invalid_regions_are_rejected_by_name(make, words):
    with pytest.raises(RegionError, match=words):
        make()


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.4, 3.0, math.pi - 1e-9, math.pi])
def test_orientation_is_the_angle_of_the_turn(angle):
    """About z alone; either sign of the quaternion is the same attitude, and the ends of the range have no slope."""
    shape = Orientation((1.0, 0.0, 0.0, 0.0), 0.5)
    e = np.array([math.cos(angle / 2.0), 0.0, 0.0, math.sin(angle / 2.0)])
    if angle == math.pi:
        e[0] = 0.0
    for attitude in (e, -e):
        g, gradient, turning, clearance = evaluated(shape, (0.0, 0.0, 0.0), attitude)
        assert g == pytest.approx(angle - 0.5, abs=1e-12)
        assert clearance == -g
        assert not gradient.any()
        expected = 0.0 if angle in (0.0, math.pi) else 1.0
        assert turning == pytest.approx([0.0, 0.0, expected], abs=1e-12)


def test_visibility_by_hand():
    """A camera 0.5 m ahead of the origin looks forward; 2 m ahead of it, and 2 m to the right, is 45 degrees off."""
    shape = Visibility((2.5, 2.0, 0.0), (1.0, 0.0, 0.0), 0.5, (0.5, 0.0, 0.0))
    g, gradient, turning, _ = evaluated(shape, (0.0, 0.0, 0.0))
    assert g == pytest.approx(math.pi / 4.0 - 0.5)
    # a step to the right brings it nearer to the axis by 1 / (sqrt 2 distance); a step forward takes it away
    assert gradient == pytest.approx([0.25, -0.25, 0.0])
    # turning right by one radian brings it one radian nearer, but for the way that the camera moves
    assert turning == pytest.approx([0.0, 0.0, -1.0 - 0.25 * 0.5])


@pytest.mark.parametrize(
    ("feature", "angle"),
    [((3.0, 0.0, 0.0), 0.0), ((-3.0, 0.0, 0.0), math.pi), ((0.0, 0.0, 0.0), math.pi)],
    ids=["ahead", "behind", "in the camera"],
)
def test_visibility_has_numbers_on_its_axis(feature, angle):
    g, gradient, turning, _ = evaluated(Visibility(feature, (1.0, 0.0, 0.0), 0.5), (0.0, 0.0, 0.0))
    assert g == angle - 0.5
    assert not gradient.any()
    assert not turning.any()


@pytest.mark.medium(fast=3)
@each_shape
@given(p=points, e=attitudes, velocity=points)
def test_moving_region_is_evaluated_at_its_present_position(shape, p, e, velocity):
    if isinstance(shape, Orientation):
        return  # at no place
    moving = evaluated(shape, p + 1.5 * velocity, e, velocity=tuple(velocity))
    for now, still in zip(moving, evaluated(shape, (p + 1.5 * velocity) - 1.5 * velocity, e), strict=True):
        assert np.array_equal(now, still)


@pytest.mark.parametrize("shape", [shape for shape in EXAMPLES if of_attitude(shape)])
def test_attitude_shapes_bound_no_position(shape):
    assert shape.bounds() == ((-math.inf,) * 3, (math.inf,) * 3)
    assert np.all(clearances_at(np.zeros((2, 3)), Region("r", shape, "out")) == math.inf)


@pytest.mark.parametrize("shape", [shape for shape in EXAMPLES if of_attitude(shape)])
def test_missing_attitude_gives_nan_clearance(shape):
    for keep in ("in", "out"):
        g, _, _, clearance = evaluated(shape, (0.0, 0.0, 0.0), np.full(4, math.nan), keep)
        assert math.isnan(g)
        assert math.isnan(clearance)


@each_shape
def test_missing_position_gives_nan_clearance(shape):
    if isinstance(shape, Orientation):
        assert np.isfinite(at(shape, [math.nan] * 3)[0])  # which does not ask where it is
        return
    sees = 1 if isinstance(shape, DepthBand) else 3  # a band is of depth alone
    for axis in range(3)[-sees:]:
        p = [0.5, 0.5, 0.5]
        p[axis] = math.nan
        for keep in ("in", "out"):
            g, _, clearance = at(shape, p, keep)
            assert math.isnan(g)
            assert math.isnan(clearance)


@each_shape_in_space
def test_bounds_hold_the_shape(shape):
    low, high = map(np.array, shape.bounds())
    rng = np.random.default_rng(2)
    points = rng.uniform(-5.0, 6.0, (20_000, 3))
    inside = points[clearances_at(points, Region("r", shape, "in")) >= 0.0]
    assert len(inside) >= 3
    assert np.all(inside >= low - 1e-12)
    assert np.all(inside <= high + 1e-12)


def test_empty_scene_is_valid():
    packed = pack([])
    nothing = np.empty(0)
    packed.evaluate(np.zeros(3), LEVEL, nothing, np.empty((0, 3)), np.empty((0, 3)), nothing)


@pytest.mark.parametrize("cls", SHAPES.values())
def test_shapes_are_frozen_values_whose_unit_is_stated(cls):
    assert dataclasses.is_dataclass(cls)
    assert cls.__dataclass_params__.frozen
    assert "[" in inspect.getdoc(cls)
