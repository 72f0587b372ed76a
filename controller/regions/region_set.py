"""Regions in a scene: which shapes, kept within or kept out of, evaluated all at once.

One sign for the whole project: g <= 0 is satisfied, g > 0 is violated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from controller.compiled import compiled
from controller.errors import RegionError
from controller.regions.box import Box, box
from controller.regions.cone import Cone, cone
from controller.regions.cylinder import Cylinder, cylinder
from controller.regions.depth_band import DepthBand, depth_band
from controller.regions.ellipsoid import Ellipsoid, ellipsoid
from controller.regions.half_space import HalfSpace, half_space
from controller.regions.pipe import Pipe, pipe
from controller.regions.prism import Prism, prism
from controller.regions.shape import Array, Evaluation, Shape
from controller.regions.sphere import Sphere, sphere

SHAPES: dict[str, type[Shape]] = {
    "sphere": Sphere,
    "depth_band": DepthBand,
    "half_space": HalfSpace,
    "box": Box,
    "cylinder": Cylinder,
    "ellipsoid": Ellipsoid,
    "prism": Prism,
    "pipe": Pipe,
    "cone": Cone,
}


@dataclass(frozen=True)
class Region:
    """A shape to be kept within (``"in"``), or kept out of (``"out"``)."""

    name: str
    shape: Shape
    keep: Literal["in", "out"]

    def __post_init__(self) -> None:
        if self.keep not in ("in", "out"):
            raise RegionError(f"region {self.name!r}: keep is {self.keep!r}, expected 'in' or 'out'")


@dataclass(frozen=True, eq=False)
class PackedRegions:
    """Regions as arrays, which compiled code reads."""

    kinds: NDArray[np.int64]  # (n,)
    signs: Array  # (n,) +1 kept within, -1 kept out of
    offsets: NDArray[np.int64]  # (n + 1,) into numbers
    numbers: Array  # what each shape's function reads, one behind the other

    def evaluate(self, position: Array, values: Array, gradients: Array, clearances: Array) -> None:
        """Evaluate every region at a position, into the given arrays.

        Parameters
        ----------
        position : ndarray, shape (3,)
            [m, NED].
        values : ndarray, shape (n,)
            Receives g_i, at most 0 where satisfied, in the unit of the shape.
        gradients : ndarray, shape (n, 3)
            Receives dg_i/dp.
        clearances : ndarray, shape (n,)
            Receives the distance to the surface [m]: positive where satisfied, negative where violated.
        """
        evaluate_packed(position, self.kinds, self.signs, self.offsets, self.numbers, values, gradients, clearances)


def pack(regions: Sequence[Region]) -> PackedRegions:
    """Turn regions into arrays.

    Parameters
    ----------
    regions : sequence of Region
        Any number, none included.

    Returns
    -------
    PackedRegions
        In the same order.
    """
    packed = [region.shape.packed() for region in regions]
    return PackedRegions(
        kinds=np.array([region.shape.kind for region in regions], dtype=np.int64),
        signs=np.array([1.0 if region.keep == "in" else -1.0 for region in regions]),
        offsets=np.cumsum([0, *(len(numbers) for numbers in packed)], dtype=np.int64),
        numbers=np.array([x for numbers in packed for x in numbers], dtype=float),
    )


@compiled
def _evaluate_shape(kind: int, p: Array, q: Array) -> Evaluation:
    if kind == 0:
        return sphere(p, q)
    if kind == 1:
        return depth_band(p, q)
    if kind == 2:
        return half_space(p, q)
    if kind == 3:
        return box(p, q)
    if kind == 4:
        return cylinder(p, q)
    if kind == 5:
        return ellipsoid(p, q)
    if kind == 6:
        return prism(p, q)
    if kind == 7:
        return pipe(p, q)
    return cone(p, q)


@compiled
def evaluate_packed(
    position: Array,
    kinds: NDArray[np.int64],
    signs: Array,
    offsets: NDArray[np.int64],
    numbers: Array,
    values: Array,
    gradients: Array,
    clearances: Array,
) -> None:
    """Do what `PackedRegions.evaluate` says, for compiled callers: `kinds` to `numbers` are its fields."""
    for i in range(kinds.size):
        g, gx, gy, gz, distance = _evaluate_shape(kinds[i], position, numbers[offsets[i] : offsets[i + 1]])
        values[i] = signs[i] * g
        gradients[i, 0] = signs[i] * gx
        gradients[i, 1] = signs[i] * gy
        gradients[i, 2] = signs[i] * gz
        clearances[i] = -signs[i] * distance


def clearances_at(points: Array, region: Region) -> Array:
    """Return the clearance of a region at many points.

    Parameters
    ----------
    points : ndarray, shape (m, 3)
        [m, NED].
    region : Region
        Any.

    Returns
    -------
    ndarray, shape (m,)
        As `PackedRegions.evaluate` gives it [m].
    """
    packed = pack([region])
    return _clearances_at(points, packed.kinds[0], packed.signs[0], packed.numbers)


@compiled
def _clearances_at(points: Array, kind: int, sign: float, numbers: Array) -> Array:
    result = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        result[i] = -sign * _evaluate_shape(kind, points[i], numbers)[4]
    return result
