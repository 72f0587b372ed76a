"""The kinds of smooth membership functions: one entry each, for engines, formats and exports."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

Pieces = list[tuple[float, str]]  # end of each piece, the last at infinity, and its expression
Word = tuple[str, tuple[int, ...]]  # a format's word, and the indices of its parameters in the format's order

Valid = tuple[Callable[..., bool], str]

_END = math.inf


@dataclass(frozen=True, slots=True)
class CurveKind:
    """A kind of membership function, with its words in all formats."""

    parameters: tuple[str, ...]  # names of the parameters, in the order of `Curve.parameters`
    # function from the parameters to the smooth pieces, whose expressions use ``x`` and the parameters' names
    pieces: Callable[..., Pieces]
    fll: str  # word of fuzzylite, which has the parameters in the same order; empty if there is none
    fis: Word  # word of MATLAB or fuzzylite; empty if there is none
    fcl: Word | None = None  # word of jFuzzyLogic; None if there is none
    # predicate on the parameters, and its words
    valid: Valid = (lambda *parameters: True, "finite numbers")
    polynomial: bool = False  # true if the pieces are polynomials
    # function for a kind that only rises or only falls: from the parameters to pieces over the degree ``w``, which
    # give the position
    inverse: Callable[..., Pieces] | None = None
    # function from the parameters to positions around which the curve changes: between these, and beyond the first and
    # the last, it only rises or only falls, unless `monotonic` is False. Positions that are not finite do not count
    features: Callable[..., list[float]] = lambda *parameters: list(parameters)
    monotonic: bool = True  # false if the curve may turn at positions that `features` does not give


def _multiplied(first: Pieces, second: Pieces) -> Pieces:
    """Return the product of two functions in pieces."""
    ends = sorted({end for end, _ in (*first, *second)})

    def at(pieces: Pieces, end: float) -> str:
        return next(text for other, text in pieces if end <= other)

    return [(end, f"({at(first, end)}) * ({at(second, end)})") for end in ends]


def _s(start: float, end: float, names: tuple[str, str] = ("start", "end"), rises: bool = True) -> Pieces:
    foot, top = names if rises else names[::-1]
    low, high = f"2 * ((x - {foot}) / ({top} - {foot})) ^ 2", f"1 - 2 * ((x - {top}) / ({top} - {foot})) ^ 2"
    texts = ("0", low, high, "1") if rises else ("1", high, low, "0")
    if start == end:
        return [(start, texts[0]), (_END, texts[-1])]
    return list(zip((start, (start + end) / 2, end, _END), texts, strict=True))


def _z(start: float, end: float, names: tuple[str, str] = ("start", "end")) -> Pieces:
    return _s(start, end, names, rises=False)


def _gaussian(mean: str, deviation: str) -> str:
    return f"exp(-(x - {mean}) ^ 2 / (2 * {deviation} ^ 2))"


def _sigmoid(inflection: str, slope: str) -> str:
    return f"1 / (1 + exp(-{slope} * (x - {inflection})))"


def _difference(left: float, rising: float, falling: float, right: float) -> Pieces:
    # s(a) - s(b) = s(a) s(-b) (1 - exp(b - a)), of which no term is lost to rounding where both are near 1
    a, b = "max(min(rising * (x - left), 800), -800)", "max(min(falling * (x - right), 800), -800)"
    text = f"(1 - exp(-abs({a} - {b}))) / ((1 + exp(-max({a}, {b}))) * (1 + exp(min({a}, {b}))))"
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
    curve = "sqrt(max(0, (x - start) * (2 * end - start - x))) / abs(end - start)"
    return [(start, "0"), (end, curve), (_END, "1")] if start < end else [(end, "1"), (start, curve), (_END, "0")]


def _ellipse(start: float, end: float) -> Pieces:
    curve = "sqrt(max(0, (x - start) * (end - x))) / (abs(end - start) / 2)"
    return [(min(start, end), "0"), (max(start, end), curve), (_END, "0")]


def _whole(text: str) -> Callable[..., Pieces]:
    return lambda *parameters: [(_END, text)]


def _peaked(text: str) -> Callable[..., Pieces]:
    """Return one expression in two pieces, which meet at the first parameter, where it bends."""
    return lambda center, *others: [(center, text), (_END, text)]


def _nonzero(words: str, *indices: int) -> Valid:
    return lambda *parameters: all(parameters[i] != 0.0 for i in indices), f"{words} other than 0"


def _around(center: float, scale: float) -> list[float]:
    """Return positions on both sides of a center at which a curve of that scale has changed."""
    return [center + fraction * scale for fraction in (-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0)]


def _inflection(inflection: float, slope: float) -> list[float]:
    return _around(inflection, 3.0 / slope) if slope else []


def _two_inflections(left: float, rising: float, falling: float, right: float) -> list[float]:
    return [*_inflection(left, rising), *_inflection(right, falling)]


def _product_of_gaussians(mean1: float, deviation1: float, mean2: float, deviation2: float) -> list[float]:
    """Return the features of both, and the top of their product, which counts where the first mean is the greater."""
    first, second = deviation1**2, deviation2**2
    top = (mean1 * second + mean2 * first) / (first + second) if first + second else mean1
    return [*_around(mean1, deviation1), *_around(mean2, deviation2), top]


_ORDERED: Valid = (lambda start, end: start <= end, "a start that is not above the end")
_DISTINCT: Valid = (lambda start, end: start != end, "two positions")

KINDS: dict[str, CurveKind] = {
    "gaussian": CurveKind(
        ("mean", "deviation"), _whole(_gaussian("mean", "deviation")),
        fll="Gaussian", fis=("gaussmf", (1, 0)), fcl=("GAUSS", (0, 1)),
        valid=_nonzero("a deviation", 1), features=_around,
    ),
    "gaussian2": CurveKind(
        ("mean1", "deviation1", "mean2", "deviation2"),
        lambda mean1, deviation1, mean2, deviation2: _multiplied(
            [(mean1, _gaussian("mean1", "deviation1")), (_END, "1")],
            [(mean2, "1"), (_END, _gaussian("mean2", "deviation2"))],
        ),
        fll="GaussianProduct", fis=("gauss2mf", (1, 0, 3, 2)), fcl=("GAUSS2", (0, 1, 2, 3)),
        valid=_nonzero("deviations", 1, 3), features=_product_of_gaussians,
    ),
    "bell": CurveKind(
        ("center", "width", "slope"), _peaked("1 / (1 + abs((x - center) / width) ^ (2 * slope))"),
        fll="Bell", fis=("gbellmf", (1, 2, 0)), fcl=("GBELL", (1, 2, 0)), valid=_nonzero("a width", 1),
        features=lambda center, width, slope: [
            center,
            *_around(center - width, width / (4.0 * max(abs(slope), 1.0))),
            *_around(center + width, width / (4.0 * max(abs(slope), 1.0))),
        ],
    ),
    "sigmoid": CurveKind(
        ("inflection", "slope"), _whole(_sigmoid("inflection", "slope")),
        fll="Sigmoid", fis=("sigmf", (1, 0)), fcl=("SIGM", (1, 0)),
        inverse=_whole("inflection - log(1 / w - 1) / slope"), features=_inflection,
    ),
    "sigmoid_difference": CurveKind(
        ("left", "rising", "falling", "right"), _difference,
        fll="SigmoidDifference", fis=("dsigmf", (1, 0, 2, 3)), fcl=("DSIGM", (1, 0, 2, 3)),
        features=_two_inflections, monotonic=False,
    ),
    "sigmoid_product": CurveKind(
        ("left", "rising", "falling", "right"),
        _whole(f"({_sigmoid('left', 'rising')}) * ({_sigmoid('right', 'falling')})"),
        fll="SigmoidProduct", fis=("psigmf", (1, 0, 2, 3)), features=_two_inflections, monotonic=False,
    ),
    "z_shape": CurveKind(
        ("start", "end"), _z, fll="ZShape", fis=("zmf", (0, 1)), valid=_ORDERED, polynomial=True,
        inverse=lambda start, end: [
            (0.5, "end - (end - start) * sqrt(w / 2)"), (_END, "start + (end - start) * sqrt((1 - w) / 2)"),
        ],
    ),
    "s_shape": CurveKind(
        ("start", "end"), _s, fll="SShape", fis=("smf", (0, 1)), valid=_ORDERED, polynomial=True,
        inverse=lambda start, end: [
            (0.5, "start + (end - start) * sqrt(w / 2)"), (_END, "end - (end - start) * sqrt((1 - w) / 2)"),
        ],
    ),
    "pi_shape": CurveKind(
        ("foot1", "top1", "top2", "foot2"),
        lambda foot1, top1, top2, foot2: _multiplied(
            _s(foot1, top1, ("foot1", "top1")), _z(top2, foot2, ("top2", "foot2"))
        ),
        fll="PiShape", fis=("pimf", (0, 1, 2, 3)), polynomial=True, monotonic=False,  # where its tops overlap
        valid=(
            lambda foot1, top1, top2, foot2: foot1 <= top1 and top2 <= foot2,
            "each foot on the outer side of its top",
        ),
    ),
    "cosine": CurveKind(
        ("center", "width"),
        lambda center, width: [
            (center - width / 2, "0"),
            (center + width / 2, "cos(pi / width * (x - center)) ^ 2"),
            (_END, "0"),
        ],
        fll="Cosine", fis=("cosinemf", (0, 1)), features=lambda center, width: [center],
        valid=(lambda center, width: width > 0.0, "a width above 0"),
    ),
    "spike": CurveKind(
        ("center", "width"), _peaked("exp(-abs(10 / width * (x - center)))"),
        fll="Spike", fis=("spikemf", (0, 1)), valid=_nonzero("a width", 1),
        features=lambda center, width: _around(center, width / 10.0),
    ),
    "concave": CurveKind(
        ("inflection", "end"), _concave, fll="Concave", fis=("concavemf", (0, 1)),
        inverse=_whole("(inflection - end) / w + 2 * end - inflection"), features=lambda inflection, end: [end],
    ),
    "arc": CurveKind(
        ("start", "end"), _arc, fll="Arc", fis=("arcmf", (0, 1)), valid=_DISTINCT,
        inverse=lambda start, end: [
            (_END, f"end {'-' if start < end else '+'} sqrt((end - start) ^ 2 * (1 - w ^ 2))"),
        ],
    ),
    "singleton": CurveKind(
        ("position",), lambda position: [(position, "eq(x, position)"), (_END, "0")], fll="", fis=("", (0,))
    ),
    "semi_ellipse": CurveKind(
        ("start", "end"), _ellipse, fll="SemiEllipse", fis=("semiellipsemf", (0, 1)), valid=_DISTINCT,
        features=lambda start, end: [(start + end) / 2.0],
    ),
}  # fmt: skip
"""All kinds, by name."""
