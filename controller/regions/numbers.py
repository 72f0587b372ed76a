"""Names, units and ranges of the packed numbers of shapes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple


class Number(NamedTuple):
    """One of the numbers that a shape packs."""

    name: str
    unit: str
    minimum: float
    maximum: float
    above: str = ""  # name of the number that it must exceed


Range = tuple[str, float, float]  # unit, minimum and maximum

LENGTH: Range = ("m", -1e6, 1e6)
SIZE: Range = ("m", 1e-9, 1e6)
PART: Range = ("", -1.0, 1.0)  # component of a unit vector, a unit quaternion or a rotation matrix
ANGLE: Range = ("rad", 0.0, math.pi)


def vector(name: str, of: Range) -> tuple[Number, ...]:
    """Return the three numbers of a vector."""
    return tuple(Number(f"{name}.{axis}", *of) for axis in "xyz")


TURNED = (  # a center, and a rotation matrix row by row
    *vector("center", LENGTH),
    *(Number(f"rotation[{i},{j}]", *PART) for i in (1, 2, 3) for j in (1, 2, 3)),
)


def constraints(numbers: Sequence[Number]) -> Iterator[tuple[str, int, int, str]]:
    """Yield the constraints among the numbers of a shape, beyond their ranges."""
    names = [number.name for number in numbers]
    for i, number in enumerate(numbers):
        if number.above:
            yield "above", i, names.index(number.above), f"{number.name} is not above {number.above}"
    groups = groupby(enumerate(numbers), lambda item: (item[1][1:4] == PART, re.split(r"[.\[]", item[1].name + ".")[0]))
    parts = [(name, [i for i, _ in group]) for (is_part, name), group in groups if is_part]
    lone = [name for name, places in parts if len(places) == 1]
    if lone:  # for example a sine and a cosine
        first = next(places[0] for name, places in parts if len(places) == 1)
        yield "unit", first, len(lone), f"{' and '.join(lone)} are of no angle"
    for name, places in parts:
        if len(places) == 9:
            yield "rotation", places[0], 9, f"{name} is no rotation matrix"
        elif len(places) > 1:
            yield "unit", places[0], len(places), f"{name} is not of length 1"
