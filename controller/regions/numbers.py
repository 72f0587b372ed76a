"""What the packed numbers of shapes are: their names, units and ranges."""

from __future__ import annotations

import math
from typing import NamedTuple


class Number(NamedTuple):
    """One of the numbers that a shape packs."""

    name: str
    unit: str
    minimum: float
    maximum: float


Range = tuple[str, float, float]  # unit, least and greatest

LENGTH: Range = ("m", -1e6, 1e6)
SIZE: Range = ("m", 1e-9, 1e6)
PART: Range = ("", -1.0, 1.0)  # of a unit vector, a unit quaternion or a rotation matrix
ANGLE: Range = ("rad", 0.0, math.pi)


def vector(name: str, of: Range) -> tuple[Number, ...]:
    """Return the three numbers of a vector.

    Parameters
    ----------
    name : str
        Of the vector.
    of : tuple of (str, float, float)
        Unit and range of each.

    Returns
    -------
    tuple of Number
        Along x, y and z.
    """
    return tuple(Number(f"{name}.{axis}", *of) for axis in "xyz")


TURNED = (  # a centre, and a rotation matrix row by row
    *vector("centre", LENGTH),
    *(Number(f"rotation[{i},{j}]", *PART) for i in (1, 2, 3) for j in (1, 2, 3)),
)
