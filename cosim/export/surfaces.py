"""Surfaces of regions' shapes as triangles, for viewers that know no other shapes.

Every corner of every triangle lies on the surface; between corners a round surface is cut short.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from controller.quaternion import rotation_matrix
from controller.regions import Box, Cone, Cylinder, DepthBand, Ellipsoid, HalfSpace, Pipe, Prism, Sphere
from controller.regions.mesh import Mesh
from controller.regions.shape import Bounds, Shape
from controller.regions.shapes import ENTRIES
from cosim.errors import ExportError
from cosim.export.pipe_surface import pipe_rings
from cosim.simulation.signals import Array

AROUND = 32  # corners of a circle
_TIMES_SPLIT = 2  # of each triangle of the icosahedron that becomes a ball
_GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0


def surface_of(shape: Shape, limits: Bounds) -> Mesh:
    """Return the surface of a shape of position.

    Parameters
    ----------
    shape : Shape
        Any but those of attitude, which have none.
    limits : Bounds
        What has no end is cut to a patch of their size: planes of depth bands and half-spaces.

    Returns
    -------
    Mesh
        Closed, but for planes.

    Raises
    ------
    ExportError
        If the shape has none, as those of attitude.
    """
    surface = next((entry.surface for entry in ENTRIES.values() if type(shape) is entry.shape), None)
    if surface is not None:
        return surface(shape, limits)
    if isinstance(shape, Sphere):
        ball = _ball()
        return Mesh(np.array(shape.centre) + shape.radius * ball.vertices, ball.triangles)
    if isinstance(shape, Ellipsoid):
        ball = _ball()
        turned = (ball.vertices * np.array(shape.semi_axes)) @ _turn(shape.quaternion).T
        return Mesh(np.array(shape.centre) + turned, ball.triangles)
    if isinstance(shape, Box):
        return _box(shape)
    if isinstance(shape, Cylinder):
        return _cylinder(shape)
    if isinstance(shape, Cone):
        return sector(shape.feature, shape.axis, shape.half_angle, shape.range)
    if isinstance(shape, Prism):
        return _prism(shape)
    if isinstance(shape, Pipe):
        first, rings, last = pipe_rings(shape, AROUND)
        return _lathe(rings, first, last)
    if isinstance(shape, DepthBand):
        low, high = shape.depth - shape.tolerance, shape.depth + shape.tolerance
        upper, lower = (_patch((0.0, 0.0, z), (0.0, 0.0, up), limits) for z, up in ((low, -1.0), (high, 1.0)))
        return Mesh(
            np.vstack([upper.vertices, lower.vertices]),
            np.vstack([upper.triangles, lower.triangles + len(upper.vertices)]),
        )
    if isinstance(shape, HalfSpace):
        return _patch(shape.point, shape.normal, limits)
    raise ExportError(f"shape {type(shape).__name__} has no surface, expected one of a shape in space")


def sector(apex: Sequence[float], axis: Sequence[float], half_angle: float, reach: float) -> Mesh:
    """Return all that is within a reach [m] of an apex and a half angle [rad] of an axis.

    Parameters
    ----------
    apex, axis : sequence of float
        [m] and of any length above 0.
    half_angle : float
        Up to pi [rad].
    reach : float
        [m].

    Returns
    -------
    Mesh
        A cone with a round end.
    """
    along, *across = _frame(np.array(axis, dtype=float))
    steps = max(2, math.ceil(half_angle / (2.0 * math.pi / AROUND)))
    angles = np.linspace(half_angle, 0.0, steps + 1)[:-1]
    circle = _circle(*across)
    origin = np.array(apex, dtype=float)
    rings = [origin + reach * (math.cos(a) * along + math.sin(a) * circle) for a in angles]
    return _lathe(rings, origin, origin + reach * along)


# ---- the shapes ----------------------------------------------------------------------------------------------------


def _ball() -> Mesh:
    """Return the unit ball: an icosahedron whose triangles are split."""
    corners = [
        (a * x, b * y, 0.0)[k:] + (a * x, b * y, 0.0)[:k]
        for k in range(3)
        for x, y in ((1.0, _GOLDEN),)
        for a in (-1.0, 1.0)
        for b in (-1.0, 1.0)
    ]
    vertices = np.array(corners)
    # its triangles are the triples of corners that are an edge, 2, apart
    apart = np.linalg.norm(vertices[:, None] - vertices[None], axis=2)
    near = np.isclose(apart, 2.0)
    triangles = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[k, i]
    ]
    mesh = Mesh(vertices / np.linalg.norm(vertices[0]), _outward(vertices, np.array(triangles)))
    for _ in range(_TIMES_SPLIT):
        mesh = _split(mesh)
    return mesh


def _split(mesh: Mesh) -> Mesh:
    """Return each triangle as four, on the unit ball."""
    vertices, middles, triangles = [*mesh.vertices], {}, []

    def middle(a: int, b: int) -> int:
        key = (min(a, b), max(a, b))
        if key not in middles:
            point = vertices[a] + vertices[b]
            middles[key] = len(vertices)
            vertices.append(point / np.linalg.norm(point))
        return middles[key]

    for a, b, c in mesh.triangles.tolist():
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        triangles += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return Mesh(np.array(vertices), np.array(triangles))


def _outward(vertices: Array, triangles: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the triangles of a body about the origin, each turned so that it faces outward."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) < 0.0
    turned = triangles.copy()
    turned[inward] = triangles[inward][:, ::-1]
    return turned


def _box(shape: Box) -> Mesh:
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    turned = (corners * np.array(shape.size)) @ _turn(shape.quaternion).T
    return Mesh(np.array(shape.centre) + turned, triangles)


def _cylinder(shape: Cylinder) -> Mesh:
    start, end = np.array(shape.start), np.array(shape.end)
    _, *across = _frame(end - start)
    circle = shape.radius * _circle(*across)
    return _lathe([start + circle, end + circle], start, end)


def _prism(shape: Prism) -> Mesh:
    corners = np.array(shape.corners)
    following = np.roll(corners, -1, axis=0)
    if np.sum(corners[:, 0] * following[:, 1] - following[:, 0] * corners[:, 1]) < 0.0:
        corners = corners[::-1]
    n = len(corners)
    flat = np.array(_ears(corners))
    vertices = np.vstack([np.column_stack([corners, np.full(n, z)]) for z in (shape.top, shape.bottom)])
    sides = [t for i in range(n) for j in ((i + 1) % n,) for t in ((i, j, n + j), (i, n + j, n + i))]
    return Mesh(vertices, np.vstack([flat[:, ::-1], flat + n, sides]))


def _ears(corners: Array) -> list[tuple[int, int, int]]:
    """Return the triangles of a simple polygon, whose corners go around from north to east."""

    def side(a: int, b: int, c: int) -> float:
        u, v = corners[b] - corners[a], corners[c] - corners[a]
        return float(u[0] * v[1] - u[1] * v[0])

    left, triangles = [*range(len(corners))], []
    while len(left) > 3:
        for i, b in enumerate(left):
            a, c = left[i - 1], left[(i + 1) % len(left)]
            others = (p for p in left if p not in (a, b, c))
            if side(a, b, c) > 0.0 and not any(min(side(a, b, p), side(b, c, p), side(c, a, p)) >= 0.0 for p in others):
                triangles.append((a, b, c))
                break
        else:  # corners in a line are no ear of any area
            i = next(i for i in range(len(left)) if side(left[i - 1], left[i], left[(i + 1) % len(left)]) <= 0.0)
            triangles.append((left[i - 1], left[i], left[(i + 1) % len(left)]))
        left.pop(i)
    return [*triangles, (left[0], left[1], left[2])]


def _patch(point: Sequence[float], normal: Sequence[float], limits: Bounds) -> Mesh:
    """Return a square of a plane, about its point nearest to the middle of the limits."""
    low, high = np.array(limits[0]), np.array(limits[1])
    along, u, v = _frame(np.array(normal, dtype=float))
    middle = (low + high) / 2.0
    centre = middle - ((middle - np.array(point)) @ along) * along
    half = float(np.linalg.norm(high - low)) / 2.0
    corners = [centre + half * (a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Mesh(np.array(corners), np.array([(0, 1, 2), (0, 2, 3)]))


# ---- circles and rings ---------------------------------------------------------------------------------------------


def _turn(quaternion: Sequence[float]) -> Array:
    e = np.array(quaternion, dtype=float)
    return rotation_matrix(e / np.linalg.norm(e))


def _frame(axis: Array) -> tuple[Array, Array, Array]:
    """Return the unit axis and two unit vectors across it, right-handed."""
    along = axis / np.linalg.norm(axis)
    u = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    u /= np.linalg.norm(u)
    return along, u, np.cross(along, u)


def _circle(u: Array, v: Array) -> Array:
    angles = np.linspace(0.0, 2.0 * math.pi, AROUND, endpoint=False)[:, None]
    return np.cos(angles) * u + np.sin(angles) * v


def _lathe(rings: Sequence[Array], first: Array, last: Array) -> Mesh:
    """Return the skin over rings one behind the other, each right-handed about the way on, with a point at each end."""
    n = len(rings[0])
    vertices = np.vstack([*rings, first, last])
    i = np.arange(n)
    j = (i + 1) % n
    start, end = len(vertices) - 2, len(vertices) - 1
    parts = [np.column_stack([np.full(n, start), j, i])]
    for k in range(len(rings) - 1):
        a, b = k * n, (k + 1) * n
        parts += [np.column_stack([a + i, a + j, b + j]), np.column_stack([a + i, b + j, b + i])]
    at = (len(rings) - 1) * n
    parts.append(np.column_stack([np.full(n, end), at + i, at + j]))
    return Mesh(vertices, np.vstack(parts))
