"""Ellipsoid with any orientation. Beyond the paper, as a region of section V."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar

import numpy as np

from controller.arithmetic import length3, square
from controller.quaternion import rotation_matrix
from controller.regions.entry import Entry
from controller.regions.geometry import to_local, to_world
from controller.regions.numbers import SIZE, TURNED, Number, vector
from controller.regions.shape import (
    Array,
    Bounds,
    Evaluation,
    Vector3,
    Vector4,
    centered_bounds,
    require,
    require_finite,
    unit,
    with_former_spelling,
)
from controller.regions.triangle_mesh import Mesh, ball, place_points

_STEPS = 200  # maximum number of steps, more than the root below ever needs


@with_former_spelling
@dataclass(frozen=True)
class Ellipsoid:
    """All points of an ellipsoid about `center` [m, NED]; g = sum (x_i / a_i)^2 - 1 [-].

    `quaternion` (scalar first) turns the axes, of half lengths `semi_axes` [m], into the world.

    Examples
    --------
    >>> from controller.regions import Ellipsoid
    >>> Ellipsoid(center=(0.0, 0.0, 5.0), semi_axes=(2.0, 1.0, 1.0)).bounds()
    ((-2.0, -1.0, 4.0), (2.0, 1.0, 6.0))
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = ""
    center: Vector3
    semi_axes: Vector3
    quaternion: Vector4 = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require_finite("ellipsoid", center=self.center, semi_axes=self.semi_axes)
        require(min(self.semi_axes) > 0.0, "ellipsoid", "semi_axes", self.semi_axes, "three numbers above 0 m")
        unit("ellipsoid", "quaternion", self.quaternion)

    def packed(self) -> tuple[float, ...]:
        """Return center, rotation matrix and half axes."""
        R = rotation_matrix(np.array(unit("ellipsoid", "quaternion", self.quaternion)))
        return (*self.center, *R.ravel().tolist(), *self.semi_axes)

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (*TURNED, *vector("semi_axes", SIZE))

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about it."""
        R = rotation_matrix(np.array(unit("ellipsoid", "quaternion", self.quaternion)))
        reach = np.linalg.norm(R * np.array(self.semi_axes), axis=1)
        return centered_bounds(self.center, reach.tolist())


def ellipsoid(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Ellipsoid` at the position `p`."""
    x, y, z = to_local(p, q, 0)
    a, b, c = q[12], q[13], q[14]
    g = square(x / a) + square(y / b) + square(z / c) - 1.0
    wx, wy, wz = to_world(q, 3, 2.0 * x / (a * a), 2.0 * y / (b * b), 2.0 * z / (c * c))
    distance = _surface_distance(abs(x), abs(y), abs(z), a, b, c)
    return g, wx, wy, wz, distance if g > 0.0 else -distance


def _surface_distance(x: float, y: float, z: float, a: float, b: float, c: float) -> float:
    """Return the distance from a point of the first octant to the surface."""
    # The nearest point is x_i a_i^2 / (t + a_i^2), with t the root of sum (a_i x_i / (t + a_i^2))^2 = 1 above -min
    # a_i^2 (Eberly). With s = t + min a_i^2 as unknown, nothing cancels near the center. The sum falls and is convex:
    # Newton's method from a point left of the root only grows towards it.
    least = square(min(a, b, c))
    da, db, dc = a * a - least, b * b - least, c * c - least
    # a point in a plane of symmetry is moved out of it by less than rounding
    x, y, z = max(x, 1e-14 * a), max(y, 1e-14 * b), max(z, 1e-14 * c)
    s = max(a * x - da, b * y - db, c * z - dc)
    for _ in range(_STEPS):
        u, v, w = a * x / (s + da), b * y / (s + db), c * z / (s + dc)
        value = u * u + v * v + w * w - 1.0
        slope = -2.0 * (u * u / (s + da) + v * v / (s + db) + w * w / (s + dc))
        new = s - value / slope
        if not new > s:
            break
        s = new
    nearest_x, nearest_y, nearest_z = x * a * a / (s + da), y * b * b / (s + db), z * c * c / (s + dc)
    return length3(x - nearest_x, y - nearest_y, z - nearest_z)


def surface(shape: Ellipsoid, limits: Bounds) -> Mesh:
    """Return a ball, scaled along the axes."""
    unit_ball = ball()
    scaled = unit_ball.vertices * np.array(shape.semi_axes)
    return Mesh(place_points(scaled, shape.center, shape.quaternion), unit_ball.triangles)


def half_axes(shape: Ellipsoid) -> tuple[Array, Array]:
    """Return its center and its half axes."""
    center = np.array(shape.center)
    return center, place_points(np.diag(shape.semi_axes), shape.center, shape.quaternion) - center


_UNITS = {"center": "m", "semi_axes": "m", "quaternion": ""}
ENTRY = Entry(
    Ellipsoid, ellipsoid, Ellipsoid((1.0, 0.0, 1.0), (2.0, 1.0, 0.5), (0.9, 0.1, -0.3, 0.2)), _UNITS,
    flat_faces=False, kinks="inside", convex=True, center=attrgetter("center"), surface=surface, half_axes=half_axes,
)  # fmt: skip
