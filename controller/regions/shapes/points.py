"""Points: balls of one radius about the points of a file, such as a sonar's map."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from controller.errors import RegionError
from controller.regions.distance_grid import DistanceGrid, OnGrid, distance_grid, make_grid
from controller.regions.entry import Entry
from controller.regions.file_frame import file_to_ned, require_frame
from controller.regions.shape import Array, Bounds, Vector3, require, require_finite
from controller.regions.solid_file import digest, file_version, read_bounded
from controller.regions.triangle_mesh import Mesh

_FORMATS = (".csv", ".txt", ".xyz")
_MAX_POINTS = 1_000_000


@dataclass(frozen=True)
class Points(OnGrid):
    """All points within `radius` [m] of one of a file's points, CSV, TXT or XYZ; g is the signed distance [m].

    A row has x, y and z, whose directions are `axes`; columns beyond these are not used. A length of the file times
    `scale` is in meters; the file's origin is at `position` [m, NED]. Distances are interpolated between the nodes of a
    grid, by `spacing` [m] apart, or 0 for about 80,000 nodes, so the region is larger than the balls, by
    ``error()``. A step costs the same for any number of points.

    Examples
    --------
    >>> import numpy as np
    >>> from controller.regions import Points
    >>> np.savetxt("map.xyz", [[4.0, 0.0, 5.0], [4.0, 0.5, 5.2]])
    >>> reef = Points("map.xyz", radius=0.3, axes="ned", spacing=0.05)
    >>> round(reef.error(), 4)
    0.0036
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    file: str
    radius: float  # m
    axes: str
    scale: float = 1.0
    position: Vector3 = (0.0, 0.0, 0.0)  # m, NED
    spacing: float = 0.0  # m

    def __post_init__(self) -> None:
        require_frame("points", self.axes, self.scale, self.position)
        require_finite("points", radius=self.radius)
        require(self.radius > 0.0, "points", "radius", self.radius, "above 0 m")
        require(0.0 <= self.spacing <= 1e3, "points", "spacing", self.spacing, "0 to 1000 m")

    @property
    def grid(self) -> DistanceGrid:
        """Distances about the points, whose file is read when they are first needed."""
        return _grid(*file_version(self.file), self.axes, self.scale, self.radius, self.spacing)

    def error(self) -> float:
        """Return by how much the region is larger than the balls [m]."""
        return self.grid.error(self.radius)


@functools.lru_cache(maxsize=16)
def _grid(file: str, modified: int, size: int, axes: str, scale: float, radius: float, spacing: float) -> DistanceGrid:
    path = Path(file)
    data = read_bounded(path, _FORMATS)
    points = np.ascontiguousarray(scale * _parse_points(path, data) @ file_to_ned(axes).T)

    def distances(nodes: Array) -> Array:
        from scipy.spatial import cKDTree  # takes a third of a second to import

        return np.asarray(cKDTree(points).query(nodes)[0])

    body = points.min(axis=0), points.max(axis=0)
    return make_grid("points", f"{digest(data)} {axes} {scale!r}", distances, body, radius, spacing)


def _parse_points(path: Path, data: bytes) -> Array:
    """Parse positions, shape (n, 3), in the file's units and axes."""
    try:
        lines = data.decode("utf-8-sig").replace(",", " ").replace(";", " ").splitlines()
        if lines and not _is_row(lines[0]):
            lines = lines[1:]  # names of columns
        if not lines:
            raise ValueError("no rows")
        rows = np.loadtxt(lines, ndmin=2, usecols=(0, 1, 2))
        points = np.asarray(rows, dtype=float)
    except (ValueError, MemoryError) as error:
        raise RegionError(f"{path}: cannot be read as rows of x, y and z: {error}") from error
    if points.ndim != 2 or points.shape[1] < 3 or not 1 <= len(points) <= _MAX_POINTS:
        raise RegionError(f"{path}: has the shape {points.shape}, expected 1 to {_MAX_POINTS:,} rows of x, y and z")
    if not np.isfinite(points[:, :3]).all():
        row = int(np.flatnonzero(~np.isfinite(points[:, :3]).all(axis=1))[0]) + 1
        raise RegionError(f"{path}: row {row} has a number that is not finite, expected finite ones")
    return points[:, :3]


def _is_row(line: str) -> bool:
    try:
        return bool([float(word) for word in line.split()]) or True
    except ValueError:
        return line.lstrip().startswith("#")


def surface(shape: Points, limits: Bounds) -> Mesh:
    """Return the surface of the balls, from the grid."""
    return shape.grid.surface(shape.position)


_EXAMPLE = Points(
    str(Path(__file__).with_name("points_example.csv")), 0.5, "ned", position=(1.0, 1.0, 1.0), spacing=0.1
)
_UNITS = {"file": "", "radius": "m", "axes": "", "scale": "m", "position": "m", "spacing": "m"}
ENTRY = Entry(
    Points, distance_grid, _EXAMPLE, _UNITS,
    flat_faces=False, kinks="everywhere", convex=False, center=None, surface=surface,
)  # fmt: skip
