"""Torus: a ring, such as a gate or a tire, to be swum through or kept clear of."""

from __future__ import annotations

import math
from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar

import numpy as np

from controller.regions.entry import Entry
from controller.regions.numbers import LENGTH, PART, SIZE, Number, vector
from controller.regions.shape import Array, Bounds, Evaluation, Vector3, centered_bounds, require, require_finite, unit
from controller.regions.triangle_mesh import Mesh, closed_grid


@dataclass(frozen=True)
class Torus:
    """All points within `tube` [m] of the circle of `radius` [m] about `center` [m, NED], square to `axis`."""

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    center: Vector3
    axis: Vector3
    radius: float
    tube: float

    def __post_init__(self) -> None:
        require_finite("torus", center=self.center, radius=self.radius, tube=self.tube)
        unit("torus", "axis", self.axis)
        require(0.0 < self.tube < self.radius, "torus", "tube", self.tube, "above 0 m and below radius")

    def packed(self) -> tuple[float, ...]:
        """Return center, unit axis, radius and tube."""
        return (*self.center, *unit("torus", "axis", self.axis), self.radius, self.tube)

    def numbers(self) -> tuple[Number, ...]:
        """Return what `packed` gives, by name and unit."""
        return (*vector("center", LENGTH), *vector("axis", PART), Number("radius", *SIZE), Number("tube", *SIZE))

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about it."""
        axis = unit("torus", "axis", self.axis)
        return centered_bounds(self.center, [self.radius * math.sqrt(max(0.0, 1.0 - x * x)) + self.tube for x in axis])


def torus(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Torus` at the position `p`."""
    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    along = q[3] * x + q[4] * y + q[5] * z
    x, y, z = x - along * q[3], y - along * q[4], z - along * q[5]  # in the plane of the ring
    out = math.sqrt(x * x + y * y + z * z)
    off = out - q[6]
    apart = math.sqrt(off * off + along * along)  # from the circle
    scale = 1.0 / apart if apart > 0.0 else 0.0
    of_out, of_along = off * scale, along * scale
    inward = of_out / out if out > 0.0 else 0.0
    g = apart - q[7]
    return g, inward * x + of_along * q[3], inward * y + of_along * q[4], inward * z + of_along * q[5], g


def surface(shape: Torus, limits: Bounds) -> Mesh:
    """Return circles of the tube, all around the ring."""
    axis = np.array(unit("torus", "axis", shape.axis))
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    turn, around = np.meshgrid(2.0 * np.pi * np.arange(32) / 32, 2.0 * np.pi * np.arange(12) / 12, indexing="ij")
    out = np.cos(turn)[..., None] * u + np.sin(turn)[..., None] * np.cross(axis, u)
    away = shape.radius + shape.tube * np.cos(around)[..., None]
    return closed_grid(np.array(shape.center) + away * out + shape.tube * np.sin(around)[..., None] * axis)


EXAMPLE = Torus((1.0, 0.0, 2.0), (1.0, 0.0, 0.0), 1.5, 0.2)
ENTRY = Entry(
    Torus, torus, EXAMPLE, {"center": "m", "axis": "", "radius": "m", "tube": "m"},
    flat_faces=False, kinks="everywhere", convex=False, center=attrgetter("center"), surface=surface,
)  # fmt: skip
