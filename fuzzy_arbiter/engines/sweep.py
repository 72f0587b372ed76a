"""The exact centroid of one output: a sweep over the breakpoints of its joined terms.

Between two neighbouring knots of its terms each term is a straight line. Clipped at (or scaled by) their cuts and
joined by the maximum they make a piecewise-linear envelope, which can break only where a line meets a cut - its own or
another term's - or another line. Between these places it is integrated as a trapezoid.

The functions work on floats and on fractions alike; Numba compiles them as they are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from fuzzy_arbiter.definition import Variable

Numbers = Sequence[Any]  # all floats, or all fractions
TINY = 1e-120  # if no cut is greater, all are made larger alike: the centroid stays, and nothing underflows
LARGER = 2.0**266


class Outline(NamedTuple):
    """The straight pieces of a variable's terms over its universe.

    Attributes
    ----------
    places : tuple of float, length pieces + 1
        Knots of the variable.
    left, right : tuple of float, length pieces * terms
        Degree of each term just right of each piece's start, and just left of its end; those of a piece stand together.
    """

    places: tuple[Any, ...]
    left: tuple[Any, ...]
    right: tuple[Any, ...]


def outline(variable: Variable, number: Callable[[float], Any] = float) -> Outline:
    """Return the straight pieces of a variable's terms over its universe.

    Parameters
    ----------
    variable : Variable
        An output.
    number : callable
        `float`, or `fractions.Fraction` for exact results.

    Returns
    -------
    Outline
        In these numbers.
    """
    places = tuple(map(number, variable.knots))
    shapes = [[(number(x), number(y)) for x, y in term.straight.points] for term in variable.terms]
    left, right = [], []
    for a, b in zip(places, places[1:], strict=False):
        for points in shapes:
            # the last point before and the first one after, so that at a jump each piece sees its own side
            before = [p for p in points if p[0] <= a] or points[:1]
            after = [p for p in points if p[0] >= b] or points[-1:]
            (x0, y0), (x1, y1) = before[-1], after[0]
            slope = (y1 - y0) / (x1 - x0) if x0 < x1 else y1 - y1
            left.append(y0 + slope * (a - x0) if x0 < a else y0)
            right.append(y1 + slope * (b - x1) if b < x1 else y1)
    return Outline(places, tuple(left), tuple(right))


def area_and_moment(cuts: Numbers, places: Numbers, left: Numbers, right: Numbers, scaled: bool) -> tuple[Any, Any]:
    """Return the area under the envelope of clipped (or scaled) terms, and its moment.

    Parameters
    ----------
    cuts : sequence of float, length terms
        Degree at which each term is clipped.
    places, left, right
        As of `Outline`.
    scaled : bool
        Whether a cut scales its term in the place of clipping it.

    Returns
    -------
    area : float
        Integral of the envelope over the universe.
    moment : float
        Integral of the envelope times the place's distance from the start of the universe.
    """
    zero = cuts[0] * 0
    one = zero + 1
    terms = len(cuts)
    area = moment = zero
    for piece in range(len(places) - 1):
        first = piece * terms
        width = places[piece + 1] - places[piece]
        start = places[piece] - places[0]
        # where the envelope may break, in shares of the piece
        breaks = [zero, one]
        for t in range(terms):
            a, b = left[first + t], right[first + t]
            if scaled:
                a, b = a * cuts[t], b * cuts[t]
            for u in range(terms):
                if not scaled and (a < cuts[u]) != (b < cuts[u]):
                    breaks.append((a - cuts[u]) / ((a - cuts[u]) - (b - cuts[u])))
                if u < t:
                    c, d = left[first + u], right[first + u]
                    if scaled:
                        c, d = c * cuts[u], d * cuts[u]
                    if (a < c) != (b < d):  # so that the two differences have not one sign, nor are both 0
                        breaks.append((a - c) / ((a - c) - (b - d)))
        breaks.sort()
        x0 = zero
        for x1 in breaks:
            if x0 < x1:
                y0, y1 = envelope(cuts, left, right, first, x0, x1, scaled)
                w = (x1 - x0) * width
                area += w * (y0 + y1) / 2
                moment += w * ((start + x0 * width) * (2 * y0 + y1) + (start + x1 * width) * (y0 + 2 * y1)) / 6
                x0 = x1
    return area, moment


def envelope(
    cuts: Numbers, left: Numbers, right: Numbers, first: int, x0: Any, x1: Any, scaled: bool
) -> tuple[Any, Any]:
    """Return the heights of the envelope at both ends of a part of a piece, in which it is one straight line.

    Which line that is the middle tells. At an end it would be lost to rounding: where a term falls to its low cut its
    degree is known to no more than the rounding of 1, and may seem far below the cut.

    Parameters
    ----------
    cuts, left, right, scaled
        As of `area_and_moment`.
    first : int
        Where the piece's degrees begin.
    x0, x1 : float
        Ends of the part, in shares of the piece.

    Returns
    -------
    y0, y1 : float
        Clipped (or scaled) degrees of the term that is the greatest between them.
    """
    middle = (x0 + x1) / 2
    height = y0 = y1 = cuts[0] * 0
    for t in range(len(cuts)):
        a, cut = left[first + t], cuts[t]
        rise = right[first + t] - a
        degree = a + rise * middle
        if scaled:
            if degree * cut > height:
                height, y0, y1 = degree * cut, (a + rise * x0) * cut, (a + rise * x1) * cut
        elif degree >= cut:
            if cut > height:
                height, y0, y1 = cut, cut, cut
        elif degree > height:
            height, y0, y1 = degree, a + rise * x0, a + rise * x1
    return y0, y1


def centroid(cuts: Numbers, places: Numbers, left: Numbers, right: Numbers, scaled: bool) -> Any:
    """Return the centroid of clipped (or scaled) terms, joined by their maximum.

    Parameters
    ----------
    cuts : sequence of float, length terms
        Degree at which each term is clipped; not all are 0.
    places, left, right, scaled
        As of `area_and_moment`.

    Returns
    -------
    float
        Centroid, in the universe.
    """
    largest = cuts[0]
    for cut in cuts:
        largest = max(largest, cut)
    if largest < TINY:
        larger = [cut * LARGER for cut in cuts]
        area, moment = area_and_moment(larger, places, left, right, scaled)
    else:
        area, moment = area_and_moment(cuts, places, left, right, scaled)
    return places[0] + moment / area


def alone(output: Variable, number: Callable[[float], Any] = float) -> list[Any]:
    """Return the centroid of each of an output's terms, alone and whole.

    Parameters
    ----------
    output : Variable
        An output.
    number : callable
        `float`, or `fractions.Fraction` for exact results.

    Returns
    -------
    list of float
        In the order of the terms.
    """
    shape = outline(output, number)
    n = len(output.terms)
    return [centroid([number(i == j) for i in range(n)], *shape, False) for j in range(n)]
