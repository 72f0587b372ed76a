"""The protocol of a region's shape, and the signature of its compiled function."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Sequence
from operator import attrgetter
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from controller.errors import RegionError
from controller.regions.numbers import Number

Array = NDArray[np.float64]
Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
Vector4 = tuple[float, float, float, float]

# lowest and highest corner of an upright box [m, NED]
Bounds = tuple[Vector3, Vector3]

S = TypeVar("S")

# value of g, its gradient (3 numbers), signed distance [m]
Evaluation = tuple[float, float, float, float, float]

# value of g [rad], its gradient by position (3 numbers, world), by rotation about the body's axes (3 numbers)
EvaluationOfAttitude = tuple[float, float, float, float, float, float, float]

UP_TO_ROUNDING = 1e-12  # length below which a vector has no direction
GREATEST = 1e6  # m, maximum coordinate and length; squares and their sums stay far from overflow


class Shape(Protocol):
    """A closed set of positions, given as g(p) <= 0, or of poses, given as g(p, e) <= 0."""

    # The compiled function of a shape takes a position, shape (3,), and the packed numbers, and returns g, its
    # gradient, and the signed distance [m] to the surface, negative inside. The unit of g is the shape's own. That of a
    # shape that depends on attitude takes the quaternion between the two, and returns g [rad] and its derivatives by
    # position and by rotation; -g is its clearance.

    kind: ClassVar[int]  # number of the shape in packed arrays; assigned when the shapes are loaded
    unit: ClassVar[str]  # unit of g

    def packed(self) -> tuple[float, ...]:
        """Return the numbers that the compiled function reads."""
        ...

    def numbers(self) -> tuple[Number, ...]:
        """Return name, unit and range of each number of `packed`."""
        ...

    def bounds(self) -> Bounds:
        """Return the corners of an upright box about the shape; infinite where the shape is unbounded."""
        ...


def with_former_spelling(shape: type[S]) -> type[S]:
    """Accept `centre`, the former name of a shape's center, as an argument of its class and as an attribute."""
    initialize = shape.__init__

    @functools.wraps(initialize)
    def __init__(self: S, *args: Any, **values: Any) -> None:  # noqa: N807
        if "centre" in values:
            if "center" in values:
                raise RegionError("pass either center or centre; dataclasses.replace takes center")
            warnings.warn("centre is now center", DeprecationWarning, stacklevel=2)
            values["center"] = values.pop("centre")
        initialize(self, *args, **values)

    shape.__init__ = __init__  # type: ignore[assignment,method-assign]
    shape.centre = property(attrgetter("center"))  # type: ignore[attr-defined]
    return shape


def require(good: bool, shape: str, key: str, received: object, expected: str) -> None:
    """Raise an error that names the key, unless the condition holds."""
    if not good:
        hint = ""
        if expected.endswith(" rad") and isinstance(received, int | float) and 0.0 < received < math.inf:
            hint = f"; {received:g} degrees are {math.radians(received):.4g} rad"
        raise RegionError(f"{shape}: {key} is {received}, expected {expected}{hint}")


def require_finite(shape: str, **values: float | tuple[float, ...]) -> None:
    """Require that all values are finite and not too great; name the first that is not."""
    for key, value in values.items():
        numbers = value if isinstance(value, tuple) else (value,)
        require(all(abs(x) <= GREATEST for x in numbers), shape, key, value, f"finite numbers up to {GREATEST:g}")


def unit(shape: str, key: str, vector: tuple[float, ...]) -> tuple[float, ...]:
    """Return the vector scaled to unit length."""
    require_finite(shape, **{key: vector})
    length = math.hypot(*vector)
    require(length > UP_TO_ROUNDING, shape, key, vector, "a direction")
    return tuple(x / length for x in vector)


def centered_bounds(center: Vector3, reach: Sequence[float]) -> Bounds:
    """Return the bounds about a center with a reach along each axis; center [m, NED], reach [m]."""
    (x, y, z), (dx, dy, dz) = center, reach
    return (x - dx, y - dy, z - dz), (x + dx, y + dy, z + dz)


def ball_bounds(center: Vector3, radius: float) -> Bounds:
    """Return the bounds of a ball; center [m, NED], radius [m]."""
    return centered_bounds(center, (radius, radius, radius))


def join(parts: Sequence[Bounds]) -> Bounds:
    """Return the bounds of several parts together."""
    low = tuple(min(part[0][i] for part in parts) for i in range(3))
    high = tuple(max(part[1][i] for part in parts) for i in range(3))
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])
