"""Orientation: the vehicle's attitude near a given one, as a region of section V. Beyond the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from math import inf
from typing import ClassVar

import numpy as np

from controller.arithmetic import arctangent
from controller.linear_algebra import norm
from controller.quaternion import error, rotation_matrix
from controller.regions.entry import Entry, ViewCone
from controller.regions.numbers import ANGLE, PART, Number
from controller.regions.shape import Array, Bounds, EvaluationOfAttitude, Vector4, require, unit
from controller.stack_array import array


@dataclass(frozen=True)
class Orientation:
    """All attitudes within `tolerance` [rad] of `quaternion` (scalar first), by the shortest rotation.

    g is the angle of that rotation less the tolerance [rad]. Its derivative is set to zero where it has none: at the
    attitude itself, and half a turn away from it.

    Examples
    --------
    >>> from controller.regions import Orientation
    >>> Orientation(quaternion=(1.0, 0.0, 0.0, 0.0), tolerance=0.1).unit
    'rad'
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "rad"
    quaternion: Vector4
    tolerance: float

    def __post_init__(self) -> None:
        unit("orientation", "quaternion", self.quaternion)
        require(0.0 < self.tolerance <= math.pi, "orientation", "tolerance", self.tolerance, "in (0, pi] rad")

    def packed(self) -> tuple[float, ...]:
        """Return the unit quaternion and the tolerance."""
        return (*unit("orientation", "quaternion", self.quaternion), self.tolerance)

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (*(Number(f"quaternion.e{i}", *PART) for i in range(4)), Number("tolerance", *ANGLE))

    def bounds(self) -> Bounds:
        """Return infinite bounds: every position is in it."""
        return (-inf, -inf, -inf), (inf, inf, inf)


def orientation(p: Array, e: Array, q: Array) -> EvaluationOfAttitude:
    """Evaluate a packed `Orientation` at the attitude `e`; the position does not matter."""
    turn = error(array(q[0], q[1], q[2], q[3]), e)
    sine = norm(turn[1:])
    g = 2.0 * arctangent(sine, turn[0]) - q[4]
    if sine == 0.0 or turn[0] == 0.0:
        return g, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return g, 0.0, 0.0, 0.0, turn[1] / sine, turn[2] / sine, turn[3] / sine


def sector_of_bow(shape: Orientation) -> ViewCone:
    """Return the sector in which the direction of the bow has to be."""
    R = rotation_matrix(np.array(unit("orientation", "quaternion", shape.quaternion)))
    return ViewCone("vehicle", (0.0, 0.0, 0.0), tuple(R[:, 0].tolist()), shape.tolerance)


_UNITS = {"quaternion": "", "tolerance": "rad"}
ENTRY = Entry(
    Orientation, orientation, Orientation((0.9, 0.1, -0.3, 0.2), 0.8), _UNITS,
    flat_faces=False, kinks="everywhere", convex=False, center=None, cone=sector_of_bow,
)  # fmt: skip
