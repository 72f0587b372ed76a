"""The exact centroid of one output: a sweep over the breakpoints of its joined terms.

Between two neighbouring knots of its terms each term is a straight line. Clipped at (or scaled by) their cuts and joined by
the maximum they make a piecewise-linear outline, which can break only where a line meets a cut - its own or another
term's - or another line. Between these places it is integrated as a trapezoid.

The functions work on floats, on fractions, and in code that Numba compiles.
"""

from __future__ import annotations

from collections.abc import Sequence

from fuzzy_arbiter.definition import Variable


def outline(variable: Variable) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Return the straight pieces of a variable's terms over its universe.

    Parameters
    ----------
    variable : Variable
        An output.

    Returns
    -------
    places : tuple of float, length pieces + 1
        Ends of the universe and the knots of all terms in it, which increase.
    left : tuple of float, length pieces * terms
        Degree of each term just right of each piece's start; the terms of one piece stand together.
    right : tuple of float, length pieces * terms
        Degree of each term just left of each piece's end.
    """
    low, high = variable.universe
    knots = {x for term in variable.terms for x, _ in term.shape.points if low < x < high}
    places = (low, *sorted(knots), high)
    left, right = [], []
    for a, b in zip(places, places[1:], strict=False):
        for term in variable.terms:
            points = term.shape.points
            # the term's points around this piece, of which the ones at its ends belong to this side of a jump
            before = [p for p in points if p[0] <= a]
            after = [p for p in points if p[0] >= b]
            if not before or not after:
                left.append((before or after)[-1 if before else 0][1])
                right.append(left[-1])
                continue
            (x0, y0), (x1, y1) = before[-1], after[0]
            left.append(y0 if x0 == a else y0 + (y1 - y0) * ((a - x0) / (x1 - x0)))
            right.append(y1 if x1 == b else y0 + (y1 - y0) * ((b - x0) / (x1 - x0)))
    return places, tuple(left), tuple(right)


def centroid(
    cuts: Sequence[float],
    places: Sequence[float],
    left: Sequence[float],
    right: Sequence[float],
    scaled: bool,
) -> float:
    """Return the centroid of clipped (or scaled) terms, joined by their maximum.

    Parameters
    ----------
    cuts : sequence of float, length terms
        Degree at which each term is clipped; not all are 0.
    places, left, right
        As from `outline`.
    scaled : bool
        Whether a cut scales its term in the place of clipping it.

    Returns
    -------
    float
        Centroid, in the universe.
    """
    terms = len(cuts)
    area = moment = 0
    for piece in range(len(places) - 1):
        start = places[piece]
        width = places[piece + 1] - start
        first = piece * terms
        # where the outline may break, in shares of the piece
        breaks = [0.0, 1.0]
        for t in range(terms):
            if cuts[t] <= 0:
                continue
            a, b = left[first + t], right[first + t]
            if scaled:
                a, b = a * cuts[t], b * cuts[t]
            for u in range(terms):
                if cuts[u] <= 0:
                    continue
                if not scaled and (a < cuts[u]) != (b < cuts[u]):
                    breaks.append((cuts[u] - a) / (b - a))
                if u < t:
                    c, d = left[first + u], right[first + u]
                    if scaled:
                        c, d = c * cuts[u], d * cuts[u]
                    if (a < c) != (b < d):
                        breaks.append((c - a) / ((b - a) - (d - c)))
        breaks.sort()
        x0 = breaks[0]
        y0 = _height(cuts, left, right, first, x0, scaled)
        for x1 in breaks[1:]:
            if x1 > x0:
                y1 = _height(cuts, left, right, first, x1, scaled)
                w = (x1 - x0) * width
                area += w * (y0 + y1) / 2
                moment += w * ((start + x0 * width) * (2 * y0 + y1) + (start + x1 * width) * (y0 + 2 * y1)) / 6
                x0, y0 = x1, y1
    return moment / area


def _height(
    cuts: Sequence[float], left: Sequence[float], right: Sequence[float], first: int, share: float, scaled: bool
) -> float:
    """Height of the outline at a share of the piece whose degrees begin at `first`."""
    height = cuts[0] * 0
    for t in range(len(cuts)):
        y = left[first + t] + (right[first + t] - left[first + t]) * share
        y = y * cuts[t] if scaled else min(y, cuts[t])
        height = max(height, y)
    return height
