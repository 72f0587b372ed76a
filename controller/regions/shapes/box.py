"""Box with any orientation: the cuboid of section V.B, without an equation in the paper."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from typing import ClassVar

import numpy as np

from controller.quaternion import rotation_matrix
from controller.regions.entry import Entry
from controller.regions.geometry import product_distance, to_local, to_world
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
from controller.regions.triangle_mesh import Mesh, place_points


@with_former_spelling
@dataclass(frozen=True)
class Box:
    """All points of a cuboid of full `size` [m] about `center` [m, NED]; g is the signed distance [m].

    `quaternion` (scalar first) turns the box's axes into the world.

    Examples
    --------
    >>> from controller.regions import Box
    >>> Box(center=(0.0, 0.0, 5.0), size=(4.0, 2.0, 1.0)).bounds()
    ((-2.0, -1.0, 4.5), (2.0, 1.0, 5.5))
    """

    kind: ClassVar[int]
    unit: ClassVar[str] = "m"
    center: Vector3
    size: Vector3
    quaternion: Vector4 = (1.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require_finite("box", center=self.center, size=self.size)
        require(min(self.size) > 0.0, "box", "size", self.size, "three numbers above 0 m")
        unit("box", "quaternion", self.quaternion)

    def packed(self) -> tuple[float, ...]:
        """Return center, rotation matrix and half sizes."""
        R = rotation_matrix(np.array(unit("box", "quaternion", self.quaternion)))
        return (*self.center, *R.ravel().tolist(), *(s / 2.0 for s in self.size))

    def numbers(self) -> tuple[Number, ...]:
        """Return name and unit of each number of `packed`."""
        return (*TURNED, *vector("half_size", SIZE))

    def bounds(self) -> Bounds:
        """Return the corners of the upright box about it."""
        R = rotation_matrix(np.array(unit("box", "quaternion", self.quaternion)))
        reach = np.abs(R) @ np.array(self.size) / 2.0
        return centered_bounds(self.center, reach.tolist())


def box(p: Array, q: Array) -> Evaluation:
    """Evaluate a packed `Box` at the position `p`."""
    x, y, z = to_local(p, q, 0)
    flat, of_x, of_y = product_distance(abs(x) - q[12], abs(y) - q[13])
    g, of_flat, of_z = product_distance(flat, abs(z) - q[14])
    gx = of_flat * of_x if x >= 0.0 else -of_flat * of_x
    gy = of_flat * of_y if y >= 0.0 else -of_flat * of_y
    gz = of_z if z >= 0.0 else -of_z
    wx, wy, wz = to_world(q, 3, gx, gy, gz)
    return g, wx, wy, wz, g


def surface(shape: Box, limits: Bounds) -> Mesh:
    """Return its six faces."""
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    return Mesh(place_points(corners * np.array(shape.size), shape.center, shape.quaternion), triangles)


_UNITS = {"center": "m", "size": "m", "quaternion": ""}
ENTRY = Entry(
    Box, box, Box((1.0, 1.0, 1.0), (2.0, 3.0, 1.0), (0.9, 0.1, -0.3, 0.2)), _UNITS,
    flat_faces=True, kinks="everywhere", convex=True, center=attrgetter("center"), surface=surface,
)  # fmt: skip
