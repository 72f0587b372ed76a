"""Outputs of any terms, norms and defuzzifiers, for many samples at once."""

# The joined terms of a sample bend where a term does, and where a comparison in the formula of a norm changes: where a
# term meets its cut, where two cross, where a sum reaches 1. Between these points they are smooth, and Gauss-Legendre
# quadrature of one order integrates them. The ends of the panels that suit the terms are known before; a panel in which
# the joined terms of a sample bend is divided there, and one that is too rough in its middle, until the error of all
# panels is within the tolerance.

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines import defuzzification
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.engines.firing import Slot
from fuzzy_arbiter.engines.panels import (
    INNER,
    NARROWEST,
    POINTS,
    WEIGHTS,
    Indices,
    Mask,
    Panels,
    constant_panels,
    dividing,
    lowest_between,
    mean_errors,
    points_of,
    roots,
    smooth_panels,
)
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array, Membership
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS
from fuzzy_arbiter.terms.values import Formula

BOUND = 1e-9  # bound of a centroid's error, as a fraction of the universe's width
_TOLERANCE = 1e-12  # tolerance of each panel, as a fraction of the area
_ROUNDS = 60  # maximum number of divisions of a panel
_MAX_PANELS = 4000  # maximum number of panels of a sample that are divided at a time
_MAX_TABLE = 2**25  # maximum number of degrees at the points of the terms' panels
_BLOCK = 2**17  # number of degrees that are computed at a time
_TIED = 1e-12  # sides of a comparison count as equal if their quotient differs from 1 by less
_NOISE = 4e-16  # error of a height by rounding, as a fraction of it, or of 1 where it is a difference from 1
_CLOSE = 0.2  # distance of two sides at which they may pass each other between two points, as a fraction of the greater


class Sides(NamedTuple):
    """Both sides of a comparison in a formula by which a slot is implied or joined."""

    slot: int
    turns: bool  # False if their difference only rises or only falls in a panel
    left: Array
    right: Array


class Joined(NamedTuple):
    """Heights of the slots at some positions, and of their join."""

    degrees: list[Array]  # of each term
    implied: list[Array]  # of each slot
    joins: list[Array]  # of each slot and those before it
    sides: list[Sides]

    @property
    def height(self) -> Array:
        """Height of the join of all slots."""
        return self.joins[-1]


class Quadrature(Defuzzifier):
    """The value of one output whose terms are joined."""

    def __init__(self, output: Output, slots: Sequence[Slot]) -> None:
        self.output = output
        used = sorted({slot.term for slot in slots})
        self._term = [used.index(slot.term) for slot in slots]
        self._shapes = [s for j in used if isinstance(s := output.terms[j].shape, Membership)]
        self.implications = [T_NORMS[slot.implication] for slot in slots]
        self._join = AGGREGATIONS[output.aggregation]
        self.is_max = output.aggregation == "max"
        self.low, self.width = output.universe[0], output.universe[1] - output.universe[0]
        self.precision = 4e-16 * max(abs(self.low), abs(output.universe[1]))
        self.edges = smooth_panels(output.universe, self._shapes)
        positions = points_of(self.edges[:-1], self.edges[1:])
        if positions.size * len(self._shapes) > _MAX_TABLE:
            raise EngineError(
                f"output {output.name!r}: its {len(self._shapes)} terms need {len(positions)} panels, "
                f"expected terms and panels of a product of at most {_MAX_TABLE // len(POINTS)}"
            )
        middles = (self.edges[:-1] + self.edges[1:]) / 2
        self._constant = [
            constant_panels(shape, middles, shape.of_many(positions.ravel()).reshape(positions.shape))
            for shape in self._shapes
        ]
        self._drastic = output.aggregation == "drastic_sum" or any(s.implication == "drastic_product" for s in slots)
        self._table = self._all_degrees(positions)
        words = [slot.implication for slot in slots]
        self.noise = _NOISE if "bounded_difference" in words else 0.0
        self._clips = [word in ("min", "nilpotent_minimum") for word in words]
        self._turns = [not self._shapes[t].monotonic for t in self._term]
        self.method = self._method(words)

    def _method(self, words: Sequence[str]) -> str:
        if any(isinstance(shape, Formula) for shape in self._shapes):
            return "adaptive quadrature, without a bound, as nothing is known of a formula between its points"
        if self.output.defuzzifier == "bisector":
            return f"adaptive quadrature, halves of the area within {BOUND:g} of it, and to rounding of the position"
        if self.output.defuzzifier != "centroid":
            return "search for the maximum height, without a bound: a small error of it may move the position far"
        polynomial = all(shape.polynomial for shape in self._shapes) and set(words) <= {"min", "prod"}
        if polynomial and self.output.aggregation in ("max", "probor", "sum", "bounded_sum"):
            return "integrals of polynomials, to rounding"
        return f"adaptive quadrature, within {centroid_bound(self.output):g} of the universe's width"

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the output's values for many samples; cuts (slots, n), returns (n,)."""
        count = max(1, _BLOCK // (len(POINTS) * len(self.edges) * max(1, len(cuts))))
        result = np.empty(cuts.shape[1])
        for start in range(0, len(result), count):
            result[start : start + count] = Samples(self, cuts[:, start : start + count]).values()
        return result

    def joined(self, degrees: list[Array], cuts: Array) -> Joined:
        """Return heights of the slots and of their join, for degrees of the terms and cuts of the slots."""
        result = Joined(degrees, [], [], [])
        height = np.zeros(degrees[0].shape)
        for i, (implication, cut, t) in enumerate(zip(self.implications, cuts, self._term, strict=True)):
            implied = implication.array(cut, degrees[t])
            result.sides.extend(Sides(i, self._turns[i], *sides) for sides in implication.sides(cut, degrees[t]))
            if i:
                result.sides.extend(Sides(i, True, *sides) for sides in self._join.sides(height, implied))
            height = self._join.array(height, implied)
            result.implied.append(implied)
            result.joins.append(height)
        return result

    def heights(self, positions: Array, cuts: Array) -> Joined:
        """Return heights at positions, an array of any shape, for cuts of the same shape."""
        return self.joined(self._all_degrees(positions), cuts)

    def _all_degrees(self, positions: Array) -> list[Array]:
        return [self._degrees(t, positions.ravel()).reshape(positions.shape) for t in range(len(self._shapes))]

    def _degrees(self, t: int, positions: Array) -> Array:
        """Return degrees of a term; where operators jump at 0 and 1, those that only round to these are within them."""
        degrees = self._shapes[t].of_many(positions)
        if not self._drastic:
            return degrees
        panels = np.clip(np.searchsorted(self.edges, positions) - 1, 0, len(self.edges) - 2)
        within = ~self._constant[t][panels] & (self.edges[panels + 1] != positions) & (positions != self.low)
        return np.where(within, np.clip(degrees, 1e-300, 1.0 - 2.0**-53), degrees)

    def tabled(self, rows: Indices, panels: Indices, cuts: Array) -> Joined:
        """Return heights at the points of the terms' own panels."""
        return self.joined([table[panels] for table in self._table], cuts[:, rows][..., None])

    def flat(self, joined: Joined, cuts: Array, panels: Indices) -> Mask:
        """Return True for panels of constant height."""
        if not self.is_max:
            return np.asarray(np.ptp(joined.height, axis=1) <= 4e-16 * joined.height.max(axis=1))
        middles = np.array([implied[:, 4] for implied in joined.implied])
        result = np.zeros(len(panels), dtype=bool)
        for i, t in enumerate(self._term):
            constant = self._constant[t][panels]
            if self._clips[i]:
                constant = constant | (joined.degrees[t][:, 4] > cuts[i, :, 0])
            result |= constant & (middles.argmax(axis=0) == i)
        return result


def centroid_bound(output: Output) -> float:
    """Return the bound of a centroid's error, as a fraction of the universe's width."""
    low, high = output.universe
    return max(BOUND, 1.6e-15 * max(abs(low), abs(high)) / (high - low))  # positions far from 0 are rounded more


class Samples:
    """The joined terms of n samples, for strengths of an output's slots of the shape (slots, n)."""

    def __init__(self, quad: Quadrature, cuts: Array) -> None:
        self.quad, self.cuts, self.n = quad, cuts, cuts.shape[1]

    def values(self) -> Array:
        """Return the value of each sample, shape (n,)."""
        panels, kind, low = self.panels(), self.quad.output.defuzzifier, self.quad.low
        if kind in ("mom", "som", "lom"):
            return defuzzification.of_maximum(self, panels, kind)
        areas = np.bincount(panels.rows, panels.areas, self.n).astype(np.float64)
        some = areas > 0.0
        if kind == "bisector":
            result = defuzzification.bisectors(self, panels, areas)
        else:
            moments = np.bincount(panels.rows, panels.moments, self.n)
            result = np.clip(
                low + np.divide(moments, areas, out=np.zeros(self.n), where=some), *self.quad.output.universe
            )
        for row in np.flatnonzero(~some).tolist():
            result[row] = defuzzification.of_points(self.quad, self.cuts[:, row])
        return result

    def heights(self, positions: Array, rows: Indices) -> Joined:
        """Return heights at positions of some samples, shape (rows,) or (rows, points)."""
        cuts = self.cuts[:, rows]
        return self.quad.heights(positions, cuts if positions.ndim == 1 else cuts[..., None])

    def panels(self) -> Panels:
        """Return panels in which the joined terms are smooth."""
        quad, finished_panels, total = self.quad, [], np.zeros(self.n)
        rows, base = np.divmod(np.arange(self.n * (len(quad.edges) - 1)), len(quad.edges) - 1)
        starts, ends = quad.edges[base], quad.edges[base + 1]
        narrowest = NARROWEST * max(abs(quad.low), abs(quad.low + quad.width), quad.width)
        for turn in range(_ROUNDS + 1):
            positions = points_of(starts, ends)
            joined = self.heights(positions, rows) if turn else quad.tabled(rows, base, self.cuts)
            inner, half = np.ascontiguousarray(joined.height[:, INNER]), (ends - starts) / 2
            areas = (inner * WEIGHTS).sum(axis=-1) * half
            moments = (inner * WEIGHTS * (positions[:, INNER] - quad.low)).sum(axis=-1) * half
            estimate = total + np.bincount(rows, areas, self.n)
            items, breaks = self._bends(joined, rows, starts, ends, positions)
            errors = mean_errors(joined.height)
            accurate = errors * 2 * half <= _TOLERANCE * estimate[rows]
            accurate |= (errors <= _NOISE * inner.max(axis=1)) | (errors <= quad.noise) | (ends - starts <= narrowest)
            accurate |= errors * half <= np.ptp(inner, axis=1) * quad.precision  # rounding of positions
            accurate[items] = True
            rough = np.flatnonzero(~accurate)
            items, breaks = np.concatenate([items, rough]), np.concatenate([breaks, (starts[rough] + ends[rough]) / 2])
            if turn == _ROUNDS:
                items, breaks = items[:0], breaks[:0]
            finished = np.ones(len(rows), dtype=bool)
            finished[items] = False
            flat = quad.flat(joined, self.cuts[:, rows][..., None], base)
            finished_panels.append(Panels(rows, starts, ends, joined.height, flat, areas, moments).chosen(finished))
            total = total + np.bincount(rows[finished], areas[finished], self.n)
            if len(items) == 0:
                break
            if len(items) > _MAX_PANELS * self.n:
                raise EngineError(
                    f"output {quad.output.name!r}: its joined terms are too rough to be integrated to {BOUND:g} of "
                    "its universe; expected smoother terms"
                )
            parents, starts, ends = dividing(items, breaks, starts, ends)
            rows, base = rows[parents], base[parents]
        return Panels(*map(np.concatenate, zip(*finished_panels, strict=True)))

    def _bends(
        self, joined: Joined, rows: Indices, starts: Array, ends: Array, positions: Array
    ) -> tuple[Indices, Array]:
        """Return panels, and where in them the joined terms bend."""
        wide = ends - starts > NARROWEST * 10 * self.quad.width
        events: list[tuple[Indices, Indices, Indices]] = []  # panel, the point before it, and the comparison's index
        minima: list[tuple[Indices, Array]] = []  # panels, and where two sides may meet between two points
        for k, (slot, turns, left, right) in enumerate(joined.sides):
            margin, sizes = np.abs(left - right), np.maximum(np.abs(left), np.abs(right))
            above = (left > right) & (margin > _TIED * sizes)
            below = (left < right) & (margin > _TIED * sizes)
            change = (above[:, 1:] & below[:, :-1]) | (below[:, 1:] & above[:, :-1])
            change &= wide[:, None]
            chosen = wide
            if self.quad.is_max:  # what is below later slots does not matter
                is_top = joined.joins[slot] == joined.height
                change &= is_top[:, 1:] | is_top[:, :-1]
                chosen = wide & is_top.any(axis=1)
            items, first = np.nonzero(change)
            events.append((items, first, np.full(len(items), k)))
            if turns:
                size = sizes.max(axis=1)
                items = np.flatnonzero(chosen & ~change.any(axis=1) & (margin.min(axis=1) < _CLOSE * size))
                near, offset = lowest_between(margin[items] / size[items][:, None])
                items, offset = items[near], offset[near]
                minima.append((items, (starts[items] + ends[items]) / 2 + offset * (ends[items] - starts[items]) / 2))
        items, breaks = self._located(events, rows, positions)
        inside = (breaks > starts[items]) & (breaks < ends[items])
        items, breaks = (np.concatenate(x) for x in zip((items[inside], breaks[inside]), *minima, strict=True))
        return items, breaks

    def _located(
        self, events: Sequence[tuple[Indices, Indices, Indices]], rows: Indices, positions: Array
    ) -> tuple[Indices, Array]:
        """Return the panel of each event, and where two sides are equal."""
        none = np.zeros(0, dtype=np.intp)
        items, first, compared = (np.concatenate(column) for column in zip((none, none, none), *events, strict=True))

        def margin(x: Array, which: Indices) -> Array:
            sides = self.heights(x, rows[items[which]]).sides
            margins = np.array([np.broadcast_to(left - right, x.shape) for _, _, left, right in sides])
            return np.asarray(margins[compared[which], np.arange(len(x))])

        if not len(items):
            return none, np.zeros(0)
        middles, ok = roots(margin, positions[items, first], positions[items, first + 1], self.quad.precision)
        return items[ok], middles[ok]
