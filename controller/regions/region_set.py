"""Regions in a scene: which shapes, kept within or kept out of, evaluated all at once.

One sign for the whole project: g <= 0 is satisfied, g > 0 is violated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

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
from controller.regions.shape import Array, Evaluation, Shape, Vector3, require, require_finite
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
    """A shape to be kept within (``"in"``), or kept out of (``"out"``), at rest or on the move.

    A hard region must not be violated; a soft one pushes. Which laws tell them apart is said there.
    """

    name: str
    shape: Shape  # as it is at time 0
    keep: Literal["in", "out"]
    velocity: Vector3 = (0.0, 0.0, 0.0)  # m/s, NED
    gain: float = 1.0  # alpha_i of section VII, in N per unit of g
    hard: bool = True

    def __post_init__(self) -> None:
        if self.keep not in ("in", "out"):
            raise RegionError(f"region {self.name!r}: keep is {self.keep!r}, expected 'in' or 'out'")
        require_finite(f"region {self.name!r}", velocity=self.velocity)
        require(0.0 <= self.gain < math.inf, f"region {self.name!r}", "gain", self.gain, "a finite number, 0 or above")


class PackedRegions(NamedTuple):
    """Regions as arrays, which compiled code reads.

    Who moves regions writes `shifts` and `velocities`; all else stays.
    """

    kinds: NDArray[np.int64]  # (n,)
    signs: Array  # (n,) +1 kept within, -1 kept out of
    offsets: NDArray[np.int64]  # (n + 1,) into numbers
    numbers: Array  # what each shape's function reads, one behind the other
    shifts: Array  # (n, 3) m, NED: how far each has moved from where its numbers have it
    velocities: Array  # (n, 3) m/s, NED
    gains: Array  # (n,) alpha_i
    hard: NDArray[np.bool_]  # (n,)

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
        evaluate_packed(self, position, values, gradients, clearances)

    def move_to(self, time: float) -> None:
        """Put every region where its velocity has brought it at a time [s]."""
        np.multiply(self.velocities, time, out=self.shifts)


def pack(regions: Sequence[Region]) -> PackedRegions:
    """Turn regions into arrays, as they are at time 0.

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
        shifts=np.zeros((len(regions), 3)),
        velocities=np.array([region.velocity for region in regions], dtype=float).reshape(-1, 3),
        gains=np.array([region.gain for region in regions], dtype=float),
        hard=np.array([region.hard for region in regions], dtype=np.bool_),
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
    regions: PackedRegions, position: Array, values: Array, gradients: Array, clearances: Array
) -> None:
    """Do what `PackedRegions.evaluate` says, for compiled callers."""
    at = np.empty(3)
    for i in range(regions.kinds.size):
        at[:] = position - regions.shifts[i]
        numbers = regions.numbers[regions.offsets[i] : regions.offsets[i + 1]]
        g, gx, gy, gz, distance = _evaluate_shape(regions.kinds[i], at, numbers)
        values[i] = regions.signs[i] * g
        gradients[i, 0] = regions.signs[i] * gx
        gradients[i, 1] = regions.signs[i] * gy
        gradients[i, 2] = regions.signs[i] * gz
        clearances[i] = -regions.signs[i] * distance


@compiled
def clearance_at(regions: PackedRegions, i: int, position: Array) -> float:
    """Return the clearance [m] of region `i`, where it is now, at a position, shape (3,) [m, NED]."""
    numbers = regions.numbers[regions.offsets[i] : regions.offsets[i + 1]]
    clearance: float = -regions.signs[i] * _evaluate_shape(regions.kinds[i], position - regions.shifts[i], numbers)[4]
    return clearance


def clearances_at(points: Array, region: Region) -> Array:
    """Return the clearance of a region at many points, as it is at time 0.

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
    return _clearances_at(pack([region]), points)


@compiled
def _clearances_at(regions: PackedRegions, points: Array) -> Array:
    result = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        result[i] = clearance_at(regions, 0, points[i])
    return result
