"""Terms of the FuzzyLite Language, which fuzzylite's FIS and FCL share, and its reserved words."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats.notation import format_numbers, read_number, refuse
from fuzzy_arbiter.shapes import Membership, Point, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.functions import WORDS
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.norms import HEDGES
from fuzzy_arbiter.terms.values import Constant, Formula, Linear, Value

_FUNCTIONS = "acosh asinh atanh gt lt le ge eq neq abs fabs"
RESERVED = frozenset((*(word for word, hedge in HEDGES.items() if hedge.fll), "any", "not"))
FUNCTION_NAMES = frozenset((*WORDS, *_FUNCTIONS.split()))  # in small letters alone
# number of positions of each; a height may follow
_PLACES = {"Triangle": 3, "Trapezoid": 4, "Ramp": 2, "Rectangle": 2, "Binary": 2}
_CURVES = {kind.fll: name for name, kind in KINDS.items() if kind.fll}
VALUES = ("Constant", "Linear", "Function")
TYPES = (*_PLACES, "Discrete", *_CURVES, *VALUES)


def parts_of(shape: Membership | Value) -> tuple[str, tuple[float, ...], str]:
    """Return the kind of a shape, its numbers, and the text of a formula."""
    if isinstance(shape, Shape):
        return "points", tuple(x for point in shape.points for x in point), ""
    if isinstance(shape, Curve):
        return shape.kind, shape.parameters, ""
    if isinstance(shape, Linear):
        return "linear", (*shape.coefficients, shape.constant), ""
    if isinstance(shape, Constant):
        return "constant", (shape.value,), ""
    if not isinstance(shape, Formula):
        raise UnsupportedError(f"cannot express the term {shape!r}")
    return "formula", (), shape.text


def format_shape(shape: Membership | Value) -> str:
    """Format a term's shape as its type and numbers."""
    kind, numbers, text = parts_of(shape)
    word = {"constant": "Constant", "linear": "Linear", "formula": f"Function {text}", "points": "Discrete"}.get(kind)
    if kind == "singleton":
        word, numbers = "Triangle", numbers * 3
    if isinstance(shape, Curve) and shape.height != 1.0:
        numbers = (*numbers, shape.height)
    if isinstance(shape, Shape):
        positions = numbers[::2]
        match numbers[1::2]:
            case (0.0, 1.0, 0.0):
                word, numbers = "Triangle", positions
            case (0.0, 1.0, 1.0, 0.0):
                word, numbers = "Trapezoid", positions
            case (0.0, 1.0) | (1.0, 0.0) as degrees if not shape.jumps:
                word, numbers = "Ramp", positions if degrees[1] else positions[::-1]
    return f"{word or KINDS[kind].fll} {format_numbers(numbers)}".rstrip(" ")


def read_shape(kind: str, text: str, line: int, inputs: int | None = None) -> Membership | Value:
    """Return the membership function or value of a term's type and numbers."""
    if kind not in TYPES:
        refuse(line, f"term type {kind!r} is not known here, expected one of {', '.join(TYPES)}")
    if kind == "Function":
        return Formula(text)
    numbers = [read_number(part, line, f"{kind}'s number", infinite=True) for part in text.split()]
    return shape_of(kind, numbers, line, inputs)


def shape_of(kind: str, numbers: list[float], line: int, inputs: int | None, word: str = "") -> Membership | Value:
    """Return the membership function or value of a type's numbers; `word` is the type's in the file."""
    word = word or kind
    if kind in VALUES:
        return _value(kind, numbers, line, inputs, word)
    count = _PLACES.get(kind) or (len(KINDS[_CURVES[kind]].parameters) if kind in _CURVES else len(numbers) // 2 * 2)
    if len(numbers) not in (count, count + 1):
        received = format_numbers(numbers)
        refuse(line, f"{word} has the numbers {received!r}, expected {count}, and perhaps a height")
    *numbers, height = (*numbers, 1.0)[: count + 1]
    if kind in _CURVES:
        return Curve(_CURVES[kind], tuple(numbers), height)
    if len(set(numbers)) == 1 and kind in ("Triangle", "Trapezoid", "Rectangle") and height > 0.0:
        return Curve("singleton", (numbers[0],), height)
    points = _points(kind, numbers, line)
    if not 0.0 <= height <= 1.0:
        refuse(line, f"{word} has the height {height!r}, expected 0 to 1")
    return Shape(tuple((x, degree * height) for x, degree in points))


def _value(kind: str, numbers: Sequence[float], line: int, inputs: int | None, word: str) -> Value:
    if inputs is None:
        refuse(line, f"an input's term is {word}, which is a value, expected a membership function")
    counts = (1,) if kind == "Constant" else (inputs, inputs + 1)
    if len(numbers) not in counts:
        refuse(line, f"{word} has {len(numbers)} numbers, expected {' or '.join(map(str, counts))}")
    return Constant(numbers[0]) if kind == "Constant" else Linear(tuple(numbers[:inputs]), *numbers[inputs:])


def _points(kind: str, numbers: Sequence[float], line: int) -> list[Point]:
    if kind == "Discrete":
        return list(zip(numbers[::2], numbers[1::2], strict=True))
    if kind == "Binary":
        start, direction = numbers
        if not math.isinf(direction):
            refuse(line, f"Binary has the direction {direction!r}, expected inf or -inf")
        return [(start, 0.0), (start, 1.0)] if direction > 0 else [(start, 1.0), (start, 0.0)]
    if kind == "Ramp":
        start, end = numbers
        if start == end:
            refuse(line, f"Ramp begins and ends at {start!r}, expected two positions")
        return [(start, 0.0), (end, 1.0)] if start < end else [(end, 1.0), (start, 0.0)]
    if kind == "Rectangle":
        start, end = sorted(numbers)
        return [(start, 0.0), (start, 1.0), (end, 1.0), (end, 0.0)]
    # an infinite foot makes a shoulder, and so do a foot and a top that are infinite
    left, *top, right = numbers
    infinite = ({left} & {-math.inf}) | ({right} & {math.inf})
    points = [(left, 0.0), *((x, 1.0) for x in dict.fromkeys(top)), (right, 0.0)]
    return [(x, degree) for x, degree in points if x not in infinite] or [(0.0, 1.0)]
