"""Triangle meshes of surfaces."""

# Every corner of every triangle lies on the surface; between corners a round surface is cut short.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.quaternion import rotation_matrix
from controller.regions.shape import Array, Bounds

AROUND = 32  # number of corners of a circle
_SPLITS = 2  # number of times that each triangle of the icosahedron is split to become a ball
_SAME_PLACE = 1e-8  # m, grid on which corners count as one
_GOLDEN = (1.0 + math.sqrt(5.0)) / 2.0


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles abc whose normals (b - a) x (c - a) point outward."""

    vertices: Array  # (n, 3) m, NED
    triangles: NDArray[np.intp]  # (m, 3) indices of vertices


def closed_grid(points: Array) -> Mesh:
    """Return the mesh of a surface that closes in both directions of a grid, such as a ring; points [m, NED]."""
    rows, columns = points.shape[:2]
    i, j = (of.ravel() for of in np.mgrid[:rows, :columns])
    a, b = i * columns + j, (i + 1) % rows * columns + j
    c, d = (i + 1) % rows * columns + (j + 1) % columns, i * columns + (j + 1) % columns
    return Mesh(points.reshape(-1, 3), np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]))


def sector(apex: Sequence[float], axis: Sequence[float], half_angle: float, reach: float) -> Mesh:
    """Return the mesh of the points within a reach [m] of an apex and a half angle [rad] of an axis."""
    along, *across = frame(np.array(axis, dtype=float))
    steps = max(2, math.ceil(half_angle / (2.0 * math.pi / AROUND)))
    angles = np.linspace(half_angle, 0.0, steps + 1)[:-1]
    around = circle(*across)
    origin = np.array(apex, dtype=float)
    rings = [origin + reach * (math.cos(a) * along + math.sin(a) * around) for a in angles]
    return lathe(rings, origin, origin + reach * along)


def ball() -> Mesh:
    """Return the unit ball about the origin: an icosahedron whose triangles are split."""
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
    for _ in range(_SPLITS):
        mesh = _split(mesh)
    return mesh


def _split(mesh: Mesh) -> Mesh:
    """Split each triangle into four, on the unit ball."""
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
    """Return the triangles of a body about the origin, with outward orientation."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) < 0.0
    turned = triangles.copy()
    turned[inward] = triangles[inward][:, ::-1]
    return turned


def patches(planes: Sequence[tuple[Array, Array]], limits: Bounds) -> Mesh:
    """Return a square of each plane, given by a point and a normal, about its point nearest to the limits' middle."""
    low, high = np.array(limits[0]), np.array(limits[1])
    middle, half = (low + high) / 2.0, float(np.linalg.norm(high - low)) / 2.0
    corners, triangles = [], []
    for i, (point, normal) in enumerate(planes):
        along, u, v = frame(normal)
        center = middle - ((middle - point) @ along) * along
        corners += [center + half * (a * u + b * v) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        triangles += [(4 * i, 4 * i + 1, 4 * i + 2), (4 * i, 4 * i + 2, 4 * i + 3)]
    return Mesh(np.array(corners), np.array(triangles))


def weld(mesh: Mesh) -> Mesh:
    """Merge corners within `_SAME_PLACE`, and remove triangles without area."""
    _, first, index = np.unique(np.round(mesh.vertices / _SAME_PLACE), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # the corners stay in their order
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    triangles = place[index.reshape(-1)][mesh.triangles]
    a, b, c = triangles.T
    return Mesh(mesh.vertices[first[order]], triangles[(a != b) & (b != c) & (c != a)])


def frame(axis: Array) -> tuple[Array, Array, Array]:
    """Return the unit axis and two unit vectors across it, right-handed."""
    along = axis / np.linalg.norm(axis)
    u = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    u /= np.linalg.norm(u)
    return along, u, np.cross(along, u)


def circle(u: Array, v: Array) -> Array:
    """Return `AROUND` points of the unit circle through two unit vectors, shape (n, 3)."""
    angles = np.linspace(0.0, 2.0 * math.pi, AROUND, endpoint=False)[:, None]
    return np.cos(angles) * u + np.sin(angles) * v


def lathe(rings: Sequence[Array], first: Array, last: Array) -> Mesh:
    """Return the surface over consecutive rings, right-handed about their direction, with a point at each end."""
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


def place_points(points: Array, center: Sequence[float], quaternion: Sequence[float]) -> Array:
    """Rotate points of a body [m] by a quaternion of any length, and move them to a center [m, NED]."""
    e = np.array(quaternion, dtype=float)
    world: Array = np.array(center) + points @ rotation_matrix(e / np.linalg.norm(e)).T
    return world
