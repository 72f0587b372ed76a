"""Outputs of any terms, norms and defuzzifiers, for many samples at once."""

# The joined terms of a sample bend where a term does, where one meets its cut, and where two cross. Between these
# points they are smooth, and Gauss-Legendre quadrature of one order integrates them. The ends of the panels that
# suit the terms are known before; a panel in which the joined terms of a sample bend is divided there, and one that is
# too rough in its middle, until the error of all panels is within the tolerance.

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
_TIED = 1e-12  # heights count as equal if their quotient differs from 1 by less
_NOISE = 4e-16  # error of a height by rounding, as a fraction of it, or of 1 where it is a difference from 1
_CLOSE = 0.2  # distance below the maximum height at which a slot may pass it between two points
_LEVEL, _PAIR, _FULL, _PASSED = range(4)  # a slot meets a level, another slot; it and those before sum to 1, are equal


class Events(NamedTuple):
    """Points where the joined terms bend, each between two quadrature points, before they are located."""

    items: Indices  # panel of each
    first: Indices  # the point before it
    kinds: Indices  # `_LEVEL`, `_PAIR`, `_FULL` or `_PASSED`
    one: Indices  # its level, or its slot
    other: Indices  # the other slot of a pair


class Joined(NamedTuple):
    """Heights of the slots at some positions, and of their join."""

    degrees: list[Array]  # of each term
    implied: list[Array]  # of each slot
    before: list[Array]  # join of the slots before each; for operators that bend where sums reach 1
    height: Array


class Quadrature(Defuzzifier):
    """The value of one output whose terms are joined."""

    def __init__(self, output: Output, slots: Sequence[Slot]) -> None:
        self.output = output
        used = sorted({slot.term for slot in slots})
        self._term = [used.index(slot.term) for slot in slots]
        self._shapes = [s for j in used if isinstance(s := output.terms[j].shape, Membership)]
        self._implications = [T_NORMS[slot.implication].array for slot in slots]
        self._join = AGGREGATIONS[output.aggregation].array
        self._max = output.aggregation == "max"
        self._sums = output.aggregation in ("bounded_sum", "normalized_sum", "nilpotent_maximum")
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
        # slot and True for its cut, False for 1 less its cut: levels of its term's degree at which its height bends
        words = [slot.implication for slot in slots]
        self._levels = [
            *((i, True) for i, word in enumerate(words) if word in ("min", "nilpotent_minimum")),
            *((i, False) for i, word in enumerate(words) if word in ("bounded_difference", "nilpotent_minimum")),
        ]
        self._jumps = "nilpotent_minimum" in words
        self.noise = _NOISE if "bounded_difference" in words else 0.0
        self._clip = {i: e for e, (i, cuts) in enumerate(self._levels) if cuts}
        self._turning = [not self._shapes[self._term[i]].monotonic for i, _ in self._levels]
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
        slots = zip(self._implications, cuts, self._term, strict=True)
        implied = [implication(cut, degrees[t]) for implication, cut, t in slots]
        height, before = np.zeros(degrees[0].shape), []
        for one in implied:
            before += [height] if self._sums else []
            height = np.asarray(self._join(height, one))
        return Joined(degrees, implied, before, height)

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

    def level(self, event: int, cuts: Array) -> Array:
        """Return the degree at which a slot's height bends."""
        i, is_cut = self._levels[event]
        return np.asarray(cuts[i] if is_cut else 1.0 - cuts[i])

    def margins(self, joined: Joined, cuts: Array, kinds: Indices, one: Indices, other: Indices) -> Array:
        """Return for each position a value whose sign changes at its event, for heights of the shape (positions,)."""
        result, indices = np.empty(len(kinds)), np.arange(len(kinds))
        implied = np.array(joined.implied)
        for event in range(len(self._levels)):
            mine = (kinds == _LEVEL) & (one == event)
            result[mine] = (joined.degrees[self._term[self._levels[event][0]]] - self.level(event, cuts))[mine]
        pairs, slots = kinds == _PAIR, np.where(kinds == _LEVEL, 0, one)
        result[pairs] = (implied[slots, indices] - implied[other, indices])[pairs]
        if self._sums:
            first, second = np.array(joined.before)[slots, indices], implied[slots, indices]
            result[kinds == _FULL] = (first + second - 1.0)[kinds == _FULL]
            result[kinds == _PASSED] = (second - first)[kinds == _PASSED]
        return result

    def flat(self, joined: Joined, cuts: Array, panels: Indices, top_slots: Indices) -> Mask:
        """Return True for panels of constant height; `top_slots` are the highest in their middles."""
        if not self._max:
            return np.asarray(np.ptp(joined.height, axis=1) <= 4e-16 * joined.height.max(axis=1))
        result = np.zeros(len(panels), dtype=bool)
        for i, t in enumerate(self._term):
            constant = self._constant[t][panels]
            if i in self._clip:
                constant = constant | (joined.degrees[t][:, 4] > self.level(self._clip[i], cuts)[:, 0])
            result |= constant & (top_slots == i)
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
            items, breaks, top_slots = self._bends(joined, rows, starts, ends, positions)
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
            flat = quad.flat(joined, self.cuts[:, rows][..., None], base, top_slots)
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
    ) -> tuple[Indices, Array, Indices]:
        """Return panels, where in them the joined terms bend, and the highest slot in each panel's middle."""
        quad, cuts = self.quad, self.cuts[:, rows][..., None]
        wide = ends - starts > NARROWEST * 10 * quad.width
        fires = wide & (cuts[..., 0] > 0.0)  # of each slot
        events: list[Events] = []
        minima: list[tuple[Indices, Array]] = []

        def add_changes(above: Mask, slot: int, kind: int, one: int, within: Mask | bool = True) -> Mask:
            """Add the points after which a margin has another sign; return the wide panels without one."""
            change = (above[:, 1:] != above[:, :-1]) & fires[slot][:, None] & within
            items, first = np.nonzero(change)
            events.append(Events(items, first, *(np.full(len(items), x) for x in (kind, one, 0))))
            return np.asarray(wide & ~change.any(axis=1))

        def add_minima(values: Array, chosen: Mask, scale: Array) -> None:
            """Add the positions at which values may come to 0 between two points."""
            items = np.flatnonzero(chosen & (values.min(axis=1) < _CLOSE * scale))
            with np.errstate(divide="ignore", invalid="ignore"):
                near, offset = lowest_between(values[items] / scale[items][:, None])
            items, offset = items[near], offset[near]
            minima.append((items, (starts[items] + ends[items]) / 2 + offset * (ends[items] - starts[items]) / 2))

        unit = np.ones(len(rows))
        top_slots = np.zeros(joined.height.shape, dtype=np.intp)
        if quad._max:
            top = np.zeros(joined.height.shape)
            for i, height in enumerate(joined.implied):
                np.copyto(top_slots, i, where=height > top)
                np.maximum(top, height, out=top)
            events.append(_passes(joined, top_slots, wide))
        for event, (i, clips) in enumerate(quad._levels):
            margin = joined.degrees[quad._term[i]] - quad.level(event, cuts)
            within: Mask | bool = True
            if quad._max:
                mine = top_slots == i
                # below a level other than its cut a slot is 0, so that none is the greatest
                within = mine[:, 1:] & mine[:, :-1] if clips and not quad._jumps else mine[:, 1:] | mine[:, :-1]
            # above: not where it rounds to its cut, as a curve at its top does
            without_change = add_changes(margin > 0.0, i, _LEVEL, event, within)
            if quad._turning[event]:
                add_minima(np.abs(margin), without_change, unit)
        for i in range(1, len(joined.before)):
            before, one = joined.before[i], joined.implied[i]
            add_minima(np.abs(before + one - 1.0), add_changes(before + one - 1.0 >= 0.0, i, _FULL, i), unit)
            if quad.output.aggregation == "nilpotent_maximum":
                add_minima(np.abs(one - before), add_changes(one - before >= 0.0, i, _PASSED, i), unit)
        if quad._max and len(joined.implied) > 1:
            scale = joined.height.max(axis=1)
            for i, height in enumerate(joined.implied):
                below = joined.height - height
                add_minima(below, fires[i] & (top_slots != i).all(axis=1), scale)
        items, breaks = self._located(events, rows, positions)
        inside = (breaks > starts[items]) & (breaks < ends[items])
        parts = [(items[inside], breaks[inside]), *minima]
        items, breaks = (np.concatenate(column) for column in zip(*parts, strict=True))
        return items, breaks, top_slots[:, 4]

    def _located(self, parts: Sequence[Events], rows: Indices, positions: Array) -> tuple[Indices, Array]:
        """Locate events by their roots; return their panels and positions."""
        if not sum(len(part.items) for part in parts):
            return np.zeros(0, dtype=np.intp), np.zeros(0)
        events = Events(*map(np.concatenate, zip(*parts, strict=True)))

        def margin(x: Array, which: Indices) -> Array:
            cuts = self.cuts[:, rows[events.items[which]]]
            joined = self.quad.heights(x, cuts)
            return self.quad.margins(joined, cuts, events.kinds[which], events.one[which], events.other[which])

        x0, x1 = positions[events.items, events.first], positions[events.items, events.first + 1]
        positions, ok = roots(margin, x0, x1, self.quad.precision)
        return events.items[ok], positions[ok]


def _passes(joined: Joined, top_slots: Indices, wide: Mask) -> Events:
    """Return the points after which another slot is the greatest."""
    items, first = np.nonzero((top_slots[:, 1:] != top_slots[:, :-1]) & wide[:, None])
    a, b = top_slots[items, first], top_slots[items, first + 1]
    implied, order = np.array([height[items] for height in joined.implied]), np.arange(len(items))
    before = implied[b, order, first] < implied[a, order, first] * (1.0 - _TIED)
    after = implied[a, order, first + 1] < implied[b, order, first + 1] * (1.0 - _TIED)
    return Events(*(column[before & after] for column in (items, first, np.full(len(items), _PAIR), a, b)))
