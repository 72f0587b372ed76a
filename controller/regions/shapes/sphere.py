"""Sphere: the primary region (49) and, kept out of, the repulsive one (46), (50), (51)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar

import numpy as np

from controller.regions.entry import Entry
from controller.regions.numbers import LENGTH, SIZE, Number, vector
from controller.regions.shape import (
    Array,
    Bounds,
    Evaluation,
    Vector3,
    ball_bounds,
    require,
    require_finite,
    with_former_spelling,
)
from controller.regions.triangle_mesh import Mesh, ball


@with_former_spelling
@dataclass(frozen=True)
class Sphere:
    """All points within `radius` [m] of `center` [m, NED]; g = |p - c|^2 - r^2 [m2].

    Examples
    --------
    >>> from controller.regions import Sphere
    >>> Sphere(center=(1.0, 0.0, 2.0), radius=0.5).bounds()
    ((0.5, -0.5, 1.5), (1.5, 0.5, 2.5))
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m2"
    center: Vector3
    radius: float  # m

    def __post_init__(self) -> None:
        require_finite("sphere", center=self.center, radius=self.radius)
        require(self.radius > 0.0, "sphere", "radius", self.radius, "above 0 m")

    def packed(self) -> tuple[float, ...]:
        """Return center and radius."""
        return (*self.center, self.radius)

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (*vector("center", LENGTH), Number("radius", *SIZE))

    def bounds(self) -> Bounds:
        """Return the corners of the cube about it."""
        return ball_bounds(self.center, self.radius)


def sphere_about(x: float, y: float, z: float, radius: float) -> Evaluation:
    """Evaluate a sphere of a radius at a place (x, y, z), relative to its center [m]."""
    square = x * x + y * y + z * z
    return square - radius * radius, 2.0 * x, 2.0 * y, 2.0 * z, math.sqrt(square) - radius


def sphere(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Sphere` at the position `p`."""
    return sphere_about(p[0] - q[0], p[1] - q[1], p[2] - q[2], q[3])


def surface(shape: Sphere, limits: Bounds) -> Mesh:
    """Return the ball, scaled and moved."""
    unit_ball = ball()
    return Mesh(np.array(shape.center) + shape.radius * unit_ball.vertices, unit_ball.triangles)


def half_axes(shape: Sphere) -> tuple[Array, Array]:
    """Return its center and its half axes."""
    return np.array(shape.center), shape.radius * np.eye(3)


_UNITS = {"center": "m", "radius": "m"}
ENTRY = Entry(
    Sphere, sphere, Sphere((2.0, 0.0, 1.8), 0.5), _UNITS,
    flat_faces=False, kinks="inside", convex=True, center=attrgetter("center"), surface=surface, half_axes=half_axes,
)  # fmt: skip
