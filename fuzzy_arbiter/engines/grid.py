"""The values of scikit-fuzzy's sampling, at a cost that does not grow with the number of points."""

# scikit-fuzzy samples the terms of an output on a grid. It adds the places where a term crosses its own cut, joins the
# clipped terms at all these places by the maximum, and integrates the straight lines between them exactly. So its
# centroid is that of the exact outline of the *sampled* terms, except in cells of the grid in which that outline breaks
# elsewhere, where a term crosses the cut of another, or another term: there it is a chord. All these places are known
# without the grid: the grid places around each break, and the own crossings.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, permutations
from typing import ClassVar

import numpy as np

from fuzzy_arbiter.definition import Output, System
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.engines.plain import beyond_plain
from fuzzy_arbiter.errors import EngineError

LEAST_AREA = float(np.finfo(np.float64).eps)  # scikit-fuzzy divides by no area less than this
_BLOCK = 4096  # number of samples that are evaluated together, so that they stay in the processor's cache
_ROUNDING = 4 * LEAST_AREA  # tolerance of degrees


class GridEngine(Engine):
    """Compute the centroid that scikit-fuzzy gives on `System.points` points, to rounding."""

    # For the two triangles of section VI, with D the distance of two points as a part of the universe, the centroid is
    # at most D^2/6 of the universe off the exact one, and a range-normalized weight D^2/2: 1.7e-5 and 5e-5 at 101
    # points.
    #
    # As in sampling, a jump of an output's term becomes a slope over one cell, and a knot between two points is cut
    # off. Terms of inputs are not sampled. Areas below 2.2e-16 count as that much, as they do in scikit-fuzzy.

    name: ClassVar[str] = "grid"

    def __init__(self, system: System) -> None:
        require_plain(system, self.name, curved_inputs=True)
        self._pieces = [_pieces(output, system.points) for output in system.outputs]
        super().__init__(system)

    def centroid(self, k: int, cuts: Sequence[float]) -> float:
        """Return the centroid of an output as scikit-fuzzy gives it."""
        area = moment = 0.0
        for piece in self._pieces[k]:
            shares = [0.0, 1.0]
            for t, left, rise in piece.own:
                shares.append(min(max((cuts[t] - left) / rise, 0.0), 1.0))
            for u, left, rise in piece.foreign:
                cell = math.floor(min(max((cuts[u] - left) / rise * piece.cells, 0.0), piece.cells - 1.0))
                shares += cell / piece.cells, (cell + 1.0) / piece.cells
            shares.sort()
            # twice the area and six times the moment of the trapezoids, in shares of the piece
            x0 = y0 = twice = sixfold = 0.0
            for x1 in shares:
                y1 = 0.0
                for t, left, rise in piece.terms:
                    y = left + rise * x1
                    cut = cuts[t]
                    if y > cut:
                        y = cut
                    if y > y1:
                        y1 = y
                width = x1 - x0
                height = y0 + y1
                twice += width * height
                sixfold += width * (x0 * (height + y0) + x1 * (height + y1))
                x0, y0 = x1, y1
            area += piece.width / 2.0 * twice
            moment += piece.start * piece.width / 2.0 * twice + piece.width * piece.width / 6.0 * sixfold
        low = self.system.outputs[k].universe[0]
        return low + moment / area if area >= LEAST_AREA else (low * area + moment) / LEAST_AREA

    def centroid_of_many(self, k: int, cuts: Array) -> Array:
        """Return the centroids of an output for many samples, each to the last bit as for that sample alone."""
        result = np.empty(cuts.shape[1])
        low = self.system.outputs[k].universe[0]
        for first in range(0, len(result), _BLOCK):
            block = cuts[:, first : first + _BLOCK]
            if block.shape[1] == 1:  # NumPy sums a single column in another order
                result[first] = self.centroid(k, block[:, 0].tolist())
                continue
            area, moment = _integrals(self._pieces[k], block)
            result[first : first + _BLOCK] = np.where(
                area >= LEAST_AREA, low + moment / np.maximum(area, LEAST_AREA), (low * area + moment) / LEAST_AREA
            )
        return result


Line = tuple[int, float, float]  # a cut's index, a term's degree where the piece begins, and its rise over the piece


@dataclass(frozen=True, slots=True)
class _Piece:
    """A part of a universe, from one grid place to another, in which every sampled term is a straight line."""

    # If it has more than one cell, no two of the terms cross in it.

    start: float  # distance of its start from the universe's least place
    width: float
    cells: int  # number of grid cells
    terms: tuple[Line, ...]  # terms that are not 0
    own: tuple[Line, ...]  # terms that may cross their own cut
    foreign: tuple[Line, ...]  # terms that may cross the cut of a higher term, with that cut's index


def require_plain(system: System, engine: str, curved_inputs: bool) -> None:
    """Require that scikit-fuzzy supports a system."""
    if system.implication != "min":
        raise EngineError(
            f"engine {engine!r}: implication is {system.implication!r}, which scikit-fuzzy does not know; "
            "expected 'min', or engine 'exact'"
        )
    if reason := beyond_plain(system, curved_inputs):
        raise EngineError(f"engine {engine!r}: {reason}, or engine 'exact'")


def sampled(output: Output, points: int) -> tuple[Array, Array]:
    """Return the places at which scikit-fuzzy samples an output, and the terms there; returns (points,)."""
    grid = np.linspace(*output.universe, points)
    if not (np.diff(grid) > 0.0).all():
        raise EngineError(f"output {output.name!r}: {points} points do not fit in {output.universe}")
    samples = np.array([term.membership.of_many(grid) for term in output.terms])
    for term, degrees in zip(output.terms, samples, strict=True):
        if not degrees.any():
            raise EngineError(
                f"output {output.name!r}: term {term.name!r} is 0 at all {points} points; expected more points"
            )
    return grid, samples


def _pieces(output: Output, points: int) -> tuple[_Piece, ...]:
    """Return the parts of an output's grid in which the sampled terms are straight lines that do not cross."""
    grid, samples = sampled(output, points)
    bends = _bends(output, grid, samples)
    ends = set(bends)
    for a, b in zip(bends, bends[1:], strict=False):
        for left, right in combinations(samples[:, [a, b]].tolist(), 2):
            before, after = left[0] - right[0], left[1] - right[1]
            if before * after < 0.0:
                place = a + (b - a) * (before / (before - after))
                ends |= {math.floor(place), math.ceil(place)}
    order = sorted(ends)
    pieces = [_piece(grid, samples, a, b) for a, b in zip(order, order[1:], strict=False)]
    return tuple(piece for piece in pieces if piece.terms)


def _bends(output: Output, grid: Array, samples: Array) -> list[int]:
    """Return the grid's ends and the grid places where a sampled term bends by more than rounding."""
    last = len(grid) - 1
    knots = [x for term in output.terms for x, _ in term.straight.points]
    # the term may bend at both ends of a cell with a knot, and on both sides of a jump at a grid place
    nearest = {int(i) + side for i in np.searchsorted(grid, knots) for side in (-1, 0, 1)}
    candidates = [*sorted(i for i in nearest if 0 < i < last), last]
    found = [0]
    for place, following in zip(candidates, candidates[1:], strict=False):
        before = found[-1]
        share = (place - before) / (following - before)
        line = samples[:, before] + (samples[:, following] - samples[:, before]) * share
        if (np.abs(samples[:, place] - line) > _ROUNDING).any():
            found.append(place)
    return [*found, last]


def _piece(grid: Array, samples: Array, a: int, b: int) -> _Piece:
    """Return the piece between two indices of a grid, with the lines that can cross a cut in it."""
    ends = samples[:, [a, b]].tolist()
    terms = [(t, left, right - left) for t, (left, right) in enumerate(ends) if max(left, right) > 0.0]
    own = [line for line in terms if line[2] != 0.0]
    # one term's line breaks the outline at another's cut only where the other is higher
    foreign = [
        (u, left, rise)
        for (t, left, rise), (u, other, other_rise) in permutations(terms, 2)
        if b - a > 1 and rise != 0.0 and (other > left or other + other_rise > left + rise)
    ]
    # a term must reach its cut where it crosses it, or a low cut would lose its edges to rounding
    padded = [(t, left + _ROUNDING, rise) for t, left, rise in terms]
    start, width = float(grid[a] - grid[0]), float(grid[b] - grid[a])
    return _Piece(start, width, b - a, tuple(padded), tuple(own), tuple(foreign))


@np.errstate(over="ignore")  # a share on a line that hardly rises may overflow: it is beyond the piece in any case
def _integrals(pieces: Sequence[_Piece], cuts: Array) -> tuple[Array, Array]:
    """Return area and moment about the universe's least place for cuts of shape (terms, n)."""
    n = cuts.shape[1]
    area, moment = np.zeros(n), np.zeros(n)
    for piece in pieces:
        shares = np.empty((2 + len(piece.own) + 2 * len(piece.foreign), n))
        shares[0] = 0.0
        shares[-1] = 1.0
        i = 1
        for t, left, rise in piece.own:
            np.clip((cuts[t] - left) / rise, 0.0, 1.0, out=shares[i])
            i += 1
        for u, left, rise in piece.foreign:
            cell = np.floor(np.clip((cuts[u] - left) / rise * piece.cells, 0.0, piece.cells - 1.0))
            np.divide(cell, piece.cells, out=shares[i])
            np.divide(cell + 1.0, piece.cells, out=shares[i + 1])
            i += 2
        shares[1:-1].sort(axis=0)
        heights = np.zeros_like(shares)
        for t, left, rise in piece.terms:
            np.maximum(heights, np.minimum(left + rise * shares, cuts[t]), out=heights)
        x0, x1, y0, y1 = shares[:-1], shares[1:], heights[:-1], heights[1:]
        width = x1 - x0
        height = y0 + y1
        twice = (width * height).sum(axis=0)
        sixfold = (width * (x0 * (height + y0) + x1 * (height + y1))).sum(axis=0)
        area += piece.width / 2.0 * twice
        moment += piece.start * piece.width / 2.0 * twice + piece.width * piece.width / 6.0 * sixfold
    return area, moment
