"""All evaluations of a clearance agree for each region of a shifted scene."""

import numpy as np
import pytest

from controller.quaternion import rotation_matrix
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
from controller.regions.kinds import SPHERE, evaluate_shape
from controller.regions.numbers import ANGLE, LENGTH, PART, SIZE
from controller.regions.region_set import (
    attitude_clearance,
    clearance_at,
    clearance_of_place,
    clearance_of_pose,
    clearance_of_sphere,
    place_clearance,
)

TURNED = (0.9, 0.1, -0.3, 0.2)

# every shape with the places where it has a corner, an edge, a face or a centre
SHAPES = {
    "sphere": (Sphere((1.0, -2.0, 3.0), 1.5), [(1.0, -2.0, 3.0), (2.5, -2.0, 3.0)]),
    "depth band": (DepthBand(4.0, 0.5), [(0.0, 0.0, 4.0), (0.0, 0.0, 4.5), (0.0, 0.0, 3.5)]),
    "half-space": (HalfSpace((1.0, 2.0, 3.0), (1.0, 1.0, -1.0)), [(1.0, 2.0, 3.0)]),
    "upright box": (
        Box((0.0, 0.0, 0.0), (2.0, 4.0, 6.0)),
        [(0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (1.0, 0.0, 0.0), (2.0, 0.0, 3.0), (-1.0, 2.0, 0.5), (0.5, 0.0, 5.0)],
    ),
    "turned box": (Box((1.0, 2.0, 3.0), (2.0, 1.0, 3.0), TURNED), [(1.0, 2.0, 3.0)]),
    "cylinder": (
        Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 4.0), 1.0),
        [(0.0, 0.0, 2.0), (0.0, 0.0, 0.0), (1.0, 0.0, 4.0), (1.0, 0.0, 2.0), (2.0, 0.0, 5.0), (0.0, 0.0, 6.0)],
    ),
    "aslant cylinder": (Cylinder((-1.0, 2.0, 1.0), (2.0, 3.0, 5.0), 0.7), [(0.5, 2.5, 3.0), (-1.0, 2.0, 1.0)]),
    "ellipsoid": (
        Ellipsoid((1.0, 2.0, 3.0), (3.0, 2.0, 0.5), TURNED),
        [(1.0, 2.0, 3.0), (1.0 + 1e-9, 2.0, 3.0), (1.0, 2.0, 60.0)],
    ),
    "ellipsoid, thin along x": (Ellipsoid((1.0, 2.0, 3.0), (0.5, 3.0, 2.0), TURNED), [(1.0, 2.0, 3.0)]),
    "ellipsoid, thin along y": (Ellipsoid((1.0, 2.0, 3.0), (3.0, 0.5, 2.0), TURNED), [(1.0, 2.0, 3.0)]),
    "ball of an ellipsoid": (Ellipsoid((0.0, 0.0, 0.0), (2.0, 2.0, 2.0)), [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)]),
    "prism": (
        Prism(((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.0, 1.0), (0.0, 3.0)), 1.0, 4.0),
        [
            (0.0, 0.0, 1.0),
            (2.0, 1.0, 2.0),
            (4.0, 1.5, 2.0),
            (2.0, 0.4, 2.5),
            (5.0, 4.0, 0.0),
            (2.0, 0.5, 5.0),
            *((2.0 + aside, 0.9, 2.0) for aside in (-0.05, -0.02, 0.02, 0.05)),  # under the corner that stands in
        ],
    ),
    "pipe": (
        Pipe(((0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (3.0, 4.0, 1.0)), 0.5),
        [(0.0, 0.0, 0.0), (3.0, 0.0, 0.0), (1.5, 0.0, 0.0), (1.5, 0.5, 0.0), (-1.0, 0.0, 0.0)],
    ),
    "pipe aside": (Pipe(((1.0, -2.0, 0.5), (3.0, 1.0, -1.0), (2.0, 4.0, 1.0)), 0.5), [(3.0, 1.0, -1.0)]),
    "cone": (
        Cone((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.5, 4.0),
        [(0.0, 0.0, 0.0), (0.0, 0.0, 4.0), (0.0, 0.0, 2.0), (0.0, 0.0, -1.0), (0.0, 0.0, 6.0), (5.0, 0.0, 1.0)],
    ),
    "aslant cone": (Cone((1.0, 2.0, 3.0), (1.0, -1.0, 2.0), 1.2, 2.0), [(1.0, 2.0, 3.0)]),
    "orientation": (Orientation(TURNED, 0.3), [(0.0, 0.0, 0.0)]),
    "visibility": (
        Visibility((2.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.4, (0.5, 0.0, 0.0)),
        [(1.5, 0.0, 0.0), (0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (1.0, 1.0, 1.0)],
    ),
    "aslant visibility": (Visibility((2.0, -1.0, 0.5), (1.0, -2.0, 0.5), 0.4, (0.5, 0.2, -0.3)), [(2.0, -1.0, 0.5)]),
}

SCENE = [Region(name, shape, ("in", "out")[i % 2]) for i, (name, (shape, _)) in enumerate(SHAPES.items())]


def test_all_region_evaluations_agree():
    rng, packed, n = np.random.default_rng(1), pack(SCENE), len(SCENE)
    packed.shifts[:] = rng.normal(size=(n, 3))
    values, gradients, rotation_gradients, clearances = np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    room, slope, turning, asked = np.empty(3), np.empty(3), np.empty(3), 0
    for _ in range(40):
        p, e = rng.normal(size=3) * 3.0 + 1.0, rng.normal(size=4)
        e /= np.linalg.norm(e)
        packed.evaluate(p, e, values, gradients, rotation_gradients, clearances)
        for i, region in enumerate(SCENE):
            assert clearance_of_pose(packed, i, p, e, room) == pytest.approx(clearances[i], rel=1e-12)
            if region.shape.unit == "rad":
                clearance = attitude_clearance(packed, i, p, e, turning)
                assert clearance == pytest.approx(clearances[i], rel=1e-12)
                assert turning == pytest.approx(-rotation_gradients[i], rel=1e-12, abs=1e-15)
                assert clearance_at(packed, i, p) == np.inf
                continue
            assert clearance_at(packed, i, p) == pytest.approx(clearances[i], rel=1e-12)
            assert clearance_of_place(packed, i, p, room) == pytest.approx(clearances[i], rel=1e-12)
            assert place_clearance(packed, i, p, slope) == pytest.approx(clearances[i], rel=1e-12)
            size = np.linalg.norm(gradients[i])
            assert slope == pytest.approx(-gradients[i] / size if size > 0.0 else np.zeros(3), rel=1e-12, abs=1e-15)
            if region.name == "sphere":
                asked += 1
                assert clearance_of_sphere(packed, i, p) == pytest.approx(clearances[i], rel=1e-12)
                distance = np.linalg.norm(p - packed.shifts[i] - region.shape.centre) - region.shape.radius
                assert clearances[i] == pytest.approx(-distance if region.keep == "in" else distance, rel=1e-12)
    assert asked == 40


def test_visibility_uses_the_camera_axis_angle():
    rng = np.random.default_rng(2)
    for _ in range(30):
        feature, axis, camera = rng.normal(size=(3, 3))
        p, e = rng.normal(size=3), rng.normal(size=4)
        packed = pack([Region("see", Visibility(tuple(feature), tuple(axis), 0.4, tuple(camera)), "in")])
        e /= np.linalg.norm(e)
        ray = rotation_matrix(e).T @ (feature - p) - camera
        angle = np.arccos(ray @ axis / np.linalg.norm(ray) / np.linalg.norm(axis))
        assert clearance_of_pose(packed, 0, p, e, np.empty(3)) == pytest.approx(0.4 - angle, abs=1e-9)
    assert Visibility((1.0, 2.0, 3.0), (1.0, 0.0, 0.0), 0.4).bounds() == ((-np.inf,) * 3, (np.inf,) * 3)


def test_shape_evaluated_by_kind_matches_the_sphere():
    rng = np.random.default_rng(3)
    for _ in range(20):
        p, centre, radius = rng.normal(size=3), rng.normal(size=3), rng.uniform(0.1, 2.0)
        g, *gradient, distance = evaluate_shape(SPHERE, p, np.array([*centre, radius]))
        assert g == pytest.approx((p - centre) @ (p - centre) - radius**2, rel=1e-12)
        assert gradient == pytest.approx(2.0 * (p - centre), rel=1e-12)
        assert distance == pytest.approx(np.linalg.norm(p - centre) - radius, rel=1e-12)


def test_quantity_ranges_are_nonempty_and_positions_are_symmetric():
    for _, least, greatest in (LENGTH, SIZE, PART, ANGLE):
        assert least < greatest
    assert LENGTH[1:] == (-1e6, 1e6) and PART[1:] == (-1.0, 1.0) and SIZE[1] > 0.0
