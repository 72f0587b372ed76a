"""What the packed numbers of each shape are called in an FMU, and what they may be."""

from __future__ import annotations

import math

from controller.regions import (
    Box,
    Cone,
    Cylinder,
    DepthBand,
    Ellipsoid,
    HalfSpace,
    Orientation,
    Pipe,
    Prism,
    Shape,
    Sphere,
    Visibility,
)
from plant_fmu import quantities as q
from plant_fmu.quantities import Quantity

_AXES = ("x", "y", "z")
_SIZE = Quantity("m", 1e-9, 1e6)
_UNIT = Quantity("", -1.0, 1.0)
_ANGLE = Quantity("rad", 0.0, math.pi)

Number = tuple[str, Quantity]


def _vector(name: str, quantity: Quantity) -> tuple[Number, ...]:
    return tuple((f"{name}.{axis}", quantity) for axis in _AXES)


_ROTATION = tuple((f"rotation[{i},{j}]", _UNIT) for i in (1, 2, 3) for j in (1, 2, 3))
_QUATERNION = tuple((f"quaternion.e{i}", _UNIT) for i in range(4))
_TURNED = (*_vector("centre", q.LENGTH), *_ROTATION)

# in the order in which `packed` of each shape gives them
_FIXED: dict[type[Shape], tuple[Number, ...]] = {
    Sphere: (*_vector("centre", q.LENGTH), ("radius", _SIZE)),
    DepthBand: (("depth", q.LENGTH), ("tolerance", _SIZE)),
    HalfSpace: (*_vector("point", q.LENGTH), *_vector("normal", _UNIT)),
    Box: (*_TURNED, *_vector("half_size", _SIZE)),
    Cylinder: (*_vector("middle", q.LENGTH), *_vector("axis", _UNIT), ("half_length", _SIZE), ("radius", _SIZE)),
    Ellipsoid: (*_TURNED, *_vector("semi_axes", _SIZE)),
    Cone: (
        *_vector("feature", q.LENGTH),
        *_vector("axis", _UNIT),
        ("sine", _UNIT),
        ("cosine", _UNIT),
        ("range", _SIZE),
    ),
    Orientation: (*_QUATERNION, ("tolerance", _ANGLE)),
    Visibility: (
        *_vector("feature", q.LENGTH),
        *_vector("camera_axis", _UNIT),
        *_vector("camera_position", q.LENGTH),
        ("half_angle", _ANGLE),
    ),
}


def shape_numbers(shape: Shape) -> tuple[Number, ...]:
    """Return name and quantity of each number that a shape packs.

    Parameters
    ----------
    shape : Shape
        Any.

    Returns
    -------
    tuple of (str, Quantity)
        In the order of ``shape.packed()``.
    """
    if isinstance(shape, Prism):
        corners = range(1, len(shape.corners) + 1)
        of_corners = ((f"corner[{i}].{axis}", q.LENGTH) for i in corners for axis in ("north", "east"))
        return (("top", q.LENGTH), ("bottom", q.LENGTH), *of_corners)
    if isinstance(shape, Pipe):
        points = range(1, len(shape.points) + 1)
        return (("radius", _SIZE), *(number for i in points for number in _vector(f"point[{i}]", q.LENGTH)))
    return _FIXED[type(shape)]
