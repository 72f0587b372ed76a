"""Visibility: the poses from which a camera of the vehicle sees a feature, of section I; without an equation there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from math import inf
from typing import ClassVar

from controller.arithmetic import arctangent
from controller.linear_algebra import cross, norm
from controller.quaternion import rotation_matrix
from controller.regions.entry import Entry, ViewCone
from controller.regions.numbers import ANGLE, LENGTH, PART, Number, vector
from controller.regions.shape import Array, Bounds, EvaluationOfAttitude, Vector3, require, require_finite, unit
from controller.stack_array import array


@dataclass(frozen=True)
class Visibility:
    """All poses that have a `feature` [m, NED] within `half_angle` [rad] of the axis of a camera.

    `camera_axis` and `camera_position` [m] are in the body frame. g is the angle between axis and line of sight, less
    the half angle [rad]. The camera's range is a region of its own, such as a sphere or a `Cone` about the feature.
    By position, g changes with one over the distance: a feature closer than some tenths of a meter makes g change too
    fast to follow. A feature in the camera itself counts as behind it.

    Examples
    --------
    >>> from controller.regions import Visibility
    >>> Visibility(feature=(3.0, 0.0, 2.0), camera_axis=(1.0, 0.0, 0.0), half_angle=0.5).unit
    'rad'
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "rad"
    feature: Vector3
    camera_axis: Vector3
    half_angle: float  # rad
    camera_position: Vector3 = (0.0, 0.0, 0.0)  # m, body axes

    def __post_init__(self) -> None:
        require_finite("visibility", feature=self.feature, camera_position=self.camera_position)
        unit("visibility", "camera_axis", self.camera_axis)
        require(0.0 < self.half_angle < math.pi, "visibility", "half_angle", self.half_angle, "in (0, pi) rad")

    def packed(self) -> tuple[float, ...]:
        """Return feature, unit axis, position of the camera and half angle."""
        return (
            *self.feature,
            *unit("visibility", "camera_axis", self.camera_axis),
            *self.camera_position,
            self.half_angle,
        )

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (
            *vector("feature", LENGTH),
            *vector("camera_axis", PART),
            *vector("camera_position", LENGTH),
            Number("half_angle", *ANGLE),
        )

    def bounds(self) -> Bounds:
        """Return infinite bounds: from every place the feature is seen at some attitude."""
        return (-inf, -inf, -inf), (inf, inf, inf)


def visibility(p: Array, e: Array, q: Array) -> EvaluationOfAttitude:
    """Evaluate a packed `Visibility` at the position `p` and the attitude `e`."""
    # the feature in the body frame: u from the origin, b from the camera
    R, axis = rotation_matrix(e), array(q[3], q[4], q[5])
    u = R.T @ (array(q[0], q[1], q[2]) - p)
    b = u - array(q[6], q[7], q[8])
    square = b @ b
    if square == 0.0:
        return math.pi - q[9], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0

    # the angle to the axis a, and its derivative by b: ((a . b) b / |b|^2 - a) / |a x b|
    along, aside = float(axis @ b), norm(cross(axis, b))
    g = arctangent(aside, along) - q[9]
    if aside == 0.0:
        return g, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    s = (along / square * b - axis) / aside

    # db = -R^T dp + u x theta
    by_position, by_turn = -(R @ s), cross(s, u)
    return g, by_position[0], by_position[1], by_position[2], by_turn[0], by_turn[1], by_turn[2]


def field_of_view(shape: Visibility) -> ViewCone:
    """Return the field of view of the camera."""
    axis = unit("visibility", "camera_axis", shape.camera_axis)
    return ViewCone("body", shape.camera_position, (axis[0], axis[1], axis[2]), shape.half_angle, shape.feature)


_UNITS = {"feature": "m", "camera_axis": "", "half_angle": "rad", "camera_position": "m"}
_EXAMPLE = Visibility((1.0, 2.0, 3.0), (1.0, 0.2, 0.5), 0.9, (0.3, -0.1, 0.2))
ENTRY = Entry(
    Visibility, visibility, _EXAMPLE, _UNITS,
    flat_faces=False, kinks="everywhere", convex=False, center=None, cone=field_of_view,
)  # fmt: skip
