"""Meshes and points from files: clearances against exact distances, and files that are refused with the place."""

import contextlib
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.errors import RegionError
from controller.regions import Mesh, Points, Region
from controller.regions.region_set import clearances_at, surface_of

trimesh = pytest.importorskip("trimesh", reason="the mesh extra is not installed")
igl = pytest.importorskip("igl", reason="the mesh extra is not installed")
pytest.importorskip("rtree", reason="the mesh extra is not installed")


class OneLineError(Exception):
    """A message of one line that names the file, or the grid that it would need."""

    def __init__(self, message):
        assert "\n" not in message
        assert re.search(r"(solid|map)\.\w+: |spacing|position|finite", message)


def saved(tmp_path, solid, name="solid.stl"):
    path = tmp_path / name
    solid.export(path)
    return str(path)


def outside_distance(points, solid):
    """Exact distances to the solid, 0 inside, by another library's brute force."""
    _, distance, _ = trimesh.proximity.closest_point_naive(solid, points)
    return np.where(solid.contains(points), 0.0, distance)


def clearances(shape, points, keep="out"):
    return clearances_at(points, Region("r", shape, keep))


SOLIDS = {
    "ball": trimesh.creation.icosphere(subdivisions=2, radius=1.2),
    "thin plate": trimesh.creation.box((3.0, 2.0, 0.02)),
    "ring": trimesh.creation.torus(1.5, 0.2, major_sections=24, minor_sections=8),
    "hollow cylinder": trimesh.creation.annulus(0.6, 0.9, 2.0, sections=16),
}


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("offset", [0.0, 0.3])
@pytest.mark.parametrize("name", SOLIDS)
def test_clearance_is_never_above_the_true_one_nor_much_below(name, offset, tmp_path):
    solid = SOLIDS[name]
    shape = Mesh(saved(tmp_path, solid), "ned", offset=offset, spacing=0.1)
    points = np.random.default_rng(0).uniform(solid.bounds[0] - 0.4, solid.bounds[1] + 0.4, (1500, 3))
    reported, true = clearances(shape, points), outside_distance(points, solid) - offset
    low, high = shape.bounds()
    outside, gridded = true > -offset, ((points > low) & (points < high)).all(axis=1)
    assert np.where(true >= 0.0, reported <= true + 1e-6, reported < 0.0)[outside].all()
    # where two faces are equally near, interpolation is below the distance
    assert (reported >= true - shape.error() - math.sqrt(3.0) / 2.0 * 0.1)[outside & gridded].all()
    assert (reported[~outside] < 0.0).all()
    assert shape.error() == pytest.approx(math.sqrt(offset**2 + 0.75 * 0.1**2) - offset, abs=1e-3)


def test_mesh_to_stay_within_is_never_larger_than_the_true_one(tmp_path):
    tank = trimesh.creation.box((4.0, 3.0, 2.0))
    shape = Mesh(saved(tmp_path, tank), "ned", offset=-0.3, spacing=0.1)
    points = np.random.default_rng(1).uniform(-2.2, 2.2, (4000, 3))
    true = (np.array([2.0, 1.5, 1.0]) - np.abs(points)).min(axis=1) - 0.3
    reported = clearances(shape, points, "in")
    assert (reported[true >= 0.0] <= true[true >= 0.0] + 1e-6).all()
    assert (reported[true < 0.0] < 0.0).all()
    assert (reported >= 0.0).mean() > 0.8 * (true >= 0.0).mean()


@pytest.mark.medium
@given(st.integers(0, 2**32), st.floats(0.05, 1.0), st.floats(0.04, 0.3))
def test_points_are_kept_out_of_by_their_radius(tmp_path_factory, seed, radius, spacing):
    rng = np.random.default_rng(seed)
    cloud = rng.uniform(-1.0, 1.0, (int(rng.integers(1, 12)), 3))
    path = tmp_path_factory.mktemp("cloud") / "cloud.xyz"
    np.savetxt(path, cloud, fmt="%.17g")
    shape = Points(str(path), radius, "ned", position=(3.0, 0.0, 1.0), spacing=spacing)
    points = np.vstack([rng.uniform(-2.5, 2.5, (300, 3)), rng.uniform(-30.0, 30.0, (100, 3))]) + shape.position
    true = np.linalg.norm(cloud + shape.position - points[:, None], axis=2).min(axis=1) - radius
    reported = clearances(shape, points)
    assert (reported <= np.maximum(true, 0.0) + 1e-9).all()
    assert (reported[true > shape.error() + math.sqrt(3.0) / 2.0 * spacing] > 0.0).all()


def test_surface_of_points_is_closed_on_the_region_and_faces_outward(tmp_path):
    np.savetxt(tmp_path / "map.csv", [[0.0, 0.0, 0.0], [1.0, 0.2, 0.0]], delimiter=",", header="x,y,z", comments="")
    shape = Points(str(tmp_path / "map.csv"), 0.4, "ned", spacing=0.05)
    surface = surface_of(shape, shape.bounds())
    solid = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    assert solid.is_watertight and solid.is_winding_consistent
    assert np.abs(clearances(shape, surface.vertices)).max() < 0.02
    assert solid.volume == pytest.approx(2.0 * 4.0 / 3.0 * math.pi * 0.4**3, rel=0.05)


@pytest.mark.parametrize(
    ("axes", "place"), [("ned", (1.0, 2.0, 3.0)), ("enu", (2.0, 1.0, -3.0)), ("nwu", (1.0, -2.0, -3.0))]
)
def test_axes_and_scale_place_the_file(axes, place, tmp_path):
    mark = trimesh.creation.box((20.0, 20.0, 20.0))
    mark.apply_translation((1000.0, 2000.0, 3000.0))
    np.savetxt(tmp_path / "mark.xyz", [[1000.0, 2000.0, 3000.0, 7.0]])
    for shape in (
        Mesh(saved(tmp_path, mark, "mark.obj"), axes, scale=1e-3, offset=0.1, position=(0.0, 0.0, 5.0)),
        Points(str(tmp_path / "mark.xyz"), 0.1, axes, scale=1e-3, position=(0.0, 0.0, 5.0)),
    ):
        at = np.add(place, (0.0, 0.0, 5.0))
        assert clearances(shape, at[None])[0] < 0.0
        assert clearances(shape, at[None] + [[1.0, 0.0, 0.0]])[0] == pytest.approx(0.9, abs=0.03)


def without_a_triangle(solid):
    return trimesh.Trimesh(solid.vertices, solid.faces[1:], process=False)


def crossing():
    other = trimesh.creation.box((1.0, 1.0, 1.0))
    other.apply_translation((0.5, 0.3, 0.2))
    return trimesh.util.concatenate([trimesh.creation.box((1.0, 1.0, 1.0)), other])


def nested():
    return trimesh.util.concatenate([trimesh.creation.box((2.0, 2.0, 2.0)), trimesh.creation.box((1.0, 1.0, 1.0))])


@pytest.mark.parametrize(
    ("solid", "words"),
    [
        (without_a_triangle(SOLIDS["ball"]), r"the surface is open between \[.*\] and \[.*\] in the file's units \(3"),
        (crossing(), r"the surface crosses itself at \[.*\] in the file's units"),
        (nested(), r"bodies overlap, or one is inside out, at \["),
    ],
    ids=["open", "crossing", "nested"],
)
def test_surfaces_that_enclose_no_solid_are_refused_with_the_place(solid, words, tmp_path):
    with pytest.raises(RegionError, match=words):
        Mesh(saved(tmp_path, solid), "ned", spacing=0.1).bounds()


def test_solid_inside_out_and_bodies_apart_are_accepted(tmp_path):
    flipped = SOLIDS["ball"].copy()
    flipped.invert()
    far = SOLIDS["ball"].copy()
    far.apply_translation((5.0, 0.0, 0.0))
    for solid in (flipped, trimesh.util.concatenate([SOLIDS["ball"], far])):
        shape = Mesh(saved(tmp_path, solid), "ned", spacing=0.2)
        assert clearances(shape, np.zeros((1, 3)))[0] < -0.8


@pytest.mark.medium
@given(st.data())
def test_damaged_files_are_a_solid_or_one_line(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("damaged")
    name = data.draw(st.sampled_from(["solid.stl", "solid.obj", "map.csv"]))
    path = folder / name
    if name.startswith("solid"):
        trimesh.creation.box((1.0, 1.0, 1.0)).export(path)
    else:
        np.savetxt(path, np.eye(3), delimiter=",")
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(content) - 1))
        if data.draw(st.booleans()):
            content[at] = data.draw(st.integers(0, 255))
        else:
            del content[at:]
        if not content:
            break
    path.write_bytes(content)
    shape = Mesh(str(path), "ned") if name.startswith("solid") else Points(str(path), 0.2, "ned")
    with contextlib.suppress(OneLineError):
        try:
            shape.bounds()
        except RegionError as error:
            raise OneLineError(str(error)) from None


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.step", b"ISO-10303-21;", r"a.step: got the suffix '.step', expected .stl or .obj"),
        ("a.stl", b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "a.stl: "),
        ("a.stl", b"", "a.stl: "),
        ("a.stl", None, "a.stl: No such file"),
    ],
)
def test_files_that_are_no_solid_are_named(name, content, words, tmp_path):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(RegionError, match=words):
        Mesh(str(tmp_path / name), "ned").bounds()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("x,y,z\n", "has the shape|cannot be read"),
        ("1,2\n", "cannot be read"),
        ("1,2,nan\n", "row 1 has a number that is not"),
    ],
)
def test_files_that_are_no_points_are_named(content, words, tmp_path):
    (tmp_path / "map.csv").write_text(content)
    with pytest.raises(RegionError, match=words):
        Points(str(tmp_path / "map.csv"), 0.2, "ned").bounds()


def test_too_fine_a_grid_is_refused_with_the_finest(tmp_path):
    with pytest.raises(RegionError, match=r"spacing is 0.001, expected above 0.01\d* m, for at most 4,000,000 nodes"):
        Mesh(saved(tmp_path, SOLIDS["ball"]), "ned", spacing=0.001).bounds()


def test_rewritten_file_is_read_again(tmp_path):
    path = saved(tmp_path, trimesh.creation.box((1.0, 1.0, 1.0)))
    assert Mesh(path, "ned", spacing=0.1).bounds()[1][0] == pytest.approx(0.7, abs=0.06)
    saved(tmp_path, trimesh.creation.box((2.0, 1.0, 1.5)))
    assert Mesh(path, "ned", spacing=0.1).bounds()[1][0] == pytest.approx(1.2, abs=0.06)
