"""Half-space: one side of a plane. Beyond the paper, as a region of section V."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import ClassVar

import numpy as np

from controller.regions.entry import Entry
from controller.regions.numbers import LENGTH, PART, Number, vector
from controller.regions.shape import Array, Bounds, Evaluation, Vector3, require_finite, unit
from controller.regions.triangle_mesh import Mesh, patches


@dataclass(frozen=True)
class HalfSpace:
    """All points behind the plane through `point` [m, NED] that `normal` points away from; g is the distance [m].

    Examples
    --------
    >>> from controller.regions import HalfSpace
    >>> HalfSpace(point=(0.0, 4.0, 0.0), normal=(0.0, -1.0, 0.0)).packed()
    (0.0, 4.0, 0.0, 0.0, -1.0, 0.0)
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    point: Vector3
    normal: Vector3

    def __post_init__(self) -> None:
        require_finite("half_space", point=self.point)
        unit("half_space", "normal", self.normal)

    def packed(self) -> tuple[float, ...]:
        """Return point and unit normal."""
        return (*self.point, *unit("half_space", "normal", self.normal))

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (*vector("point", LENGTH), *vector("normal", PART))

    def bounds(self) -> Bounds:
        """Return infinite bounds: it is unbounded along every axis."""
        return (-inf, -inf, -inf), (inf, inf, inf)


def half_space(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `HalfSpace` at the position `p`."""
    g = q[3] * (p[0] - q[0]) + q[4] * (p[1] - q[1]) + q[5] * (p[2] - q[2])
    return g, q[3], q[4], q[5], g


def surface(shape: HalfSpace, limits: Bounds) -> Mesh:
    """Return a patch of its plane."""
    return patches(planes(shape), limits)


def planes(shape: HalfSpace) -> list[tuple[Array, Array]]:
    """Return its plane."""
    normal = np.array(shape.normal, dtype=float)
    return [(np.array(shape.point, dtype=float), normal / np.linalg.norm(normal))]


_UNITS = {"point": "m", "normal": ""}
ENTRY = Entry(
    HalfSpace, half_space, HalfSpace((0.0, 0.0, 1.0), (1.0, 1.0, 0.2)), _UNITS,
    flat_faces=True, kinks="nowhere", convex=True, center=None, surface=surface, planes=planes,
)  # fmt: skip
