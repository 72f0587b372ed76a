"""The centroid of an output of two terms, cut at 1 - h and h, as a function of h: cubic over quadratic, in pieces."""

# The positions where the envelope of the two clipped terms breaks move linearly with h, so that its area is a quadratic
# and its moment a cubic of h as long as no two of them meet and none passes a knot. Between these values of h both
# polynomials are fitted to exact values, in fractions.

from __future__ import annotations

import math
import operator
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.clipped_centroid import Outline, clipped, outline, term_centroids

Polynomial = tuple[Fraction, ...]  # coefficients of t^0, t^1, ..
_START = operator.attrgetter("start")
_NODES = tuple(Fraction(i, 3) for i in range(4))


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of C(h): a cubic over a quadratic of t = h - start."""

    start: float  # start of the piece; its end is the start of the next one, and that of the last one 1
    numerator: tuple[float, float, float, float]  # coefficients of t^0 to t^3
    denominator: tuple[float, float, float]  # coefficients of t^0 to t^2; (1, 0, 0) if it is constant


def evaluate(forms: tuple[Piece, ...], h: Any) -> Any:
    """Return C(h) for a number or for an array."""
    n0: Any
    if len(forms) > 1 and isinstance(h, np.ndarray):
        index = np.searchsorted([piece.start for piece in forms], h, side="right") - 1
        table = np.array([(piece.start, *piece.numerator, *piece.denominator) for piece in forms])
        start, n0, n1, n2, n3, d0, d1, d2 = table[index].T
    else:
        piece = forms[bisect_right(forms, h, key=_START) - 1 if len(forms) > 1 else 0]
        start, (n0, n1, n2, n3), (d0, d1, d2) = piece.start, piece.numerator, piece.denominator
    t = h - start
    above = n0 + t * (n1 + t * (n2 + t * n3))
    return above if type(d1) is float and d1 == d2 == 0.0 else above / (d0 + t * (d1 + t * d2))


def pieces(output: Output) -> tuple[tuple[Piece, ...], tuple[Piece, ...]]:
    """Return an output's centroid as a function of the cut h of its second term, if that of its first is 1 - h."""
    shape = outline(output, Fraction)
    fits: list[tuple[Fraction, Polynomial, Polynomial]] = []  # start, area, moment
    events = _events(shape)
    for start, end in zip(events, events[1:], strict=False):
        heights = [start + (end - start) * node for node in _NODES]
        areas, moments = zip(*(clipped((1 - h, h), *shape) for h in heights), strict=True)
        fit = (_fitted(heights, areas), _fitted(heights, moments))
        if not fits or fit != fits[-1][1:]:
            fits.append((start, *fit))
    ends = term_centroids(output, Fraction)  # C(0) is of the first term alone, C(1) of the second
    raw = _forms(fits, shape.breakpoints[0], Fraction(1), ends[1])
    low, high = min(ends), max(ends)
    if low == high:
        return raw, ()
    return raw, _forms(fits, shape.breakpoints[0] - low, high - low, (ends[1] - low) / (high - low))


def _forms(
    fits: list[tuple[Fraction, Polynomial, Polynomial]], shift: Fraction, span: Fraction, last: Fraction
) -> tuple[Piece, ...]:
    """Return (moment / area + shift) / span as pieces, exact at h = 1, where it has the last value."""
    forms = []
    ends_of_fits = [*(start for start, _, _ in fits[1:]), Fraction(1)]
    for (first, area, moment), end in zip(fits, ends_of_fits, strict=True):
        for start in map(_not_below, _starts(first, end, area)):
            about = Fraction(start)  # the very number that h is measured from
            t = [about + node for node in _NODES]
            areas = _fitted(_NODES, [_at(h, area) for h in t])
            moments = _fitted(_NODES, [_at(h, moment) for h in t])
            unit = areas[0] * span  # above 0, as the area is
            n0, n1, n2, n3 = (float((m + shift * a) / unit) for m, a in zip(moments, areas, strict=True))
            d0, d1, d2, _ = (float(a * span / unit) for a in areas)
            forms.append(Piece(start, (n0, n1, n2, n3), (d0, d1, d2)))
    if evaluate((forms[-1],), 1.0) != float(last):  # rounded
        forms.append(Piece(1.0, (float(last), 0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    return tuple(forms)


def _starts(start: Fraction, end: Fraction, area: Polynomial) -> Iterator[Fraction]:
    """Yield the starts of parts of a piece: an area that is small beside the first one would be lost to rounding."""
    yield start
    middle = (start + end) / 2
    if 4 * min(_at(middle, area), _at(end, area)) < _at(start, area):
        yield from _starts(middle, end, area)


def _at(h: Fraction, polynomial: Polynomial) -> Fraction:
    return sum((c * h**i for i, c in enumerate(polynomial)), Fraction(0))


def _not_below(start: Fraction) -> float:
    """Return the least float that is not below a number, so that no float is taken for one of the next piece."""
    nearest = float(start)
    return nearest if nearest >= start else math.nextafter(nearest, math.inf)


def _events(shape: Outline) -> list[Fraction]:
    """Return 0, 1, and all h between at which two breakpoints of the envelope may meet, or one a knot."""
    levels = {Fraction(0), Fraction(1, 2)}
    levels |= {Fraction(y) for y in (*shape.left, *shape.right)}
    return sorted({h for level in levels for h in (level, 1 - level)})


def _fitted(at: Sequence[Fraction], values: Sequence[Fraction]) -> Polynomial:
    """Return the coefficients of the polynomial through some values, as Lagrange does."""
    coefficients = [Fraction(0)] * len(at)
    for x, value in zip(at, values, strict=True):
        others = [z for z in at if z != x]
        basis = [value / math.prod(x - z for z in others)]
        for z in others:  # times h - z
            basis = [up - z * own for up, own in zip([Fraction(0), *basis], [*basis, Fraction(0)], strict=True)]
        coefficients = list(map(operator.add, coefficients, basis))
    return tuple(coefficients)
