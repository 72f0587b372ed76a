"""Projection of shapes to lines: visible areas, outlines, and edges that show them as solids."""

# The input is the entry of a shape: its mesh, or for finer lines its half axes or planes.

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controller.regions.region_set import shape_entry, surface_of
from controller.regions.shape import Bounds, Shape
from controller.regions.triangle_mesh import Mesh, frame
from cosim.simulation.signals import Array

_TURN = np.linspace(0.0, 2.0 * np.pi, 73)  # rad
_AROUND = np.column_stack([np.cos(_TURN), np.sin(_TURN)])
_CORNERS = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])
_BOX_EDGES = [(a, b) for a in range(8) for b in range(a) if (_CORNERS[a] != _CORNERS[b]).sum() == 1]
_SHARP = np.cos(np.radians(31.0))  # cosine of the angle between faces from which on their edge is drawn
_TEST_DISTANCE = 1e-3  # distance of test points from a shape's outline, relative to the shape's size
_GRID = 12  # number of points of the test grid per side
_PIECES = 4  # number of pieces of an outline's edge whose visibility is tested


@dataclass(frozen=True)
class ShapeLines:
    """Projection of a shape: lines in the picture, shape (n, 2) each."""

    areas: list[Array]  # closed outlines of filled areas
    outline: list[Array]  # NaN in hidden parts
    edges: list[Array]


def lines_of_shape(shape: Shape, low: Array, high: Array, view: Array) -> ShapeLines | None:
    """Project a shape to lines; low, high (3,) [m, NED], view (2, 3) [NED]."""
    entry = shape_entry(shape)
    if entry.half_axes is not None:
        return _ellipsoid(*entry.half_axes(shape), low, high, view)
    if entry.planes is not None:
        return _between_planes(entry.planes(shape), low, high, view)
    limits: Bounds = (tuple(low.tolist()), tuple(high.tolist()))
    mesh = surface_of(shape, limits)
    if not _meet(mesh.vertices.min(axis=0), mesh.vertices.max(axis=0), low, high):
        return None
    areas = _silhouettes(mesh, view)
    return ShapeLines(areas, [_seen_part(area, areas) for area in areas], list(_sharp_edges(mesh, view)))


def hull_of(points: Array, view: Array) -> Array:
    """Return the closed convex hull of points [m, NED], shape (n, 3), in a view as for `lines_of_shape`."""
    flat = points @ view.T
    farthest: Array = flat[np.argmax(_AROUND @ flat.T, axis=1)]  # in each direction
    return farthest


def cover(areas: Sequence[Array], low: Array, high: Array) -> bool:
    """Return True if the areas of a `ShapeLines` cover all points of a grid in a rectangle."""
    fractions = np.linspace(0.01, 0.99, _GRID)
    points = np.array(
        [[x, y] for x in low[0] + fractions * (high - low)[0] for y in low[1] + fractions * (high - low)[1]]
    )
    return bool(_within(points, areas).all())


def _meet(lower: Array, upper: Array, low: Array, high: Array) -> bool:
    return bool((lower < high).all() and (upper > low).all())


def _ellipsoid(center: Array, half_axes: Array, low: Array, high: Array, view: Array) -> ShapeLines | None:
    reach = np.linalg.norm(half_axes, axis=0)
    if not _meet(center - reach, center + reach, low, high):
        return None
    middle, flat = view @ center, half_axes @ view.T
    outline = middle + _AROUND @ np.linalg.cholesky(flat.T @ flat).T
    circles = [middle + _AROUND @ flat[[i, j]] for i, j in ((0, 1), (0, 2), (1, 2))]
    return ShapeLines([outline], [outline], circles)


def _between_planes(planes: Sequence[tuple[Array, Array]], low: Array, high: Array, view: Array) -> ShapeLines | None:
    corners = (low + high) / 2.0 + (high - low) / 2.0 * _CORNERS
    for point, normal in planes:
        corners = _clip(corners, point, normal)
    if not len(corners):
        return None
    hull = hull_of(corners, view)
    sections = [_section(low, high, point, normal) @ view.T for point, normal in planes]
    return ShapeLines([hull], [hull], sections)


def _clip(corners: Array, point: Array, normal: Array) -> Array:
    """Return the corners of the part of a convex body behind a plane."""
    out = (corners - point) @ normal
    behind, before = out <= 0.0, out > 0.0
    crossing = [
        a + (b - a) * (da / (da - db))
        for a, da in zip(corners[behind], out[behind], strict=True)
        for b, db in zip(corners[before], out[before], strict=True)
    ]  # intersections of all pairs: points within a face do not change the hull
    return np.vstack([corners[behind], *crossing]) if behind.any() else np.empty((0, 3))


def _section(low: Array, high: Array, point: Array, normal: Array) -> Array:
    """Return the closed polygon of the intersection of a plane and a box; empty if there is none."""
    corners = (low + high) / 2.0 + (high - low) / 2.0 * _CORNERS
    out = (corners - point) @ normal
    met = [
        corners[a] + (corners[b] - corners[a]) * (out[a] / (out[a] - out[b]))
        for a, b in _BOX_EDGES
        if out[a] * out[b] < 0.0
    ]
    if len(met) < 3:
        return np.empty((0, 3))
    points = np.array(met)
    in_plane = np.array(frame(normal)[1:])
    angles = np.arctan2(*((points - points.mean(axis=0)) @ in_plane.T).T)
    around = points[np.argsort(angles)]
    return np.vstack([around, around[:1]])


def _normals(mesh: Mesh) -> Array:
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    normals: Array = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny)
    return normals


def _silhouettes(mesh: Mesh, view: Array) -> list[Array]:
    """Return the closed outlines of the faces of a mesh that point to one side, with these faces on their left."""
    away = np.cross(view[0], view[1])
    facing = mesh.triangles[_normals(mesh) @ away > 1e-9].tolist()
    onward: dict[int, list[int]] = {}
    sides = {(a, b) for triangle in facing for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True)}
    for a, b in sorted(sides):
        if (b, a) not in sides:
            onward.setdefault(a, []).append(b)
    flat, lines = mesh.vertices @ view.T, []
    for start, following in onward.items():
        while following:
            line = [start]
            while onward.get(line[-1]):
                line.append(onward[line[-1]].pop())
            lines.append(flat[line])
    return lines


def _seen_part(outline: Array, areas: Sequence[Array]) -> Array:
    """Return an outline with NaN where the shape is on both sides of it."""
    fraction = np.linspace(0.0, 1.0, _PIECES, endpoint=False)[:, None]
    starts = np.vstack([(1.0 - fraction) * a + fraction * b for a, b in zip(outline, outline[1:], strict=False)])
    ends = np.roll(starts, -1, axis=0)
    steps = ends - starts
    right = np.column_stack([steps[:, 1], -steps[:, 0]]) / np.maximum(np.linalg.norm(steps, axis=1), 1e-12)[:, None]
    beside = (starts + ends) / 2.0 + _TEST_DISTANCE * np.ptp(outline, axis=0).max() * right
    hidden = _within(beside, areas)
    pieces = np.stack([starts, ends, np.full_like(starts, np.nan)], axis=1)
    pieces[hidden] = np.nan
    joined = ~hidden & ~np.roll(hidden, -1)  # the next piece is visible too
    keep = np.ones(pieces.shape[:2], dtype=bool)
    keep[joined, 1:] = False
    keep[-1] = True
    seen: Array = pieces[keep]
    return seen


def _within(points: Array, areas: Sequence[Array]) -> NDArray[np.bool_]:
    """Return a mask of the points within the closed outlines, shape (n,)."""
    turns = np.sum([_turns_about(points, area) for area in areas], axis=0)
    within: NDArray[np.bool_] = turns != 0
    return within


def _turns_about(points: Array, line: Array) -> NDArray[np.intp]:
    """Return the winding number of a closed line around each point, shape (n,)."""
    x, y = points[:, :1], points[:, 1:]
    (ax, ay), (bx, by) = line[:-1].T, line[1:].T
    left = (bx - ax) * (y - ay) - (x - ax) * (by - ay)
    up, down = (ay <= y) & (by > y) & (left > 0.0), (ay > y) & (by <= y) & (left < 0.0)
    turns: NDArray[np.intp] = up.sum(axis=1) - down.sum(axis=1)
    return turns


def _sharp_edges(mesh: Mesh, view: Array) -> Iterator[Array]:
    normals, flat = _normals(mesh), mesh.vertices @ view.T
    faces: dict[tuple[int, int], int] = {}
    for i, triangle in enumerate(mesh.triangles.tolist()):
        for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            other = faces.pop((b, a), None)
            if other is None:
                faces[a, b] = i
            elif normals[i] @ normals[other] < _SHARP:
                yield flat[[a, b]]
    yield from (flat[[a, b]] for a, b in faces)  # borders of an open mesh
