"""Closed surfaces from files of triangles: STL and OBJ."""

from __future__ import annotations

import hashlib
import importlib
import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.errors import RegionError
from controller.regions.shape import Array
from controller.regions.triangle_mesh import Mesh

MAX_BYTES = 100_000_000
MAX_TRIANGLES = 500_000
_MAX_COORDINATE = 1e9  # in the file's units
FORMATS = (".stl", ".obj")
# what trimesh raises for files that are damaged
_DAMAGED = (
    ValueError, IndexError, KeyError, TypeError, AttributeError, AssertionError, NotImplementedError, struct.error,
    MemoryError, ZeroDivisionError,
)  # fmt: skip
_LIBRARIES = ("libigl>=2.6", "rtree>=1.3", "trimesh>=4.5")
_EDGES_AT_A_TIME = 4_000
_CROSSED = 1e-9  # fraction of an edge or a triangle, by which a crossing is inside both


def parse_solid(path: Path, data: bytes) -> Mesh:
    """Parse a closed surface, in the file's own units and axes; the result is oriented outward."""
    trimesh = _library("trimesh")
    try:
        loaded = trimesh.load(BytesIO(data), file_type=path.suffix[1:].lower(), force="mesh", skip_materials=True)
        far = not (np.abs(loaded.vertices) <= _MAX_COORDINATE).all()
        _require(path, not far, "coordinates that are not finite or too great", f"numbers up to {_MAX_COORDINATE:g}")
        loaded.merge_vertices(merge_tex=True, merge_norm=True)
        loaded.update_faces(loaded.nondegenerate_faces())
        vertices, triangles = np.array(loaded.vertices, dtype=float), np.array(loaded.faces, dtype=np.int64)
    except _DAMAGED as error:
        raise RegionError(f"{path}: cannot be read as {path.suffix[1:].upper()}: {error}") from error
    _require(path, len(triangles) > 0, "no triangles", f"a closed surface ({len(data)} bytes were read)")
    _require(path, len(triangles) <= MAX_TRIANGLES, f"{len(triangles):,} triangles", f"at most {MAX_TRIANGLES:,}")
    _require_closed(path, vertices, loaded)
    loaded.fix_normals(multibody=False)
    _require_no_crossings(path, loaded)
    return Mesh(vertices, np.array(loaded.faces, dtype=np.int64))


def signed_distances(path: Path, solid: Mesh, points: Array) -> Array:
    """Return the distances of points from a solid's surface [m], negative inside."""
    igl = _library("igl")
    winding = igl.fast_winding_number(solid.vertices, solid.triangles, points)
    odd = np.flatnonzero((winding < -0.5) | (winding > 1.5))
    if odd.size:
        where = ", ".join(f"{x:.4g}" for x in points[odd[0]])
        raise RegionError(f"{path}: bodies overlap, or one is inside out, at [{where}] m NED, expected separate bodies")
    distances, *_ = igl.signed_distance(
        points, solid.vertices, solid.triangles, sign_type=igl.SIGNED_DISTANCE_TYPE_UNSIGNED
    )
    return np.asarray(np.where(winding > 0.5, -1.0, 1.0) * distances)


def read_bounded(path: Path, formats: tuple[str, ...]) -> bytes:
    """Read a file of one of some formats, whose size is bounded."""
    _require(path, path.suffix.lower() in formats, f"the suffix {path.suffix!r}", " or ".join(formats))
    try:
        size = path.stat().st_size
        _require(path, size <= MAX_BYTES, f"{size:,} bytes", f"at most {MAX_BYTES:,}")
        return path.read_bytes()
    except OSError as error:
        raise RegionError(f"{path}: {error.strerror or error}") from error


def digest(data: bytes) -> str:
    """Return the digest of a file's bytes, by which distances are cached."""
    return hashlib.sha256(data).hexdigest()


def file_version(file: str) -> tuple[str, int, int]:
    """Return a file with its time of change and its size, by which what was read from it is kept."""
    try:
        status = Path(file).stat()
    except OSError:
        return file, 0, 0  # reading it says why
    return file, status.st_mtime_ns, status.st_size


def _require(path: Path, good: bool, got: str, expected: str) -> None:
    if not good:
        raise RegionError(f"{path}: got {got}, expected {expected}")


def _require_closed(path: Path, vertices: Array, loaded: Any) -> None:
    """Require that each edge belongs to two triangles; name the place of one that does not."""
    edges, counts = np.unique(loaded.edges_sorted, axis=0, return_counts=True)
    open_edges = edges[counts != 2]
    if len(open_edges):
        a, b = vertices[open_edges[0]]
        what = "is open" if counts[counts != 2][0] == 1 else "has more than two triangles at an edge"
        raise RegionError(
            f"{path}: the surface {what} between {_place(a)} and {_place(b)} in the file's units "
            f"({len(open_edges)} such edges), expected a closed surface"
        )


def _require_no_crossings(path: Path, loaded: Any) -> None:
    """Require that no edge crosses a triangle; name the place of one that does."""
    for edges, triangles in _near_pairs(loaded):
        start, end = loaded.vertices[loaded.edges_unique[edges]].swapaxes(0, 1)
        corners = loaded.faces[triangles]
        apart = ~(loaded.edges_unique[edges][:, :, None] == corners[:, None, :]).any(axis=(1, 2))
        a, b, c = loaded.vertices[corners].swapaxes(0, 1)
        # the point a + u (b - a) + v (c - a) of the triangle is start + t (end - start) of the edge
        along, first, second, offset = end - start, b - a, c - a, start - a
        across = np.cross(along, second)
        determinant = np.einsum("ij,ij->i", first, across)
        with np.errstate(divide="ignore", invalid="ignore"):  # NaN where edge and triangle are parallel
            turned = np.cross(offset, first)
            u = np.einsum("ij,ij->i", offset, across) / determinant
            v = np.einsum("ij,ij->i", along, turned) / determinant
            t = np.einsum("ij,ij->i", second, turned) / determinant
            within = np.minimum.reduce([u, v, 1.0 - u - v, t, 1.0 - t]) > _CROSSED
        crossings = np.flatnonzero(within & apart)
        if crossings.size:
            place = start[crossings[0]] + t[crossings[0]] * along[crossings[0]]
            raise RegionError(
                f"{path}: the surface crosses itself at {_place(place)} in the file's units, expected one outer surface"
            )


def _near_pairs(loaded: Any) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Yield indices of edges and triangles whose upright boxes meet."""
    tree = _library("trimesh").triangles.bounds_tree(loaded.triangles)
    ends = loaded.vertices[loaded.edges_unique]
    for first in range(0, len(ends), _EDGES_AT_A_TIME):
        part = ends[first : first + _EDGES_AT_A_TIME]
        triangles, counts = tree.intersection_v(part.min(axis=1), part.max(axis=1))
        yield first + np.repeat(np.arange(len(part)), counts.astype(int)), triangles.astype(np.int64)


def _place(point: Array) -> str:
    return "[" + ", ".join(f"{x:.6g}" for x in point) + "]"


def _library(name: str) -> ModuleType:
    try:
        importlib.import_module("rtree")  # which trimesh imports when it needs it
        return importlib.import_module(name)
    except ImportError as error:
        raise RegionError(f"mesh: needs {', '.join(_LIBRARIES)}; {error.name} is not installed") from error
