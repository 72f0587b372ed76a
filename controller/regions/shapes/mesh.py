"""Mesh: a solid of any shape from CAD, by the distances at the nodes of a grid."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from controller.regions.distance_grid import DistanceGrid, OnGrid, distance_grid, make_grid
from controller.regions.entry import Entry
from controller.regions.file_frame import file_to_ned, require_frame
from controller.regions.shape import Bounds, Vector3, require, require_finite
from controller.regions.solid_file import FORMATS, digest, file_version, parse_solid, read_bounded, signed_distances
from controller.regions.triangle_mesh import Mesh as Triangles


@dataclass(frozen=True)
class Mesh(OnGrid):
    """All points within `offset` [m] of a solid from a file, STL or OBJ; g is the signed distance [m].

    `axes` says where the file's x, y and z point. A length of the file times `scale` is in meters; the file's origin is
    at `position` [m, NED]. Distances are interpolated between the nodes of a grid, by `spacing` [m] apart, or 0 for
    about 80,000 nodes. The region is larger than what the file says, or smaller where `offset` is below 0, by
    ``error()``.

    Examples
    --------
    >>> from controller.regions import Mesh
    >>> jacket = Mesh("examples/jacket/jacket.stl", axes="enu", offset=0.4)  # doctest: +SKIP
    >>> round(jacket.error(), 3)  # doctest: +SKIP
    0.012
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    file: str
    axes: str
    scale: float = 1.0
    position: Vector3 = (0.0, 0.0, 0.0)  # m, NED
    offset: float = 0.0  # m
    spacing: float = 0.0  # m

    def __post_init__(self) -> None:
        require_frame("mesh", self.axes, self.scale, self.position)
        require_finite("mesh", offset=self.offset)
        require(0.0 <= self.spacing <= 1e3, "mesh", "spacing", self.spacing, "0 to 1000 m")

    @property
    def grid(self) -> DistanceGrid:
        """Distances about the solid, whose file is read when they are first needed."""
        return _solid(*file_version(self.file), self.axes, self.scale, self.offset, self.spacing)[1]

    def error(self) -> float:
        """Return by how much the region differs from the solid grown by the offset [m]."""
        return self.grid.error(self.offset)


@functools.lru_cache(maxsize=16)
def _solid(
    file: str, modified: int, size: int, axes: str, scale: float, offset: float, spacing: float
) -> tuple[Triangles, DistanceGrid]:
    path = Path(file)
    data = read_bounded(path, FORMATS)
    solid = parse_solid(path, data)
    turn = file_to_ned(axes)
    placed = Triangles(np.ascontiguousarray(scale * solid.vertices @ turn.T), solid.triangles)
    body = placed.vertices.min(axis=0), placed.vertices.max(axis=0)
    distances = functools.partial(signed_distances, path, placed)
    return placed, make_grid("mesh", f"{digest(data)} {axes} {scale!r}", distances, body, offset, spacing)


def surface(shape: Mesh, limits: Bounds) -> Triangles:
    """Return the file's triangles."""
    solid = _solid(*file_version(shape.file), shape.axes, shape.scale, shape.offset, shape.spacing)[0]
    return Triangles(solid.vertices + shape.position, solid.triangles)


_EXAMPLE = Mesh(
    str(Path(__file__).with_name("mesh_example.stl")), "ned", position=(1.0, 1.0, 1.0), offset=0.2, spacing=0.1
)
_UNITS = {"file": "", "axes": "", "scale": "m", "position": "m", "offset": "m", "spacing": "m"}
ENTRY = Entry(
    Mesh, distance_grid, _EXAMPLE, _UNITS,
    flat_faces=False, kinks="everywhere", convex=False, center=None, surface=surface,
)  # fmt: skip
