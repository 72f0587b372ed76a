"""Cylinder between two points. Beyond the paper, as a region of section V."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from controller.regions.entry import Entry
from controller.regions.geometry import product_distance
from controller.regions.numbers import LENGTH, PART, SIZE, Number, vector
from controller.regions.shape import (
    UP_TO_ROUNDING,
    Array,
    Bounds,
    Evaluation,
    Vector3,
    centered_bounds,
    join,
    require,
    require_finite,
    unit,
)
from controller.regions.triangle_mesh import Mesh, circle, frame, lathe


@dataclass(frozen=True)
class Cylinder:
    """All points within `radius` [m] of the axis from `start` to `end` [m, NED]; g is the signed distance [m].

    Examples
    --------
    >>> from controller.regions import Cylinder
    >>> Cylinder(start=(0.0, 0.0, 0.0), end=(0.0, 0.0, 8.0), radius=0.5).bounds()
    ((-0.5, -0.5, 0.0), (0.5, 0.5, 8.0))
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    start: Vector3
    end: Vector3
    radius: float  # m

    def __post_init__(self) -> None:
        require_finite("cylinder", start=self.start, end=self.end, radius=self.radius)
        require(self.radius > 0.0, "cylinder", "radius", self.radius, "above 0 m")
        apart = math.dist(self.start, self.end) > UP_TO_ROUNDING
        require(apart, "cylinder", "end", self.end, "a point other than start")

    def packed(self) -> tuple[float, ...]:
        """Return the middle, the unit axis, half the length and the radius."""
        between = tuple(b - a for a, b in zip(self.start, self.end, strict=True))
        return (*middle(self), *unit("cylinder", "axis", between), math.hypot(*between) / 2.0, self.radius)

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (*vector("middle", LENGTH), *vector("axis", PART), Number("half_length", *SIZE), Number("radius", *SIZE))

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about it."""
        axis = unit("cylinder", "axis", tuple(b - a for a, b in zip(self.start, self.end, strict=True)))
        discs = [
            centered_bounds(p, [self.radius * math.sqrt(1.0 - x * x) for x in axis]) for p in (self.start, self.end)
        ]
        return join(discs)


def cylinder(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Cylinder` at the position `p`."""
    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    along = q[3] * x + q[4] * y + q[5] * z
    x, y, z = x - along * q[3], y - along * q[4], z - along * q[5]
    radius = math.sqrt(x * x + y * y + z * z)
    g, of_radius, of_along = product_distance(radius - q[7], abs(along) - q[6])
    outward = of_radius / radius if radius > 0.0 else 0.0
    axial = of_along if along >= 0.0 else -of_along
    return g, outward * x + axial * q[3], outward * y + axial * q[4], outward * z + axial * q[5], g


def middle(shape: Cylinder) -> Vector3:
    """Return the middle of its axis [m, NED]."""
    a, b = shape.start, shape.end
    return (a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0, (a[2] + b[2]) / 2.0


def surface(shape: Cylinder, limits: Bounds) -> Mesh:
    """Return its side and its two ends."""
    start, end = np.array(shape.start), np.array(shape.end)
    _, *across = frame(end - start)
    rim = shape.radius * circle(*across)
    return lathe([start + rim, end + rim], start, end)


_UNITS = {"start": "m", "end": "m", "radius": "m"}
ENTRY = Entry(
    Cylinder, cylinder, Cylinder((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), 0.7), _UNITS,
    flat_faces=False, kinks="everywhere", convex=True, center=middle, surface=surface,
)  # fmt: skip
