"""Pipe: a chain of capsules, such as the bent pipeline of section V.B, without an equation there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from controller.jit.jit import jit_noalloc
from controller.regions.entry import Entry
from controller.regions.geometry import clamp
from controller.regions.mesh import AROUND, Mesh, lathe
from controller.regions.numbers import LENGTH, SIZE, Number, vector
from controller.regions.pipe_surface import pipe_rings
from controller.regions.shape import Array, Bounds, Evaluation, Vector3, ball_bounds, join, require, require_finite


@dataclass(frozen=True)
class Pipe:
    """All points within `radius` [m] of the line through `points` [m, NED], rounded at its ends; g is the distance [m].

    Where pieces of the pipe meet, the distance is that to the surface outside, and inside a bound of it.

    Examples
    --------
    >>> from controller.regions import Pipe
    >>> Pipe(points=((0.0, 0.0, 5.0), (4.0, 0.0, 5.0), (4.0, 3.0, 5.0)), radius=0.5).bounds()
    ((-0.5, -0.5, 4.5), (4.5, 3.5, 5.5))
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    points: tuple[Vector3, ...]
    radius: float  # m

    def __post_init__(self) -> None:
        for point in self.points:
            require_finite("pipe", points=point)
        require_finite("pipe", radius=self.radius)
        require(len(self.points) >= 2, "pipe", "points", f"{len(self.points)} points", "2 or more")
        require(self.radius > 0.0, "pipe", "radius", self.radius, "above 0 m")
        for a, b in zip(self.points, self.points[1:], strict=False):
            require(a != b, "pipe", "points", f"{a} twice running", "points that differ")

    def packed(self) -> tuple[float, ...]:
        """Return the radius and the points."""
        return (self.radius, *(x for point in self.points for x in point))

    def numbers(self) -> tuple[Number, ...]:
        """Return what `packed` gives, by name and unit."""
        return (
            Number("radius", *SIZE),
            *(number for i in range(1, len(self.points) + 1) for number in vector(f"point[{i}]", LENGTH)),
        )

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about it."""
        return join([ball_bounds(point, self.radius) for point in self.points])


@jit_noalloc
def pipe(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Pipe` at the position `p`."""
    nearest = math.inf
    nx, ny, nz = 0.0, 0.0, 0.0
    for i in range(1, q.size - 3, 3):
        ex, ey, ez = q[i + 3] - q[i], q[i + 4] - q[i + 1], q[i + 5] - q[i + 2]
        x, y, z = p[0] - q[i], p[1] - q[i + 1], p[2] - q[i + 2]
        along = clamp((x * ex + y * ey + z * ez) / (ex * ex + ey * ey + ez * ez), 0.0, 1.0)
        x, y, z = x - along * ex, y - along * ey, z - along * ez
        distance = math.sqrt(x * x + y * y + z * z)
        if not distance >= nearest:  # so that NaN comes through
            nearest, nx, ny, nz = distance, x, y, z
    g = nearest - q[0]
    if nearest > 0.0:
        return g, nx / nearest, ny / nearest, nz / nearest, g
    return g, 0.0, 0.0, 0.0, g


def surface(shape: Pipe, limits: Bounds) -> Mesh:
    """Return rings along its line, and its round ends."""
    first, rings, last = pipe_rings(shape, AROUND)
    return lathe(rings, first, last)


_UNITS = {"points": "m", "radius": "m"}
ENTRY = Entry(Pipe, pipe, Pipe(((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 1.0)), 0.4), _UNITS, surface)
