"""Smooth membership functions by name: each kind is one entry here, with all that any engine, format or export needs."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from fuzzy_arbiter.checks import finite, shown
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.shapes import Array, Membership, Shape
from fuzzy_arbiter.terms.expressions import Expression, Node, array_function, number_function

Pieces = list[tuple[float, str]]  # where each ends, the last at infinity, and its expression
Word = tuple[str, tuple[int, ...]]  # what a format calls it, and which parameters it names, in its order

_END = math.inf


@dataclass(frozen=True, slots=True)
class CurveKind:
    """A kind of membership function, with all its faces.

    Attributes
    ----------
    parameters : tuple of str
        Their names, in the order of `Curve.parameters`.
    pieces : callable
        From the parameters to its smooth pieces, whose expressions speak of ``x`` and of the parameters' names.
    good : callable
        Whether there is such a function.
    expected : str
        What the parameters have to be, in words.
    fll, fis, fcl : Word, optional
        How fuzzylite, MATLAB or fuzzylite, and jFuzzyLogic spell it; an empty word is none.
    polynomial : bool
        Whether its pieces are polynomials.
    inverse : callable, optional
        For one that only rises or only falls: pieces over its degree ``w``, which give the place.
    """

    parameters: tuple[str, ...]
    pieces: Callable[..., Pieces]
    good: Callable[..., bool]
    expected: str
    fll: Word
    fis: Word
    fcl: Word | None = None
    polynomial: bool = False
    inverse: Callable[..., Pieces] | None = None


def _same(count: int) -> tuple[int, ...]:
    return tuple(range(count))


def _multiplied(first: Pieces, second: Pieces) -> Pieces:
    """Return the product of two functions in pieces."""
    ends = sorted({end for end, _ in (*first, *second)})

    def at(pieces: Pieces, end: float) -> str:
        return next(text for other, text in pieces if end <= other)

    return [(end, f"({at(first, end)}) * ({at(second, end)})") for end in ends]


def _s(start: float, end: float, names: tuple[str, str] = ("start", "end")) -> Pieces:
    if start == end:
        return [(start, "0"), (_END, "1")]
    a, b = names
    return [
        (start, "0"),
        ((start + end) / 2, f"2 * ((x - {a}) / ({b} - {a})) ^ 2"),
        (end, f"1 - 2 * ((x - {b}) / ({b} - {a})) ^ 2"),
        (_END, "1"),
    ]


def _z(start: float, end: float, names: tuple[str, str] = ("start", "end")) -> Pieces:
    return [(place, text if text in ("0", "1") else f"1 - ({text})") for place, text in _flipped(_s(start, end, names))]


def _flipped(pieces: Pieces) -> Pieces:
    return [(end, {"0": "1", "1": "0"}.get(text, text)) for end, text in pieces]


def _gaussian(mean: str, deviation: str) -> str:
    return f"exp(-(x - {mean}) ^ 2 / (2 * {deviation} ^ 2))"


def _sigmoid(inflection: str, slope: str) -> str:
    return f"1 / (1 + exp(-{slope} * (x - {inflection})))"


def _difference(left: float, rising: float, falling: float, right: float) -> Pieces:
    text = f"abs({_sigmoid('left', 'rising')} - {_sigmoid('right', 'falling')})"
    if rising == falling:
        return [(_END, text)]
    return [((rising * left - falling * right) / (rising - falling), text), (_END, text)]


def _concave(inflection: float, end: float) -> Pieces:
    if inflection == end:
        return [(end, "0"), (_END, "1")]
    if inflection < end:
        return [(end, "(end - inflection) / (2 * end - inflection - x)"), (_END, "1")]
    return [(end, "1"), (_END, "(inflection - end) / (inflection - 2 * end + x)")]


def _arc(start: float, end: float) -> Pieces:
    curve = "sqrt(max(0, (end - start) ^ 2 - (x - end) ^ 2)) / abs(end - start)"
    return [(start, "0"), (end, curve), (_END, "1")] if start < end else [(end, "1"), (start, curve), (_END, "0")]


def _ellipse(start: float, end: float) -> Pieces:
    curve = "sqrt(max(0, (x - start) * (end - x))) / (abs(end - start) / 2)"
    return [(min(start, end), "0"), (max(start, end), curve), (_END, "0")]


KINDS: dict[str, CurveKind] = {
    "gaussian": CurveKind(
        ("mean", "deviation"),
        lambda mean, deviation: [(_END, _gaussian("mean", "deviation"))],
        lambda mean, deviation: deviation != 0.0,
        "a deviation other than 0",
        fll=("Gaussian", (0, 1)),
        fis=("gaussmf", (1, 0)),
        fcl=("GAUSS", (0, 1)),
    ),
    "gaussian2": CurveKind(
        ("mean1", "deviation1", "mean2", "deviation2"),
        lambda mean1, deviation1, mean2, deviation2: _multiplied(
            [(mean1, _gaussian("mean1", "deviation1")), (_END, "1")],
            [(mean2, "1"), (_END, _gaussian("mean2", "deviation2"))],
        ),
        lambda mean1, deviation1, mean2, deviation2: deviation1 != 0.0 and deviation2 != 0.0,
        "deviations other than 0",
        fll=("GaussianProduct", (0, 1, 2, 3)),
        fis=("gauss2mf", (1, 0, 3, 2)),
        fcl=("GAUSS2", (0, 1, 2, 3)),
    ),
    "bell": CurveKind(
        ("center", "width", "slope"),
        lambda center, width, slope: [
            (center, "1 / (1 + abs((x - center) / width) ^ (2 * slope))"),
            (_END, "1 / (1 + abs((x - center) / width) ^ (2 * slope))"),
        ],
        lambda center, width, slope: width != 0.0,
        "a width other than 0",
        fll=("Bell", (0, 1, 2)),
        fis=("gbellmf", (1, 2, 0)),
        fcl=("GBELL", (1, 2, 0)),
    ),
    "sigmoid": CurveKind(
        ("inflection", "slope"),
        lambda inflection, slope: [(_END, _sigmoid("inflection", "slope"))],
        lambda inflection, slope: True,
        "two numbers",
        fll=("Sigmoid", (0, 1)),
        fis=("sigmf", (1, 0)),
        fcl=("SIGM", (1, 0)),
        inverse=lambda inflection, slope: [(_END, "inflection - log(1 / w - 1) / slope")],
    ),
    "sigmoid_difference": CurveKind(
        ("left", "rising", "falling", "right"),
        _difference,
        lambda left, rising, falling, right: True,
        "four numbers",
        fll=("SigmoidDifference", (0, 1, 2, 3)),
        fis=("dsigmf", (1, 0, 2, 3)),
        fcl=("DSIGM", (1, 0, 2, 3)),
    ),
    "sigmoid_product": CurveKind(
        ("left", "rising", "falling", "right"),
        lambda left, rising, falling, right: [
            (_END, f"({_sigmoid('left', 'rising')}) * ({_sigmoid('right', 'falling')})")
        ],
        lambda left, rising, falling, right: True,
        "four numbers",
        fll=("SigmoidProduct", (0, 1, 2, 3)),
        fis=("psigmf", (1, 0, 2, 3)),
    ),
    "z_shape": CurveKind(
        ("start", "end"),
        _z,
        lambda start, end: start <= end,
        "a start that is not above the end",
        fll=("ZShape", (0, 1)),
        fis=("zmf", (0, 1)),
        polynomial=True,
        inverse=lambda start, end: [
            (0.5, "end - (end - start) * sqrt(w / 2)"),
            (_END, "start + (end - start) * sqrt((1 - w) / 2)"),
        ],
    ),
    "s_shape": CurveKind(
        ("start", "end"),
        _s,
        lambda start, end: start <= end,
        "a start that is not above the end",
        fll=("SShape", (0, 1)),
        fis=("smf", (0, 1)),
        polynomial=True,
        inverse=lambda start, end: [
            (0.5, "start + (end - start) * sqrt(w / 2)"),
            (_END, "end - (end - start) * sqrt((1 - w) / 2)"),
        ],
    ),
    "pi_shape": CurveKind(
        ("foot1", "top1", "top2", "foot2"),
        lambda foot1, top1, top2, foot2: _multiplied(
            _s(foot1, top1, ("foot1", "top1")), _z(top2, foot2, ("top2", "foot2"))
        ),
        lambda foot1, top1, top2, foot2: foot1 <= top1 and top2 <= foot2,
        "each foot on the outer side of its top",
        fll=("PiShape", (0, 1, 2, 3)),
        fis=("pimf", (0, 1, 2, 3)),
        polynomial=True,
    ),
    "cosine": CurveKind(
        ("center", "width"),
        lambda center, width: [
            (center - width / 2, "0"),
            (center + width / 2, "0.5 * (1 + cos(2 / width * pi * (x - center)))"),
            (_END, "0"),
        ],
        lambda center, width: width > 0.0,
        "a width above 0",
        fll=("Cosine", (0, 1)),
        fis=("cosinemf", (0, 1)),
    ),
    "spike": CurveKind(
        ("center", "width"),
        lambda center, width: [
            (center, "exp(-abs(10 / width * (x - center)))"),
            (_END, "exp(-abs(10 / width * (x - center)))"),
        ],
        lambda center, width: width != 0.0,
        "a width other than 0",
        fll=("Spike", (0, 1)),
        fis=("spikemf", (0, 1)),
    ),
    "concave": CurveKind(
        ("inflection", "end"),
        _concave,
        lambda inflection, end: True,
        "two numbers",
        fll=("Concave", (0, 1)),
        fis=("concavemf", (0, 1)),
        inverse=lambda inflection, end: [(_END, "(inflection - end) / w + 2 * end - inflection")],
    ),
    "arc": CurveKind(
        ("start", "end"),
        _arc,
        lambda start, end: start != end,
        "two places",
        fll=("Arc", (0, 1)),
        fis=("arcmf", (0, 1)),
        inverse=lambda start, end: [
            (_END, f"end {'-' if start < end else '+'} sqrt((end - start) ^ 2 * (1 - w ^ 2))"),
        ],
    ),
    "singleton": CurveKind(
        ("place",),
        lambda place: [(place, "eq(x, place)"), (_END, "0")],
        lambda place: True,
        "a place",
        fll=("", (0,)),
        fis=("", (0,)),
    ),
    "semi_ellipse": CurveKind(
        ("start", "end"),
        _ellipse,
        lambda start, end: start != end,
        "two places",
        fll=("SemiEllipse", (0, 1)),
        fis=("semiellipsemf", (0, 1)),
    ),
}
"""All kinds, by name."""


@dataclass(frozen=True, slots=True)
class Curve(Membership):
    """A membership function of a named kind.

    Attributes
    ----------
    kind : str
        Such as ``gaussian``; `KINDS` has them all.
    parameters : tuple of float
        As many as the kind has, in its order.
    height : float
        By which all degrees are multiplied, above 0 and at most 1.

    Raises
    ------
    DefinitionError
        If there is no such kind, or the parameters make none.

    Examples
    --------
    >>> from fuzzy_arbiter.terms.curves import Curve
    >>> Curve("s_shape", (0.0, 2.0))(0.5)
    0.125
    """

    kind: str
    parameters: tuple[float, ...]
    height: float = 1.0
    ends: tuple[float, ...] = field(init=False, repr=False, compare=False)
    trees: tuple[Node, ...] = field(init=False, repr=False, compare=False)
    _numbers: tuple[Callable[..., float], ...] = field(init=False, repr=False, compare=False)
    _arrays: tuple[Callable[..., Any], ...] = field(init=False, repr=False, compare=False)
    _jumps: tuple[float, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        kind = KINDS.get(self.kind) if isinstance(self.kind, str) else None
        if kind is None:
            raise DefinitionError(f"curve is {shown(self.kind)}, expected one of {', '.join(KINDS)}")
        words = f"{self.kind} of {', '.join(kind.parameters)}"
        given = self.parameters if isinstance(self.parameters, Sequence) and not isinstance(self.parameters, str) else ()
        numbers = tuple(x for x in map(finite, given) if x is not None)
        if len(numbers) != len(given) or len(numbers) != len(kind.parameters):
            raise DefinitionError(f"{words}: {shown(self.parameters)} came, expected {len(kind.parameters)} finite numbers")
        height = finite(self.height)
        if height is None or not 0.0 < height <= 1.0:
            raise DefinitionError(f"{words}: height is {shown(self.height)}, expected above 0 and at most 1")
        if not kind.good(*numbers):
            raise DefinitionError(f"{words}: {shown(numbers)} came, expected {kind.expected}")
        named = dict(zip(kind.parameters, numbers, strict=True))
        pieces = [(end, _tree(text, named, height)) for end, text in kind.pieces(*numbers)]
        object.__setattr__(self, "parameters", numbers)
        object.__setattr__(self, "height", height)
        object.__setattr__(self, "ends", tuple(end for end, _ in pieces))
        object.__setattr__(self, "trees", tuple(tree for _, tree in pieces))
        object.__setattr__(self, "_numbers", tuple(map(number_function, self.trees)))
        object.__setattr__(self, "_arrays", tuple(map(array_function, self.trees)))
        object.__setattr__(self, "_jumps", tuple(x for i, x in enumerate(self.ends[:-1]) if self._jump(i, x)))

    @property
    def polynomial(self) -> bool:  # type: ignore[override]  # by kind
        """Whether its pieces are polynomials."""
        return KINDS[self.kind].polynomial

    @property
    def jumps(self) -> bool:
        """Whether there is a jump."""
        return bool(self._jumps)

    def _side(self, i: int, x: float) -> float:
        return self._numbers[i]({"x": x})

    def _jump(self, i: int, end: float) -> bool:
        return abs(self._side(i, end) - self._side(i + 1, end)) > 1e-9

    def __call__(self, x: float) -> float:
        """Return the degree at a place; of a jump the greater one; NaN for a place that is NaN."""
        if x != x:
            return x
        i = bisect_left(self.ends, x)
        degree = self._side(i, x)
        if x == self.ends[i] and i + 1 < len(self.ends):
            degree = max(degree, self._side(i + 1, x))
        return min(max(degree, 0.0), 1.0)

    def of_many(self, places: Array) -> Array:
        """Return the degrees at many places, each as a call gives it, to rounding."""
        result = np.empty(len(places))
        with np.errstate(all="ignore"):
            if len(self._arrays) == 1:
                result[:] = self._arrays[0]({"x": places})
            else:
                piece = np.searchsorted(self.ends, places)
                for i, of in enumerate(self._arrays):
                    inside = piece == i
                    if inside.any():
                        result[inside] = of({"x": places[inside]})
        for end in self._jumps:
            result[places == end] = self(end)
        np.minimum(np.maximum(result, 0.0, out=result), 1.0, out=result)
        if len(self._arrays) > 1:
            result[places != places] = np.nan
        return result

    def breaks(self, universe: tuple[float, float]) -> tuple[float, ...]:
        """Return the ends of its pieces within a universe."""
        return tuple(sorted({end for end in self.ends if universe[0] < end < universe[1]}))

    def place_of(self, degree: float) -> float:
        """Return where a curve that only rises or only falls has a degree, as Tsukamoto's method asks.

        Parameters
        ----------
        degree : float
            Above 0, at most the height.

        Returns
        -------
        float
            The place, perhaps infinite.
        """
        inverse = KINDS[self.kind].inverse
        assert inverse is not None, self.kind
        named = dict(zip(KINDS[self.kind].parameters, self.parameters, strict=True))
        w = degree / self.height
        text = next(text for end, text in inverse(*self.parameters) if w <= end)
        return Expression(text)({**named, "w": w})

    @property
    def invertible(self) -> bool:
        """Whether it only rises or only falls, so that `place_of` knows a place."""
        return KINDS[self.kind].inverse is not None

    def __reduce__(self) -> tuple[Any, ...]:
        return Curve, (self.kind, self.parameters, self.height)


def _tree(text: str, named: dict[str, float], height: float) -> Node:
    tree = Expression(text).bound(named).tree
    return tree if height == 1.0 else tree * height if isinstance(tree, float) else ("*", height, tree)


def curve(kind: str, *parameters: float, height: float = 1.0) -> Membership:
    """Return a membership function of a named kind.

    Parameters
    ----------
    kind : str
        One of ``gaussian`` (mean, deviation), ``gaussian2`` (mean1, deviation1, mean2, deviation2), ``bell`` (center,
        width, slope), ``sigmoid`` (inflection, slope), ``sigmoid_difference`` and ``sigmoid_product`` (left, rising,
        falling, right), ``z_shape``, ``s_shape`` (start, end), ``pi_shape`` (foot1, top1, top2, foot2), ``cosine`` and
        ``spike`` (center, width), ``concave`` (inflection, end), ``arc`` and ``semi_ellipse`` (start, end), ``singleton`` (place), which is 1 there
        and 0 elsewhere.
    *parameters : float
        As many as the kind has.
    height : float
        By which all degrees are multiplied.

    Returns
    -------
    Membership
        Which gives the degree at a place when called.

    Raises
    ------
    DefinitionError
        If there is no such kind, or the parameters make none.

    Examples
    --------
    >>> from fuzzy_arbiter.terms.curves import curve
    >>> round(curve("gaussian", 5.0, 2.0)(7.0), 4)
    0.6065
    """
    return Curve(kind, parameters, height)


def heightened(shape: Shape, height: float) -> Shape:
    """Return a shape with all degrees multiplied.

    Parameters
    ----------
    shape : Shape
        Any.
    height : float
        From 0 to 1.

    Returns
    -------
    Shape
        Of the same places.
    """
    return shape if height == 1.0 else Shape(tuple((x, degree * height) for x, degree in shape.points))
