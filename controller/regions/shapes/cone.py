"""Cone of visibility: the places from which a feature can be seen, of section I; without an equation in the paper."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from controller.arithmetic import hypotenuse
from controller.regions.entry import Entry
from controller.regions.geometry import clamp
from controller.regions.numbers import LENGTH, PART, SIZE, Number, vector
from controller.regions.shape import Array, Bounds, Evaluation, Vector3, ball_bounds, require, require_finite, unit
from controller.regions.triangle_mesh import Mesh, sector


@dataclass(frozen=True)
class Cone:
    """All points within `range` [m] of a `feature` [m, NED] and within `half_angle` [rad] of the `axis` it faces.

    The axis points from the feature into the water. g is the signed distance [m].

    Examples
    --------
    >>> from controller.regions import Cone
    >>> Cone(feature=(0.0, 0.0, 5.0), axis=(1.0, 0.0, 0.0), half_angle=0.5, range=4.0).unit
    'm'
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    feature: Vector3
    axis: Vector3
    half_angle: float  # rad
    range: float  # m

    def __post_init__(self) -> None:
        require_finite("cone", feature=self.feature, half_angle=self.half_angle, range=self.range)
        unit("cone", "axis", self.axis)
        require(0.0 < self.half_angle <= math.pi / 2.0, "cone", "half_angle", self.half_angle, "in (0, pi/2] rad")
        require(self.range > 0.0, "cone", "range", self.range, "above 0 m")

    def packed(self) -> tuple[float, ...]:
        """Return feature, unit axis, sine and cosine of the half angle, and range."""
        axis = unit("cone", "axis", self.axis)
        return (*self.feature, *axis, math.sin(self.half_angle), math.cos(self.half_angle), self.range)

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (
            *vector("feature", LENGTH),
            *vector("axis", PART),
            Number("sine", *PART),
            Number("cosine", *PART),
            Number("range", *SIZE),
        )

    def bounds(self) -> Bounds:
        """Return the corners of the cube about its range, which hold it."""
        return ball_bounds(self.feature, self.range)


def cone(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Cone` at the position `p`."""
    # in the half-plane through the axis: `along` it, and `aside` from it
    x, y, z = p[0] - q[0], p[1] - q[1], p[2] - q[2]
    along = q[3] * x + q[4] * y + q[5] * z
    x, y, z = x - along * q[3], y - along * q[4], z - along * q[5]
    aside = math.sqrt(x * x + y * y + z * z)
    sine, cosine, reach = q[6], q[7], q[8]

    from_feature = hypotenuse(along, aside)
    excess = from_feature - reach
    # the nearest point of the flank
    on_flank = clamp(aside * sine + along * cosine, 0.0, reach)
    to_aside, to_along = aside - on_flank * sine, along - on_flank * cosine
    flank = hypotenuse(to_aside, to_along)
    outside = 1.0 if cosine * aside - sine * along >= 0.0 else -1.0

    if excess > outside * flank:
        g = excess
        of_aside, of_along = aside / from_feature, along / from_feature
    else:
        g = outside * flank
        if flank > 0.0:
            of_aside, of_along = outside * to_aside / flank, outside * to_along / flank
        else:
            of_aside, of_along = cosine, -sine
    outward = of_aside / aside if aside > 0.0 else 0.0
    return g, outward * x + of_along * q[3], outward * y + of_along * q[4], outward * z + of_along * q[5], g


def surface(shape: Cone, limits: Bounds) -> Mesh:
    """Return its side and its round end."""
    return sector(shape.feature, shape.axis, shape.half_angle, shape.range)


_UNITS = {"feature": "m", "axis": "", "half_angle": "rad", "range": "m"}
ENTRY = Entry(
    Cone, cone, Cone((1.0, 1.0, 1.0), (-1.0, 0.0, 0.3), 0.6, 3.0), _UNITS,
    flat_faces=False, kinks="everywhere", convex=True, center=None, surface=surface,
)  # fmt: skip
