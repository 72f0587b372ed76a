"""Shapes of regions as lines: their outlines as they are seen from some side, and edges that show them as solids."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.path import Path

from controller.quaternion import rotation_matrix
from controller.regions import Box, Cone, Cylinder, DepthBand, Ellipsoid, HalfSpace, Pipe, Prism, Sphere
from controller.regions.mesh import Mesh
from controller.regions.region_set import surface_of
from controller.regions.shape import Shape
from cosim.simulation.signals import Array

# drawn with smoother lines than their meshes have
_BY_NUMBERS = (Sphere, Box, Cylinder, Ellipsoid, Cone, Pipe, Prism, HalfSpace, DepthBand)
_TURN = np.linspace(0.0, 2.0 * np.pi, 73)  # rad
_CORNERS = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])
_BOX_EDGES = [(a, b) for a in range(8) for b in range(a) if (_CORNERS[a] != _CORNERS[b]).sum() == 1]


@dataclass(frozen=True)
class Piece:
    """All that is within `radius` of the convex hull of points; or a polygon in space as it is."""

    points: Array  # (n, 3) m
    radius: float = 0.0  # m
    polygon: bool = False


def pieces_of(shape: Shape, low: Array, high: Array) -> list[Piece]:
    """Return a shape as pieces that make it up.

    Parameters
    ----------
    shape : Shape
        At some place, not of attitude.
    low, high : ndarray, shape (3,)
        Corners of a box [m, NED]: what has no end is cut there, and pieces quite outside are left out.

    Returns
    -------
    list of Piece
        Empty if no part of it is in the box.
    """
    return [
        piece
        for piece in _pieces(shape, low, high)
        if len(piece.points)
        and (piece.points.min(axis=0) - piece.radius < high).all()
        and (piece.points.max(axis=0) + piece.radius > low).all()
    ]


def _pieces(shape: Shape, low: Array, high: Array) -> Iterator[Piece]:
    match shape:
        case Sphere():
            yield Piece(np.array([shape.centre]), shape.radius)
        case Box():
            yield Piece(_box_corners(shape))
        case Cylinder() | Ellipsoid():
            yield Piece(np.vstack(list(edges_of(shape, low, high))))
        case Cone():
            yield Piece(np.vstack([shape.feature, *(_cap(shape, share) for share in np.linspace(0.0, 1.0, 7))]))
        case Pipe():
            points = np.array(shape.points)
            for start, end in zip(points, points[1:], strict=False):
                yield Piece(np.array([start, end]), shape.radius)
        case Prism():
            top, bottom = _prism_ends(shape)
            yield from (Piece(top, polygon=True), Piece(bottom, polygon=True))
            for i in range(len(top)):
                yield Piece(np.array([top[i - 1], top[i], bottom[i], bottom[i - 1]]))
        case HalfSpace() | DepthBand():
            corners = _box_between(low, high)
            for point, normal in _planes(shape):
                corners = _cut(corners, point, normal)
            yield Piece(corners)
        case _:
            mesh = surface_of(shape, shape.bounds())
            yield from (Piece(mesh.vertices[triangle], polygon=True) for triangle in mesh.triangles)


def mesh_of(shape: Shape) -> Mesh | None:
    """Return the mesh of a shape; none where the shape is drawn by its numbers."""
    return None if isinstance(shape, _BY_NUMBERS) else surface_of(shape, shape.bounds())


def silhouette(mesh: Mesh, view: Array) -> list[Array]:
    """Return the edges of a mesh between a face that is seen and one that is not.

    Parameters
    ----------
    mesh : Mesh
        Closed.
    view : ndarray, shape (2, 3)
        As for `outlines`.

    Returns
    -------
    list of ndarray, shape (2, 2)
        In the picture; those that the mesh itself hides are among them.
    """
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    seen = np.cross(b - a, c - a) @ np.cross(view[0], view[1]) > 0.0
    flat, sides = mesh.vertices @ view.T, {}
    for triangle, faces in zip(mesh.triangles.tolist(), seen.tolist(), strict=True):
        for start, end in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            sides[start, end] = faces
    return [flat[[i, j]] for (i, j), faces in sides.items() if faces and not sides.get((j, i), False)]


def edges_of(shape: Shape, low: Array, high: Array) -> Iterator[Array]:
    """Yield lines, shape (n, 3) [m, NED], that show a shape as a solid.

    Parameters
    ----------
    shape : Shape
        At some place, not of attitude.
    low, high : ndarray, shape (3,)
        Corners of the box in which planes end [m, NED].

    Yields
    ------
    ndarray, shape (n, 3)
        Drawn one by one.
    """
    match shape:
        case Sphere():
            yield from _circles(np.array(shape.centre), shape.radius * np.eye(3))
        case Ellipsoid():
            axes = rotation_matrix(np.array(shape.quaternion)) * np.array(shape.semi_axes)
            steps = np.linspace(-0.95, 0.95, 11)
            for step in steps:  # rings along the first axis
                ring = np.sqrt(1.0 - step**2) * (
                    np.outer(np.cos(_TURN), axes[:, 1]) + np.outer(np.sin(_TURN), axes[:, 2])
                )
                yield np.array(shape.centre) + step * axes[:, 0] + ring
            yield from _circles(np.array(shape.centre), axes)
        case Box():
            corners = _box_corners(shape)
            yield from (corners[[a, b]] for a, b in _BOX_EDGES)
        case Cylinder():
            start, end = np.array(shape.start), np.array(shape.end)
            for centre in (start, end):
                yield centre + shape.radius * _around(end - start)
        case Cone():
            rim = _cap(shape, 1.0)
            yield rim
            yield from (np.array([shape.feature, rim[i]]) for i in (0, 18, 36, 54))
        case Pipe():
            yield np.array(shape.points)
        case Prism():
            top, bottom = _prism_ends(shape)
            yield from (np.vstack([end, end[:1]]) for end in (top, bottom))
            yield from (np.array(pair) for pair in zip(top, bottom, strict=True))
        case HalfSpace() | DepthBand():
            for point, normal in _planes(shape):
                yield _section(low, high, point, normal)


def outlines(pieces: Sequence[Piece], view: Array) -> list[Array]:
    """Return the outline of each piece as it is seen.

    Parameters
    ----------
    pieces : sequence of Piece
        In space.
    view : ndarray, shape (2, 3)
        Orthonormal rows: the directions [NED] that point right and up in the picture.

    Returns
    -------
    list of ndarray, shape (n, 2)
        Closed, counterclockwise.
    """
    around = np.column_stack([np.cos(_TURN), np.sin(_TURN)])
    seen = []
    for piece in pieces:
        flat = piece.points @ view.T
        if piece.polygon:
            x, y = flat.T
            clockwise = float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 0.0
            flat = flat[::-1] if clockwise else flat
            seen.append(np.vstack([flat, flat[:1]]))
        else:  # the farthest point in each direction
            seen.append(flat[np.argmax(around @ flat.T, axis=1)] + piece.radius * around)
    return seen


def rim(outline: Array, others: Sequence[Array]) -> Array:
    """Return an outline with NaN where it is within others, which hide it.

    Parameters
    ----------
    outline : ndarray, shape (n, 2)
        Closed.
    others : sequence of ndarray, shape (m, 2)
        Closed outlines of the same region.

    Returns
    -------
    ndarray, shape (k, 2)
        With more points, if there are others.
    """
    if not others:
        return outline
    share = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None]
    fine = np.vstack(
        [*((1.0 - share) * a + share * b for a, b in zip(outline, outline[1:], strict=False)), outline[-1:]]
    )
    size = np.ptp(outline, axis=0).max()
    for other in others:
        fine[Path(other).contains_points(fine, radius=-1e-3 * size)] = np.nan
    return fine


def _box_corners(box: Box) -> Array:
    corners: Array = (
        np.array(box.centre) + (0.5 * np.array(box.size) * _CORNERS) @ rotation_matrix(np.array(box.quaternion)).T
    )
    return corners


def _box_between(low: Array, high: Array) -> Array:
    corners: Array = (low + high) / 2.0 + (high - low) / 2.0 * _CORNERS
    return corners


def _circles(centre: Array, axes: Array) -> Iterator[Array]:
    """Yield the circles through the ends of half axes, which are the columns of `axes`."""
    for i, j in ((0, 1), (0, 2), (1, 2)):
        yield centre + np.outer(np.cos(_TURN), axes[:, i]) + np.outer(np.sin(_TURN), axes[:, j])


def _around(axis: Array) -> Array:
    """Return unit vectors at right angles to an axis, all around it, shape (n, 3)."""
    unit = axis / np.linalg.norm(axis)
    first = np.cross(unit, np.eye(3)[np.argmin(np.abs(unit))])
    first /= np.linalg.norm(first)
    result: Array = np.outer(np.cos(_TURN), first) + np.outer(np.sin(_TURN), np.cross(unit, first))
    return result


def _cap(cone: Cone, share: float) -> Array:
    """Return a circle on the round end of a cone, at a share of its half angle."""
    axis = np.array(cone.axis) / np.linalg.norm(cone.axis)
    angle = share * cone.half_angle
    points: Array = np.array(cone.feature) + cone.range * (np.cos(angle) * axis + np.sin(angle) * _around(axis))
    return points


def _prism_ends(prism: Prism) -> tuple[Array, Array]:
    top, bottom = (np.column_stack([prism.corners, np.full(len(prism.corners), z)]) for z in (prism.top, prism.bottom))
    return top, bottom


def _planes(shape: HalfSpace | DepthBand) -> list[tuple[Array, Array]]:
    """Return a point of each plane that bounds a shape, and the direction that points out of it."""
    if isinstance(shape, HalfSpace):
        return [(np.array(shape.point), np.array(shape.normal) / np.linalg.norm(shape.normal))]
    down = np.array([0.0, 0.0, 1.0])
    return [((shape.depth + side * shape.tolerance) * down, side * down) for side in (-1.0, 1.0)]


def _cut(corners: Array, point: Array, normal: Array) -> Array:
    """Return corners of the part of a convex body that is behind a plane."""
    out = (corners - point) @ normal
    behind, before = out <= 0.0, out > 0.0
    crossing = [
        a + (b - a) * (da / (da - db))
        for a, da in zip(corners[behind], out[behind], strict=True)
        for b, db in zip(corners[before], out[before], strict=True)
    ]  # of all pairs: those within the face change no hull
    return np.vstack([corners[behind], *crossing]) if behind.any() else np.empty((0, 3))


def _section(low: Array, high: Array, point: Array, normal: Array) -> Array:
    """Return the polygon in which a plane cuts a box, closed; empty if it does not."""
    corners = _box_between(low, high)
    out = (corners - point) @ normal
    met = [
        corners[a] + (corners[b] - corners[a]) * (out[a] / (out[a] - out[b]))
        for a, b in _BOX_EDGES
        if out[a] * out[b] < 0.0
    ]
    if len(met) < 3:
        return np.empty((0, 3))
    points = np.array(met)
    turned = _around(normal)[[0, 18]]  # two directions in the plane, at right angles
    angles = np.arctan2(*((points - points.mean(axis=0)) @ turned.T).T)
    commanded = points[np.argsort(angles)]
    return np.vstack([commanded, commanded[:1]])
