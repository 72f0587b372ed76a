"""The terms of the FuzzyLite Language that are piecewise linear, and the words that it keeps for itself."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fuzzy_arbiter.formats.notation import read_number, refuse, say_numbers
from fuzzy_arbiter.shapes import Point, Shape

HEDGES = frozenset(("any", "extremely", "not", "seldom", "somewhat", "very"))
_FUNCTIONS = (
    "abs acos acosh asin asinh atan atan2 atanh ceil cos cosh eq exp fabs floor fmod ge gt le log log10 log1p lt max "
    "min neq pi pow round sin sinh sqrt tan tanh"
)
RESERVED = HEDGES | frozenset(_FUNCTIONS.split())
# each with the number of its places; a height may follow
_PLACES = {"Triangle": 3, "Trapezoid": 4, "Ramp": 2, "Rectangle": 2, "Binary": 2}
_KNOWN = ", ".join((*_PLACES, "Discrete"))


def say_shape(shape: Shape) -> str:
    """Return a shape as a term's type and numbers.

    Parameters
    ----------
    shape : Shape
        What is written.

    Returns
    -------
    str
        A triangle, a trapezoid or a ramp where it is one, else its points.
    """
    places = [x for x, _ in shape.points]
    match [degree for _, degree in shape.points]:
        case [0.0, 1.0, 0.0]:
            return f"Triangle {say_numbers(places)}"
        case [0.0, 1.0, 1.0, 0.0]:
            return f"Trapezoid {say_numbers(places)}"
        case [0.0, 1.0] if not shape.jumps:
            return f"Ramp {say_numbers(places)}"
        case [1.0, 0.0] if not shape.jumps:
            return f"Ramp {say_numbers(reversed(places))}"
    return f"Discrete {say_numbers(x for point in shape.points for x in point)}"


def read_shape(kind: str, text: str, line: int) -> Shape:
    """Return the shape that a term's type and numbers say.

    Parameters
    ----------
    kind : str
        Type of the term.
    text : str
        Its numbers.
    line : int
        Where it stands.

    Returns
    -------
    Shape
        With degrees up to the term's height.

    Raises
    ------
    FormatError
        If the type is not known here, or its numbers are not as it wants them.
    DefinitionError
        If they make no shape.
    """
    if kind != "Discrete" and kind not in _PLACES:
        refuse(line, f"term type {kind!r} is not known here, expected one of {_KNOWN}")
    numbers = [_number(part, line, kind) for part in text.split()]
    if kind == "Discrete":
        height = numbers.pop() if len(numbers) % 2 else 1.0
        points = list(zip(numbers[::2], numbers[1::2], strict=True))
    else:
        count = _PLACES[kind]
        if len(numbers) not in (count, count + 1):
            refuse(line, f"{kind} has the numbers {text!r}, expected {count}, and perhaps a height")
        height = numbers.pop() if len(numbers) > count else 1.0
        points = _points(kind, numbers, line)
    if not 0.0 <= height <= 1.0:
        refuse(line, f"{kind} has the height {height!r}, expected 0 to 1")
    return Shape(tuple((x, degree * height) for x, degree in points))


def _number(text: str, line: int, kind: str) -> float:
    infinite = {"inf": math.inf, "-inf": -math.inf}.get(text)
    return read_number(text, line, f"{kind}'s number") if infinite is None else infinite


def _points(kind: str, numbers: Sequence[float], line: int) -> list[Point]:
    if kind == "Binary":
        start, direction = numbers
        if not math.isinf(direction):
            refuse(line, f"Binary has the direction {direction!r}, expected inf or -inf")
        return [(start, 0.0), (start, 1.0)] if direction > 0 else [(start, 1.0), (start, 0.0)]
    if kind == "Ramp":
        start, end = numbers
        if start == end:
            refuse(line, f"Ramp begins and ends at {start!r}, expected two places")
        return [(start, 0.0), (end, 1.0)] if start < end else [(end, 1.0), (start, 0.0)]
    if kind == "Rectangle":
        start, end = sorted(numbers)
        return [(start, 0.0), (start, 1.0), (end, 1.0), (end, 0.0)]
    # an infinite foot makes a shoulder
    left, *top, right = numbers
    feet_left = [] if left == -math.inf else [(left, 0.0)]
    feet_right = [] if right == math.inf else [(right, 0.0)]
    if len(top) == 2 and top[0] == top[1]:
        del top[0]
    return [*feet_left, *((x, 1.0) for x in top), *feet_right]
