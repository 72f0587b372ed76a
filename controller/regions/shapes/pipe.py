"""Pipe: a chain of capsules, such as the bent pipeline of section V.B, without an equation in the paper."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from controller.regions.entry import Entry
from controller.regions.geometry import clamp
from controller.regions.numbers import LENGTH, SIZE, Number, vector
from controller.regions.shape import Array, Bounds, Evaluation, Vector3, ball_bounds, join, require, require_finite
from controller.regions.triangle_mesh import AROUND, Mesh, lathe, weld

_MAX_STEPS = 20_000  # maximum number of steps of a ray; many where it runs just inside a straight surface
_ROUNDING = 1e-12  # distance to the surface that counts as 0, as a fraction of the radius
_BEND = math.radians(15.0)  # rad, angle between rings about a corner
_STRAIGHT = 1e-9  # rad, turn below which a line counts as straight


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
        """Return name and unit of each number of `packed`."""
        return (
            Number("radius", *SIZE),
            *(number for i in range(1, len(self.points) + 1) for number in vector(f"point[{i}]", LENGTH)),
        )

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about it."""
        return join([ball_bounds(point, self.radius) for point in self.points])


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
    first, rings, last = _rings(shape, AROUND)
    return weld(lathe(rings, first, last))  # inside a bend, rings share their corners


def _rings(shape: Pipe, around: int) -> tuple[Array, list[Array], Array]:
    """Return the surface of a pipe as rings with two end points [m, NED]."""
    points = np.array(shape.points)
    ways = np.diff(points, axis=0)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    rays = [*_rays(points, ways, around)]
    ends = [(points[0], -ways[0]), (points[-1], ways[-1])]
    origins = np.vstack([np.broadcast_to(at, d.shape) for at, d in rays] + [at for at, _ in ends])
    directions = np.vstack([d for _, d in rays] + [d for _, d in ends])
    surface = _exit_points(shape, origins, directions)
    return surface[-2], np.split(surface[:-2], len(rays)), surface[-1]


def _rays(points: Array, ways: Array, around: int) -> Iterator[tuple[Array, Array]]:
    """Yield, ring by ring, the point of the middle line and the directions from it."""
    u = np.cross(ways[0], np.eye(3)[int(np.argmin(np.abs(ways[0])))])
    u /= np.linalg.norm(u)
    angles = np.linspace(0.0, 2.0 * math.pi, around, endpoint=False)[:, None]
    out = np.cos(angles) * u + np.sin(angles) * np.cross(ways[0], u)
    quarter = np.arange(1, round(math.pi / 2.0 / _BEND)) * _BEND
    for tilt in quarter[::-1]:  # the round end
        yield points[0], math.cos(tilt) * out - math.sin(tilt) * ways[0]
    yield points[0], out
    for point, way, on in zip(points[1:-1], ways[:-1], ways[1:], strict=True):
        turn = math.atan2(float(np.linalg.norm(np.cross(way, on))), float(way @ on))
        if turn > _STRAIGHT:
            axis = np.cross(way, on)
            axis = axis / np.linalg.norm(axis) if turn < math.pi - _STRAIGHT else out[0]
            outer = np.cross(way, axis)  # away from the inside of the bend
            k, o = (out @ axis)[:, None], (out @ outer)[:, None]
            # outside, rings fan out about the corner; inside, where they would cross, all stay in the plane between
            between = _turned(outer, axis, turn / 2.0)
            for part in np.linspace(0.0, turn, max(2, math.ceil(turn / _BEND)) + 1):
                yield point, k * axis + o * np.where(o >= 0.0, _turned(outer, axis, part), between)
            out = k * axis + o * _turned(outer, axis, turn)
    yield points[-1], out
    for tilt in quarter:
        yield points[-1], math.cos(tilt) * out + math.sin(tilt) * ways[-1]


def _turned(vector: Array, axis: Array, angle: float) -> Array:
    """Return a vector rotated about a unit axis that is perpendicular to it."""
    return math.cos(angle) * vector + math.sin(angle) * np.cross(axis, vector)


def _exit_points(shape: Pipe, origins: Array, directions: Array) -> Array:
    """Return the exits of rays that start inside: a step by the distance to the surface never leaves the pipe."""
    packed = np.array(shape.packed())
    distances = np.zeros(len(origins))
    inside = np.arange(len(origins))
    for _ in range(_MAX_STEPS):
        remaining = np.array(
            [-pipe(p, packed)[4] for p in origins[inside] + distances[inside, None] * directions[inside]]
        )
        inside, remaining = (
            inside[remaining > _ROUNDING * shape.radius],
            remaining[remaining > _ROUNDING * shape.radius],
        )
        if not inside.size:
            break
        distances[inside] += remaining
    surface: Array = origins + distances[:, None] * directions
    return surface


_UNITS = {"points": "m", "radius": "m"}
ENTRY = Entry(
    Pipe, pipe, Pipe(((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 2.0, 1.0)), 0.4), _UNITS,
    flat_faces=False, kinks="everywhere", convex=False, center=None, surface=surface,
)  # fmt: skip
