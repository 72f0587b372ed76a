"""Outputs of any terms, norms and defuzzifiers, for many samples at once."""

# The joined terms of a sample bend where a term does, and where a comparison in the formula of a norm changes: where a
# term meets its cut, where two cross, where a sum reaches 1. Between these points they are smooth, and Gauss-Legendre
# quadrature of one order integrates them. The ends of the panels that suit the terms are known before; a panel in which
# the joined terms of a sample bend is divided there, and one that is too rough in its middle, until the error of all
# panels is within the tolerance.

from __future__ import annotations

import itertools
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
    Indices,
    Mask,
    Panels,
    constant_panels,
    dividing,
    integrals,
    lowest_between,
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
_BLOCK = 2**18  # number of degrees that are computed at a time
_TIED = 1e-12  # sides of a comparison count as equal if their quotient differs from 1 by less
_NOISE = 4e-16  # error of a height by rounding, as a fraction of it, or of 1 where it is a difference from 1
MAXIMA = ("mom", "som", "lom")
_CLOSE = 0.2  # distance of two sides at which they may pass each other between two points, as a fraction of the greater


class Joined(NamedTuple):
    """Heights of slots at some positions, and of their join."""

    degrees: list[Array]  # of each slot's term
    implied: list[Array]  # of each slot
    joins: list[Array]  # of each slot and those before it

    @property
    def height(self) -> Array:
        """Height of the join of all slots."""
        return self.joins[-1]


class Comparison(NamedTuple):
    """A comparison in a formula by which a slot is implied or joined."""

    slot: int
    place: int  # among those of the formula
    joins: bool  # True if it is of the join
    turns: bool  # False if the difference of its sides only rises or only falls in a panel


class Quadrature(Defuzzifier):
    """The value of one output whose terms are joined."""

    def __init__(self, output: Output, slots: Sequence[Slot]) -> None:
        self.output = output
        used = sorted({slot.term for slot in slots})
        self.terms = [used.index(slot.term) for slot in slots]
        self.shapes = [s for j in used if isinstance(s := output.terms[j].shape, Membership)]
        self.implications = [T_NORMS[slot.implication] for slot in slots]
        self._join = AGGREGATIONS[output.aggregation]
        self.is_max = output.aggregation == "max"
        self.low, self.width = output.universe[0], output.universe[1] - output.universe[0]
        self.precision = 4e-16 * max(abs(self.low), abs(output.universe[1]))
        self.edges = smooth_panels(output.universe, self.shapes)
        positions = points_of(self.edges[:-1], self.edges[1:])
        if positions.size * len(self.shapes) > _MAX_TABLE:
            raise EngineError(
                f"output {output.name!r}: its {len(self.shapes)} terms need {len(positions)} panels, "
                f"expected terms and panels of a product of at most {_MAX_TABLE // len(POINTS)}"
            )
        middles = (self.edges[:-1] + self.edges[1:]) / 2
        self._constant = [
            constant_panels(shape, middles, shape.of_many(positions.ravel()).reshape(positions.shape))
            for shape in self.shapes
        ]
        self._drastic = output.aggregation == "drastic_sum" or any(s.implication == "drastic_product" for s in slots)
        table = [self._degrees(t, positions.ravel()).reshape(positions.shape) for t in range(len(self.shapes))]
        self.table = [table[t] for t in self.terms]  # degrees of each slot's term at the points of the panels
        words = [slot.implication for slot in slots]
        self.noise = _NOISE if "bounded_difference" in words else 0.0
        self._clips = [word in ("min", "nilpotent_minimum") for word in words]
        self.comparisons = [
            Comparison(slot, k, joins, joins or not self.shapes[t].monotonic)
            for slot, (norm, t) in enumerate(zip(self.implications, self.terms, strict=True))
            for operator, joins in ((norm, False), *([(self._join, True)] if slot else []))
            for k in range(len(operator.sides(0.5, 0.5)))
        ]
        self.method = self._method(words)

    def _method(self, words: Sequence[str]) -> str:
        if any(isinstance(shape, Formula) for shape in self.shapes):
            return "adaptive quadrature, without a bound, as nothing is known of a formula between its points"
        if self.output.defuzzifier == "bisector":
            return f"adaptive quadrature, halves of the area within {BOUND:g} of it, and to rounding of the position"
        if self.output.defuzzifier != "centroid":
            return "search for the maximum height, without a bound: a small error of it may move the position far"
        polynomial = all(shape.polynomial for shape in self.shapes) and set(words) <= {"min", "prod"}
        if polynomial and self.output.aggregation in ("max", "probor", "sum", "bounded_sum"):
            return "integrals of polynomials, to rounding"
        return f"adaptive quadrature, within {centroid_bound(self.output):g} of the universe's width"

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the output's values for many samples; cuts (slots, n), returns (n,)."""
        count = max(1, _BLOCK // (len(POINTS) * len(self.edges) * max(1, len(cuts))))
        blocks = (cuts[:, start : start + count] for start in range(0, cuts.shape[1], count))
        return np.concatenate([np.zeros(0), *(Samples(self, block).values() for block in blocks)])

    def joined(self, degrees: Sequence[Array], cuts: Array) -> Joined:
        """Return heights of slots and of their join, for the degrees of their terms and their cuts."""
        implied = [
            implication.array(cut, each)
            for implication, cut, each in zip(self.implications, cuts, degrees, strict=False)
        ]
        return Joined(list(degrees), implied, list(itertools.accumulate(implied, self._join.array)))

    def heights(self, positions: Array, cuts: Array, count: int | None = None) -> Joined:
        """Return heights of all slots or of the first ones at positions, for cuts that broadcast with these."""
        terms = self.terms[:count]
        known = {t: self._degrees(t, positions.ravel()).reshape(positions.shape) for t in set(terms)}
        return self.joined([known[t] for t in terms], cuts)

    def _degrees(self, t: int, positions: Array) -> Array:
        """Return degrees of a term; where operators jump at 0 and 1, those that only round to these are within them."""
        degrees = self.shapes[t].of_many(positions)
        if not self._drastic:
            return degrees
        panels = np.clip(np.searchsorted(self.edges, positions) - 1, 0, len(self.edges) - 2)
        within = ~self._constant[t][panels] & (self.edges[panels + 1] != positions) & (positions != self.low)
        return np.where(within, np.clip(degrees, 1e-300, 1.0 - 2.0**-53), degrees)

    def sides(self, one: Comparison, joined: Joined, cuts: Array) -> tuple[Array, Array]:
        """Return both sides of a comparison."""
        if one.joins:
            return self._join.sides(joined.joins[one.slot - 1], joined.implied[one.slot])[one.place]
        return self.implications[one.slot].sides(cuts[one.slot], joined.degrees[one.slot])[one.place]

    def margin(self, one: Comparison, positions: Array, cuts: Array) -> Array:
        """Return the difference of both sides of a comparison at positions."""
        if one.joins:
            left, right = self.sides(one, self.heights(positions, cuts, one.slot + 1), cuts)
        else:
            degrees = self._degrees(self.terms[one.slot], positions)
            left, right = self.implications[one.slot].sides(cuts[one.slot], degrees)[one.place]
        return np.asarray(left - right)

    def flat(self, joined: Joined, cuts: Array, panels: Indices) -> Mask:
        """Return True for panels of constant height."""
        if not self.is_max:
            return np.asarray(np.ptp(joined.height, axis=0) <= 4e-16 * joined.height.max(axis=0))
        highest = np.array([implied[4] for implied in joined.implied]).argmax(axis=0)
        result = np.zeros(len(panels), dtype=bool)
        for i, t in enumerate(self.terms):
            constant = self._constant[t][panels]
            if self._clips[i]:
                constant = constant | (joined.degrees[i][4] > cuts[i])
            result |= constant & (highest == i)
        return result


def centroid_bound(output: Output) -> float:
    """Return the bound of a centroid's error, as a fraction of the universe's width."""
    low, high = output.universe
    return max(BOUND, 1.6e-15 * max(abs(low), abs(high)) / (high - low))  # positions far from 0 are rounded more


class Samples:
    """The joined terms of n samples, for strengths of an output's slots of the shape (slots, n)."""

    def __init__(self, quad: Quadrature, cuts: Array) -> None:
        self.quad, self.cuts, self.n = quad, cuts, cuts.shape[1]
        self.of_maximum = quad.output.defuzzifier in MAXIMA

    def values(self) -> Array:
        """Return the value of each sample, shape (n,)."""
        panels, kind, low = self.panels(), self.quad.output.defuzzifier, self.quad.low
        if self.of_maximum:
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
        """Return heights at positions of some samples, shape (rows,) or (points, rows)."""
        return self.quad.heights(positions, self.cuts[:, rows])

    def panels(self) -> Panels:
        """Return panels in which the joined terms are smooth."""
        quad, finished_panels, total = self.quad, [], np.zeros(self.n)
        rows, base = np.divmod(np.arange(self.n * (len(quad.edges) - 1)), len(quad.edges) - 1)
        starts, ends = quad.edges[base], quad.edges[base + 1]
        narrowest = NARROWEST * max(abs(quad.low), abs(quad.low + quad.width), quad.width)
        for turn in range(_ROUNDS + 1):
            half, cuts, positions = (ends - starts) / 2, self.cuts[:, rows], points_of(starts, ends)
            joined = (
                quad.heights(positions, cuts) if turn else quad.joined([np.tile(t, self.n) for t in quad.table], cuts)
            )
            sums, levers, errors = integrals(joined.height)
            areas, moments = sums * half, (sums * (starts + half - quad.low) + levers * half) * half
            estimate = total + np.bincount(rows, areas, self.n)
            items, breaks = self._bends(joined, rows, starts, ends)
            is_rough = errors * 2 * half > _TOLERANCE * estimate[rows]
            is_rough[items] = False
            rough = np.flatnonzero(is_rough & (ends - starts > narrowest))
            inner, error = joined.height[INNER, rough], errors[rough]
            accurate = (error <= _NOISE * inner.max(axis=0)) | (error <= quad.noise)
            accurate |= error * half[rough] <= np.ptp(inner, axis=0) * quad.precision  # rounding of positions
            rough = rough[~accurate]
            items, breaks = np.concatenate([items, rough]), np.concatenate([breaks, (starts[rough] + ends[rough]) / 2])
            if turn == _ROUNDS:
                items, breaks = items[:0], breaks[:0]
            finished = np.ones(len(rows), dtype=bool)
            finished[items] = False
            kept = (quad.flat(joined, cuts, base), joined.height) if self.of_maximum else (finished, joined.height[:0])
            whole = Panels(rows, starts, ends, areas, moments, *kept)
            finished_panels.append(whole.chosen(finished))
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
        return Panels(*(np.concatenate(column, axis=-1) for column in zip(*finished_panels, strict=True)))

    def _bends(self, joined: Joined, rows: Indices, starts: Array, ends: Array) -> tuple[Indices, Array]:
        """Return panels, and where in them the joined terms bend."""
        wide = ends - starts > NARROWEST * 10 * self.quad.width
        events: list[tuple[Indices, Indices, Indices]] = []  # panel, the point before it, and the comparison's index
        minima: list[tuple[Indices, Array]] = []  # panels, and where two sides may meet between two points
        cuts = self.cuts[:, rows]
        for k, one in enumerate(self.quad.comparisons):
            left, right = (np.broadcast_to(x, joined.height.shape) for x in self.quad.sides(one, joined, cuts))
            margin = left - right if one.turns else left[[0, -1]] - right[[0, -1]]
            lowest, highest = margin.min(axis=0), margin.max(axis=0)
            items = np.flatnonzero(wide & (lowest < 0.0) & (highest > 0.0))
            margin, tied = (
                left[:, items] - right[:, items],
                _TIED * np.maximum(np.abs(left[:, items]), np.abs(right[:, items])),
            )
            above, below = margin > tied, margin < -tied
            change = (above[1:] & below[:-1]) | (below[1:] & above[:-1])
            if self.quad.is_max and one.joins:  # what is below later slots does not matter
                is_top = joined.joins[one.slot][:, items] == joined.height[:, items]
                change &= is_top[1:] | is_top[:-1]
            first, changed = np.nonzero(change)
            events.append((items[changed], first, np.full(len(first), k)))
            if one.turns:
                sizes = np.abs([left[4], right[4]]).max(axis=0)
                items = np.setdiff1d(
                    np.flatnonzero(wide & (np.maximum(lowest, -highest) < _CLOSE * sizes)), items[changed], True
                )
                if self.quad.is_max and one.joins:
                    items = items[(joined.joins[one.slot][:, items] == joined.height[:, items]).any(axis=0)]
                near, offset = lowest_between(np.abs(left[:, items] - right[:, items]) / sizes[items])
                items, offset = items[near], offset[near]
                minima.append((items, (starts[items] + ends[items]) / 2 + offset * (ends[items] - starts[items]) / 2))
        items, breaks = self._located(events, rows, starts, ends)
        inside = (breaks > starts[items]) & (breaks < ends[items])
        items, breaks = (np.concatenate(x) for x in zip((items[inside], breaks[inside]), *minima, strict=True))
        return items, breaks

    def _located(
        self, events: Sequence[tuple[Indices, Indices, Indices]], rows: Indices, starts: Array, ends: Array
    ) -> tuple[Indices, Array]:
        """Return the panel of each event, and where two sides are equal."""
        none = np.zeros(0, dtype=np.intp)
        items, first, compared = (np.concatenate(column) for column in zip((none, none, none), *events, strict=True))
        cuts = self.cuts[:, rows[items]]

        def margin(x: Array, which: Indices) -> Array:
            bounds = np.searchsorted(compared[which], np.arange(len(self.quad.comparisons) + 1)).tolist()
            parts = zip(self.quad.comparisons, itertools.pairwise(bounds), strict=True)
            margins = [self.quad.margin(one, x[a:b], cuts[:, which[a:b]]) for one, (a, b) in parts if a < b]
            return np.concatenate(margins)

        if not len(items):
            return none, np.zeros(0)
        before, after = points_of(starts[items], ends[items], POINTS[[first, first + 1]])
        middles, ok = roots(margin, before, after, self.quad.precision)
        return items[ok], middles[ok]
