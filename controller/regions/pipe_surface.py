"""The surface of a pipe as rings: rays from its middle line, each as far as it is inside."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from controller.regions.shape import Array

if TYPE_CHECKING:
    from controller.regions.shapes.pipe import Pipe

_MOST_STEPS = 20_000  # along a ray that runs beside a straight stretch, just inside its surface
_ROUNDING = 1e-12  # of the radius
_BEND = math.radians(15.0)  # between rings about a corner
_STRAIGHT = 1e-9  # of a turn that is none


def pipe_rings(pipe: Pipe, around: int) -> tuple[Array, list[Array], Array]:
    """Return the surface of a pipe.

    Parameters
    ----------
    pipe : Pipe
        Any.
    around : int
        Points of a ring.

    Returns
    -------
    ndarray, shape (3,)
        The end before the first ring [m, NED].
    list of ndarray, shape (around, 3)
        Rings, right-handed about the way on, whose points of one place lie in a line along the pipe.
    ndarray, shape (3,)
        The end behind the last ring.
    """
    points = np.array(pipe.points)
    ways = np.diff(points, axis=0)
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    rays = [*_rays(points, ways, around)]
    ends = [(points[0], -ways[0]), (points[-1], ways[-1])]
    origins = np.vstack([np.broadcast_to(at, d.shape) for at, d in rays] + [at for at, _ in ends])
    directions = np.vstack([d for _, d in rays] + [d for _, d in ends])
    surface = _left(pipe, origins, directions)
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
            outer = np.cross(way, axis)  # away from where the pipe turns to
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
    """Return a vector across a unit axis, turned about it."""
    return math.cos(angle) * vector + math.sin(angle) * np.cross(axis, vector)


def _left(pipe: Pipe, origins: Array, directions: Array) -> Array:
    """Return where rays from inside leave the pipe: the distance to the surface is never more than is left to go."""
    from controller.regions.region_set import Region, clearances_at  # which know of all shapes

    region = Region("pipe", pipe, "in")
    gone = np.zeros(len(origins))
    inside = np.arange(len(origins))
    for _ in range(_MOST_STEPS):
        left = clearances_at(origins[inside] + gone[inside, None] * directions[inside], region)
        inside, left = inside[left > _ROUNDING * pipe.radius], left[left > _ROUNDING * pipe.radius]
        if not inside.size:
            break
        gone[inside] += left
    surface: Array = origins + gone[:, None] * directions
    return surface
