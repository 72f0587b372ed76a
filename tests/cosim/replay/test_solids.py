"""The scene's geometry: surfaces, planes, sights and the camera, run by node and held against the shapes themselves."""

import json
import shutil
import subprocess
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

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
)  # fmt: skip
from controller.regions.region_set import attitude_clearance, clearances_at
from controller.regions.shapes import ENTRIES
from cosim.replay import header
from cosim.replay.page import SCENE_SCRIPTS

ASSETS = Path(str(resources.files("cosim.replay"))) / "assets"
NODE = shutil.which("node")
pytestmark = pytest.mark.skipif(NODE is None, reason="node, which runs the scene's scripts, is not installed")

TURN = (0.8, 0.3, -0.2, 0.5)
BOUNDED = {
    "sphere": Sphere((1.0, -2.0, 3.0), 1.5),
    "ellipsoid": Ellipsoid((4.0, 1.0, 2.0), (2.0, 0.5, 1.0), TURN),
    "box": Box((-1.0, 2.0, 4.0), (1.0, 2.0, 3.0), TURN),
    "cylinder": Cylinder((0.0, 0.0, 1.0), (2.0, -1.0, 4.0), 0.7),
    "prism": Prism(((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.0, 1.0), (0.0, 3.0)), 1.0, 3.0),
    "prism the other way round": Prism(((0.0, 3.0), (2.0, 1.0), (4.0, 3.0), (4.0, 0.0), (0.0, 0.0)), 1.0, 3.0),
    "cone": Cone((1.0, 1.0, 5.0), (-1.0, 0.5, -0.7), 0.5, 3.0),
    "cone as wide as half a ball": Cone((1.0, 1.0, 5.0), (0.0, 0.0, -1.0), np.pi / 2.0, 2.0),
    "straight pipe": Pipe(((0.0, 0.0, 2.0), (3.0, 0.0, 2.0), (5.0, 0.0, 2.0)), 0.4),
    "bent pipe": Pipe(((0.0, 0.0, 2.0), (3.0, 0.0, 2.5), (4.0, 3.0, 2.0), (4.0, 3.0, 5.0), (1.0, 3.0, 7.0)), 0.4),
}
POSITION, QUATERNION = np.array([1.0, 2.0, 3.0]), np.array([0.9, 0.1, -0.2, 0.3]) / np.sqrt(0.95)


def run(code, scripts=SCENE_SCRIPTS, **given):
    """Return what JavaScript that knows some scripts, by default the scene's, returns of some values."""
    scripts = "\n".join((ASSETS / name).read_text(encoding="utf-8") for name in scripts)
    values = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in given.items())
    program = f'"use strict";\n{scripts}\n{values}console.log(JSON.stringify((() => {{ {code} }})()));'
    done = subprocess.run([NODE, "-"], input=program, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def surfaces():
    """Points, faces, outward normals, and edges, of each bounded shape."""
    shapes = {name: shape_of(shape) for name, shape in BOUNDED.items()}
    return run(
        """
        return Object.fromEntries(Object.entries(shapes).map(([name, shape]) => {
          const solid = surfaceOf(shape);
          const { points, faces, normals, edges } = solid;
          return [name, { points: [...points], faces, normals: [...normals], edges }];
        }));
        """,
        shapes=shapes,
    )


def shape_of(shape):
    """Return a shape as the page gets it."""
    return header.shape_of(shape, ((-9.0,) * 3, (9.0,) * 3))


def outside(shape, points):
    """Return the signed distance of points to a shape [m], positive outside."""
    return clearances_at(np.atleast_2d(points), Region("it", shape, "out"))


def test_page_knows_no_shape_by_name():
    scripts = "".join(path.read_text(encoding="utf-8") for path in ASSETS.glob("*.js"))
    assert not [name for name in ENTRIES if f'"{name}"' in scripts]


def test_meshes_are_drawn_unchanged():
    box = BOUNDED["box"]
    solid = run("const s = surfaceOf(shape); return { ...s, points: [...s.points] };", shape=shape_of(box))
    np.testing.assert_allclose(outside(box, np.reshape(solid["points"], (-1, 3))), 0.0, atol=1e-6)
    assert sum(edge[4] for edge in solid["edges"]) == 12  # those between its sides alone are sharp


@pytest.mark.medium(fast=8)
@pytest.mark.parametrize("name", BOUNDED)
def test_surface_points_lie_on_the_shape(surfaces, name):
    points = np.reshape(surfaces[name]["points"], (-1, 3))
    assert len(points) >= 8
    np.testing.assert_allclose(outside(BOUNDED[name], points), 0.0, atol=1e-6)  # where coordinates are rounded


@pytest.mark.parametrize("name", [name for name, shape in BOUNDED.items() if not isinstance(shape, Sphere | Ellipsoid)])
def test_surfaces_are_closed_with_outward_normals(surfaces, name):
    surface = surfaces[name]
    points, normals = np.reshape(surface["points"], (-1, 3)), np.reshape(surface["normals"], (-1, 3))
    assert all(edge[2] != edge[3] for edge in surface["edges"])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    # the volume by Gauss's theorem, from fans of triangles, against random points in a box about the shape
    volume = 0.0
    for face in surface["faces"]:
        a = points[face[0]]
        for i in range(1, len(face) - 1):
            volume += a @ np.cross(points[face[i]], points[face[i + 1]]) / 6.0
    low, high = points.min(axis=0), points.max(axis=0)
    inside = outside(BOUNDED[name], np.random.default_rng(1).uniform(low, high, (40_000, 3))) < 0.0
    assert volume == pytest.approx(inside.mean() * np.prod(high - low), rel=0.04)


@pytest.mark.slow
@pytest.mark.parametrize("name", BOUNDED)
def test_hidden_points_match_ray_casting(name):
    rng = np.random.default_rng(2)
    shape = BOUNDED[name]
    low, high = (np.array(corner) - 1.0 + 2.0 * i for i, corner in enumerate(shape.bounds()))
    eyes, points = rng.uniform(low - 6.0, high + 6.0, (300, 3)), rng.uniform(low, high, (300, 3))
    least = np.array(
        [
            outside(shape, a + np.linspace(0.0, 1.0, 400)[:, None] * (b - a)).min()
            for a, b in zip(eyes, points, strict=True)
        ]
    )
    clear = (np.abs(least) > 0.03) & (outside(shape, eyes) > 0.0)  # flat faces cut some mm off what is round
    hidden = run(
        """
        const solid = surfaceOf(shape);
        return eyes.map((eye, i) => solid.from(eye)(points[i]));
        """,
        shape=shape_of(shape),
        eyes=eyes.tolist(),
        points=points.tolist(),
    )
    assert clear.sum() > 100
    assert 10 < (least[clear] < 0.0).sum() < clear.sum() - 10
    assert (np.array(hidden) == (least < 0.0))[clear].all()


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(
    "shape",
    [DepthBand(3.0, 1.0), HalfSpace((1.0, 2.0, 3.0), (0.3, -1.0, 0.4)), HalfSpace((0.0, 0.0, 4.0), (0.0, 0.0, 1.0))],
)
@pytest.mark.parametrize("keep", ["in", "out"])
def test_plane_sheets_lie_in_bounds_with_hatching_on_the_forbidden_side(shape, keep):
    low, high = [-3.0, -4.0, 0.0], [5.0, 4.0, 6.0]
    sheets = run(
        "return sheetsOf(shape, keep, [0, 0, 0], [low, high]);", shape=shape_of(shape), keep=keep, low=low, high=high
    )
    assert len(sheets) == (2 if isinstance(shape, DepthBand) else 1)
    for sheet in sheets:
        corners, hatch = np.array(sheet["corners"]), np.array(sheet["hatch"])
        np.testing.assert_allclose(outside(shape, corners), 0.0, atol=1e-9)
        assert (corners >= np.array(low) - 1e-9).all() and (corners <= np.array(high) + 1e-9).all()
        region = Region("it", shape, keep)
        assert (clearances_at(np.ascontiguousarray(hatch[:, 1]), region) < 0.0).all()


def sight_of(shape):
    """Return the drawing of a shape of attitude."""
    code = "return sightOf(shape, { position, quaternion }, [0, 0, 0], 0.3);"
    return run(code, shape=shape_of(shape), position=POSITION.tolist(), quaternion=QUATERNION.tolist())


@pytest.mark.parametrize("tolerance", [0.3, 1.8])
def test_heading_sector_rim_lies_at_the_attitude_tolerance(tolerance):
    shape = Orientation((0.9, 0.1, 0.2, -0.4), tolerance)
    sight = sight_of(shape)
    regions = pack([Region("it", shape, "in")])
    wanted = np.array(shape.quaternion) / np.linalg.norm(shape.quaternion)
    for point in np.array(sight["rim"]):
        way = (point - POSITION) / np.linalg.norm(point - POSITION)
        turned = multiplied(shortest_turn(np.array(sight["axis"]), way), wanted)
        assert attitude_clearance(regions, 0, POSITION, turned, np.empty(3)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("half_angle", [0.5, 2.0])
def test_view_cone_rim_lies_at_zero_clearance(half_angle):
    shape = Visibility((6.0, 3.0, 4.0), (1.0, 0.3, 0.2), half_angle, (0.2, -0.1, 0.1))
    sight = sight_of(shape)
    for point in sight["rim"]:
        seen = Visibility(tuple(point), shape.camera_axis, half_angle, shape.camera_position)
        clearance = attitude_clearance(pack([Region("it", seen, "in")]), 0, POSITION, QUATERNION, np.empty(3))
        assert clearance == pytest.approx(0.0, abs=1e-9)


def test_pixel_ray_passes_through_its_projected_point():
    rng = np.random.default_rng(3)
    points = rng.uniform(-5.0, 5.0, (100, 3))
    seen = run(
        """
        return points.map((p, i) => {
          const camera = new Camera();
          camera.resize(1200, 800);
          camera.aim([0.1 * i, 1, 2]);
          camera.orbit(13 * i, 7 * (i % 30));
          camera.zoom(0.3);
          const [x, y, depth] = camera.project(p);
          return { eye: camera.eye, forward: camera.forward, ray: camera.ray(x, y), at: [x, y, depth] };
        });
        """,
        points=points.tolist(),
    )
    for p, view in zip(points, seen, strict=True):
        way = p - view["eye"]
        assert view["at"][2] == pytest.approx(way @ view["forward"]) and view["at"][2] > 0.0
        np.testing.assert_allclose(view["ray"], way / np.linalg.norm(way), atol=1e-9)


def test_camera_views_orient_ned_axes():
    views = run(
        """
        const camera = new Camera();
        camera.resize(900, 600);
        camera.content = [[-2, -1, 0], [3, 4, 5]];
        const seen = (p) => camera.project(p).slice(0, 2);
        return Object.fromEntries(["iso", "top", "side", "front"].map((name) => {
          camera.look(name);
          const m = [0.5, 1.5, 2.5];
          const [o, n, e, d] = [m, [1, 0, 0], [0, 1, 0], [0, 0, 1]].map((p, i) => seen(i ? Vec.add(m, p) : p));
          return [name, { o, n, e, d, all: camera.content.map(seen) }];
        }));
        """
    )
    for name, view in views.items():
        o, n, e, d = (np.array(view[key]) for key in "oned")
        if name == "top":
            assert n[1] < o[1] - 10.0 and e[0] > o[0] + 10.0
        else:
            assert d[1] > o[1] + 10.0
        if name == "side":
            assert n[0] > o[0] + 10.0
        if name == "front":
            assert e[0] > o[0] + 10.0
        # and all content is in the picture, which is filled one way
        seen = np.array(view["all"])
        assert (seen > 0.0).all() and (seen < [900.0, 600.0]).all()
        assert (np.ptp(seen, axis=0) > [600.0, 400.0]).any()


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("name", ["sphere", "ellipsoid"])
def test_sphere_outline_rays_are_tangent(name):
    outline = run(
        """
        const camera = new Camera();
        camera.resize(800, 600);
        camera.aim([2, 0, 3]);
        const solid = surfaceOf(shape);
        const to = outlineOf(camera, solid.ellipsoid, [0, 0, 0]);
        const rays = Array.from({ length: 24 }, (_, i) => {
          const [u, v] = [Math.cos((Math.PI * i) / 12), Math.sin((Math.PI * i) / 12)];
          return camera.ray(to.x + to.xx * u + to.xy * v, to.y + to.xy * u + to.yy * v);
        });
        return { eye: camera.eye, rays };
        """,
        shape=shape_of(BOUNDED[name]),
    )
    for ray in outline["rays"]:
        along = np.linspace(0.0, 20.0, 20_001)[:, None]
        assert outside(BOUNDED[name], np.array(outline["eye"]) + along * np.array(ray)).min() == pytest.approx(
            0.0, abs=1e-5
        )


def shortest_turn(a, b):
    """Return the quaternion of the shortest turn of one unit vector to another."""
    half = np.append(1.0 + a @ b, np.cross(a, b))
    return half / np.linalg.norm(half)


def multiplied(p, q):
    """Return the product of two quaternions, scalar first."""
    return np.append(p[0] * q[0] - p[1:] @ q[1:], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))
