"""The centroid of an output of two terms, cut at 1 - h and h, as a function of h: cubic over quadratic, in pieces."""

# The places where the envelope of the two clipped terms breaks move linearly with h, so that its area is a quadratic
# and its moment a cubic of h as long as no two of them meet and none passes a knot. Between these values of h both
# polynomials are fitted to exact values, in fractions.

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.clipped_centroid import Outline, clipped, outline, term_centroids

Polynomial = tuple[Fraction, ...]  # coefficients of t^0, t^1, ..


@dataclass(frozen=True, slots=True)
class Piece:
    """A piece of C(h): a cubic over a quadratic of t = h - start."""

    start: float  # start of the piece; its end is the start of the next one, and that of the last one 1
    numerator: tuple[float, ...]  # coefficients of t^0 to t^3
    denominator: tuple[float, ...]  # coefficients of t^0 to t^2; (1, 0, 0) if it is constant

    def __call__(self, h: float) -> float:
        """Return C(h)."""
        t = h - self.start
        n0, n1, n2, n3 = self.numerator
        d0, d1, d2 = self.denominator
        return (n0 + t * (n1 + t * (n2 + t * n3))) / (d0 + t * (d1 + t * d2))


def pieces(output: Output) -> tuple[tuple[Piece, ...], tuple[Piece, ...]]:
    """Return an output's centroid as a function of the cut h of its second term, if that of its first is 1 - h."""
    shape = outline(output, Fraction)
    fits: list[tuple[Fraction, Polynomial, Polynomial]] = []  # start, area, moment
    events = _events(shape)
    for start, end in zip(events, events[1:], strict=False):
        at = [start + (end - start) * Fraction(i, 3) for i in range(4)]
        areas, moments = zip(*(clipped((1 - h, h), *shape) for h in at), strict=True)
        fit = (_fitted(at, areas), _fitted(at, moments))
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
            above = _about(about, [m + shift * a for m, a in zip(moment, area, strict=True)])
            below = _about(about, [a * span for a in area])
            unit = below[0]  # above 0, as the area is
            forms.append(Piece(start, tuple(float(c / unit) for c in above), tuple(float(c / unit) for c in below[:3])))
    if forms[-1](1.0) != float(last):  # rounded
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
    """Return the coefficients of the polynomial through some values, by Newton's divided differences."""
    differences = list(values)
    for order in range(1, len(at)):
        for i in range(len(at) - 1, order - 1, -1):
            differences[i] = (differences[i] - differences[i - 1]) / (at[i] - at[i - order])
    coefficients = [Fraction(0)] * len(at)
    for place, difference in zip(reversed(at), reversed(differences), strict=True):
        # multiply by (h - place), add the difference
        shifted = [Fraction(0), *coefficients[:-1]]
        coefficients = [s - place * c for s, c in zip(shifted, coefficients, strict=True)]
        coefficients[0] += difference
    return tuple(coefficients)


def _about(start: Fraction, polynomial: Sequence[Fraction]) -> Polynomial:
    """Return the coefficients of the same polynomial in t = h - start."""
    coefficients = list(polynomial)
    for low in range(len(coefficients)):
        for i in range(len(coefficients) - 2, low - 1, -1):
            coefficients[i] += start * coefficients[i + 1]
    return tuple(coefficients)
