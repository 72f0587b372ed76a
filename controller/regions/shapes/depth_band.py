"""Depth band: (47), (48) kept within, (52) kept out of."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import ClassVar

import numpy as np

from controller.regions.entry import Entry
from controller.regions.numbers import LENGTH, SIZE, Number
from controller.regions.shape import Array, Bounds, Evaluation, require, require_finite
from controller.regions.triangle_mesh import Mesh, patches


@dataclass(frozen=True)
class DepthBand:
    """All depths within `tolerance` [m] of `depth` [m]; g = (z - z_o)^2 - r^2 [m2].

    Examples
    --------
    >>> from controller.regions import DepthBand
    >>> DepthBand(depth=2.0, tolerance=0.5).bounds()
    ((-inf, -inf, 1.5), (inf, inf, 2.5))
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m2"
    depth: float  # m
    tolerance: float

    def __post_init__(self) -> None:
        require_finite("depth_band", depth=self.depth, tolerance=self.tolerance)
        require(self.tolerance > 0.0, "depth_band", "tolerance", self.tolerance, "above 0 m")

    def packed(self) -> tuple[float, ...]:
        """Return depth and tolerance."""
        return (self.depth, self.tolerance)

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (Number("depth", *LENGTH), Number("tolerance", *SIZE))

    def bounds(self) -> Bounds:
        """Return the depths, unbounded to the sides."""
        return (-inf, -inf, self.depth - self.tolerance), (inf, inf, self.depth + self.tolerance)


def band_about(z: float, tolerance: float) -> Evaluation:
    """Evaluate a band of a tolerance at a depth `z`, relative to its middle [m]."""
    return z * z - tolerance * tolerance, 0.0, 0.0, 2.0 * z, abs(z) - tolerance


def depth_band(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `DepthBand` at the position `p`."""
    return band_about(p[2] - q[0], q[1])


def surface(shape: DepthBand, limits: Bounds) -> Mesh:
    """Return a patch of each of its two planes."""
    return patches(planes(shape), limits)


def planes(shape: DepthBand) -> list[tuple[Array, Array]]:
    """Return the upper plane, then the lower one."""
    down = np.array([0.0, 0.0, 1.0])
    return [((shape.depth + side * shape.tolerance) * down, side * down) for side in (-1.0, 1.0)]


_UNITS = {"depth": "m", "tolerance": "m"}
ENTRY = Entry(
    DepthBand, depth_band, DepthBand(2.5, 1.8), _UNITS,
    flat_faces=True, kinks="everywhere", convex=True, center=None, surface=surface, planes=planes,
)  # fmt: skip
