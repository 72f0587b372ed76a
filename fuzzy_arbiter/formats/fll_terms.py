"""Terms of the FuzzyLite Language, which fuzzylite's FIS and FCL share, and its reserved words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.notation import format_number, format_numbers, read_number, refuse
from fuzzy_arbiter.shapes import Membership, Point, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.functions import WORDS
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.norms import HEDGES
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

_FUNCTIONS = "acosh asinh atanh gt lt le ge eq neq abs fabs"
RESERVED = frozenset(
    (*(word for word, hedge in HEDGES.items() if hedge.fll), "any", "not", *WORDS, *_FUNCTIONS.split())
)
# number of places of each; a height may follow
_PLACES = {"Triangle": 3, "Trapezoid": 4, "Ramp": 2, "Rectangle": 2, "Binary": 2}
CURVES = {kind.fll: (name, range(len(kind.parameters))) for name, kind in KINDS.items() if kind.fll}
VALUES = ("Constant", "Linear", "Function")
TYPES = (*_PLACES, "Discrete", *CURVES, *VALUES)


def format_shape(shape: Membership | Value) -> str:
    """Format a term's shape as its type and numbers."""
    if isinstance(shape, Curve):
        word, numbers = KINDS[shape.kind].fll, shape.parameters
        if shape.kind == "singleton":
            word, numbers = "Triangle", shape.parameters * 3
        height = "" if shape.height == 1.0 else f" {format_number(shape.height)}"
        return f"{word} {format_numbers(numbers)}{height}"
    if isinstance(shape, Constant):
        return f"Constant {format_number(shape.value)}"
    if isinstance(shape, Linear):
        return f"Linear {format_numbers((*shape.coefficients, shape.constant))}"
    if isinstance(shape, Formula):
        return f"Function {shape.text}"
    if not isinstance(shape, Shape):
        raise UnsupportedError(f"fll cannot say {shape!r}")
    positions = [x for x, _ in shape.points]
    match [degree for _, degree in shape.points]:
        case [0.0, 1.0, 0.0]:
            return f"Triangle {format_numbers(positions)}"
        case [0.0, 1.0, 1.0, 0.0]:
            return f"Trapezoid {format_numbers(positions)}"
        case [0.0, 1.0] if not shape.jumps:
            return f"Ramp {format_numbers(positions)}"
        case [1.0, 0.0] if not shape.jumps:
            return f"Ramp {format_numbers(reversed(positions))}"
    return f"Discrete {format_numbers(x for point in shape.points for x in point)}"


def read_shape(kind: str, text: str, line: int, inputs: int | None = None) -> Membership | Value:
    """Return the membership function or value of a term's type and numbers."""
    if kind not in TYPES:
        refuse(line, f"term type {kind!r} is not known here, expected one of {', '.join(TYPES)}")
    if kind == "Function":
        return Formula(text)
    numbers = [_number(part, line, kind) for part in text.split()]
    if kind in VALUES:
        return read_value(kind, numbers, line, inputs)
    if kind in CURVES:
        name, order = CURVES[kind]
        return curve_of(name, order, numbers, line, kind)
    if kind == "Discrete":
        height = numbers.pop() if len(numbers) % 2 else 1.0
        points = list(zip(numbers[::2], numbers[1::2], strict=True))
    else:
        count = _PLACES[kind]
        if len(numbers) not in (count, count + 1):
            refuse(line, f"{kind} has the numbers {text!r}, expected {count}, and perhaps a height")
        height = numbers.pop() if len(numbers) > count else 1.0
        if len(set(numbers)) == 1 and kind in ("Triangle", "Trapezoid", "Rectangle") and height > 0.0:
            return Curve("singleton", (numbers[0],), height)
        points = _points(kind, numbers, line)
    if not 0.0 <= height <= 1.0:
        refuse(line, f"{kind} has the height {height!r}, expected 0 to 1")
    return Shape(tuple((x, degree * height) for x, degree in points))


def read_value(kind: str, numbers: Sequence[float], line: int, inputs: int | None) -> Value:
    """Return the value of a constant's or linear term's numbers."""
    if inputs is None:
        refuse(line, f"an input's term is {kind}, which is a value, expected a membership function")
    if kind.lower() == "constant":
        if len(numbers) != 1:
            refuse(line, f"{kind} has {len(numbers)} numbers, expected 1")
        return Constant(numbers[0])
    if len(numbers) not in (inputs, inputs + 1):
        refuse(line, f"{kind} has {len(numbers)} numbers, expected {inputs} or {inputs + 1} for {inputs} inputs")
    return Linear(tuple(numbers[:inputs]), *numbers[inputs:])


def curve_of(name: str, order: Sequence[int], numbers: Sequence[float], line: int, word: str) -> Curve:
    """Return the curve of a format's word and numbers."""
    count = len(order)
    if len(numbers) not in (count, count + 1):
        refuse(line, f"{word} has {len(numbers)} numbers, expected {count}, and perhaps a height")
    parameters = [number for _, number in sorted(zip(order, numbers, strict=False))]
    return Curve(name, tuple(parameters), *numbers[count:])


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
