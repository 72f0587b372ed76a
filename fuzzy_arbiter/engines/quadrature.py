"""Outputs of any terms, norms and defuzzifiers: joined at places, and integrated between the places where they bend.

The joined terms bend where a term does, where one meets its cut, or where two change places. The first are known; the
others are looked for on a grid and then found to rounding. Between them the joined terms are smooth, so that Gauss'
rule is exact for polynomials, and otherwise nearly so; a part where two halves give another integral than the whole is
halved until they do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.firing import Slot
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array, Membership
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS

BOUND = 1e-9  # bound of a centroid's error, as a fraction of the universe's width
_TOLERANCE = 1e-13  # tolerance of each part, as a fraction of the area
_NODES, _WEIGHTS = (x.reshape(-1, 1) for x in np.polynomial.legendre.leggauss(16))
_SCAN = 16  # number of intervals in each smooth part of the terms, in which bends are searched
_BESIDE = 1e-9  # distance of the first and the last interval from the part's ends, as a fraction of its width
_HALVINGS = 45  # greatest number of halvings of a part
_MAX_PARTS = 20_000  # greatest number of parts
# a slot meets its cut; it and its cut sum to 1; it and those before it sum to 1; it passes those before it
_CUT, _REST, _FULL, _PASSED = -1, -2, -3, -4
_NEAR = 1e-11  # tolerance of a bend's place, as a fraction of the universe: the error of the integral is its square
_EQUAL = 1.0 - 1e-12  # heights count as equal if their quotient is above this


class Parts(NamedTuple):
    """Parts of a universe, from left to right, and area and moment of each."""

    starts: Array
    ends: Array
    areas: Array
    moments: Array  # moment of each part about the universe's start


class Quadrature:
    """The value of one output whose terms are joined.

    Parameters
    ----------
    output : Output
        Output whose terms are membership functions.
    slots : sequence of Slot
        Sets that are joined.

    Attributes
    ----------
    exact : bool
        True if the integrals are exact to rounding: the joined terms are polynomials between their bends.
    """

    def __init__(self, output: Output, slots: Sequence[Slot]) -> None:
        self._output = output
        self._slots = slots
        shapes = [output.terms[slot.term].shape for slot in slots]
        self._shapes = [shape for shape in shapes if isinstance(shape, Membership)]
        self._implications = [T_NORMS[slot.implication].array for slot in slots]
        self._join = AGGREGATIONS[output.aggregation].array
        self._low, self._width = output.universe[0], output.universe[1] - output.universe[0]
        self._knots = np.array(output.knots)
        self.exact = (
            all(shape.polynomial for shape in self._shapes)
            and all(slot.implication in ("min", "prod") for slot in slots)
            and output.aggregation in ("max", "probor", "sum", "bounded_sum")
        )
        shares = np.concatenate([[_BESIDE], np.linspace(0.0, 1.0, _SCAN + 1)[1:-1], [1.0 - _BESIDE]])
        starts, widths = self._knots[:-1, None], np.diff(self._knots)[:, None]
        self._scan = starts + shares * widths  # shape (parts, places)
        self._scanned = np.array([s.of_many(self._scan.ravel()).reshape(self._scan.shape) for s in self._shapes])

    def value(self, cuts: Sequence[float]) -> float:
        """Return the output's value.

        Parameters
        ----------
        cuts : sequence of float, length slots
            Strength of each slot, in [0, 1]; not all are 0.

        Returns
        -------
        float
            Value in the universe; NaN if the joined terms have no area.

        Raises
        ------
        EngineError
            If the joined terms are so rough that they cannot be integrated to the bound.
        """
        joined = _Joined(self, cuts)
        if self._output.defuzzifier in ("mom", "som", "lom"):
            return joined.of_maximum(self._output.defuzzifier)
        parts = joined.parts()
        area = parts.areas.sum()
        if not area > 0.0:
            return joined.of_points()
        if self._output.defuzzifier == "bisector":
            return joined.bisector(parts)
        return float(min(max(self._low + parts.moments.sum() / area, self._low), self._low + self._width))


class _Joined:
    """The joined terms of one sample, as a function of the place."""

    def __init__(self, of: Quadrature, cuts: Sequence[float]) -> None:
        self.of = of
        self.active = [i for i, cut in enumerate(cuts) if cut > 0.0]
        self.cuts = [cuts[i] for i in self.active]
        self.breaks = self._breaks()

    def implied(self, degrees: Array) -> Array:
        """Return the heights of the active slots, each bounded by its cut, shape (slots, ..)."""
        bounded = [
            self.of._implications[i](np.full(d.shape, cut), d)
            for i, cut, d in zip(self.active, self.cuts, degrees, strict=True)
        ]
        return np.array(bounded)

    def heights(self, places: Array) -> Array:
        """Return the joined height at many places, shape (n,)."""
        height = np.zeros(len(places))
        for i, cut in zip(self.active, self.cuts, strict=True):
            height = self.of._join(
                height, self.of._implications[i](np.full(len(places), cut), self.of._shapes[i].of_many(places))
            )
        return height

    def _signs(self) -> list[tuple[int, int]]:
        """Return the events that can bend the joined terms: (slot, slot or `_CUT`, `_REST`, `_FULL`, `_PASSED`)."""
        signs: list[tuple[int, int]] = []
        for a, i in enumerate(self.active):
            implication = self.of._slots[i].implication
            signs += [(a, _CUT)] if implication in ("min", "nilpotent_minimum") else []
            signs += [(a, _REST)] if implication in ("bounded_difference", "nilpotent_minimum") else []
        aggregation = self.of._output.aggregation
        for a in range(1, len(self.active)):
            signs += [(a, b) for b in range(a)] if aggregation == "max" else []
            signs += [(a, _FULL)] if aggregation in ("bounded_sum", "normalized_sum", "nilpotent_maximum") else []
            signs += [(a, _PASSED)] if aggregation == "nilpotent_maximum" else []
        return signs

    def _bends(self, signs: Sequence[tuple[int, int]], degrees: Array, implied: Array) -> Array:
        """Return values whose sign changes where the joined terms bend, one for each event, shape (signs, ..)."""
        bends = np.empty((len(signs), *degrees.shape[1:]))
        before = [np.zeros(degrees.shape[1:])]  # joined height of the slots before each
        if any(b in (_FULL, _PASSED) for _, b in signs):
            for height in implied[:-1]:
                before.append(self.of._join(before[-1], height))
        for row, (a, b) in zip(bends, signs, strict=True):
            if b == _CUT:
                row[...] = degrees[a] - self.cuts[a]
            elif b == _REST:
                row[...] = degrees[a] + self.cuts[a] - 1.0
            elif b == _FULL:
                row[...] = before[a] + implied[a] - 1.0
            else:
                row[...] = implied[a] - (before[a] if b == _PASSED else implied[b])
        return bends

    def _breaks(self) -> Array:
        of = self.of
        scanned, signs = of._scanned[self.active], self._signs()
        implied = self.implied(scanned)
        bends = self._bends(signs, scanned, implied)
        above = bends >= 0.0
        changes = above[..., 1:] != above[..., :-1]
        if of._output.aggregation == "max":  # slots below the greatest do not matter
            top = implied >= implied.max(axis=0) * _EQUAL
            seen = top[..., 1:] | top[..., :-1]
            changes &= np.array([seen[a] | seen[b if b >= 0 else a] for a, b in signs]).reshape(changes.shape)
        which, part, at = np.nonzero(changes)
        if len(which) == 0:
            return of._knots
        asked = [signs[i] for i in np.unique(which)]
        rows = np.searchsorted(np.unique(which), which)
        x0, x1 = of._scan[part, at], of._scan[part, at + 1]
        f0, f1 = bends[which, part, at], bends[which, part, at + 1]
        x = x0
        for _ in range(60):  # regula falsi, in which an end that stays counts half
            x, before = (x0 * f1 - x1 * f0) / (f1 - f0), x
            x = np.where((x0 <= x) & (x <= x1), x, (x0 + x1) / 2)
            if np.abs(x - before).max() <= _NEAR * of._width:
                break
            degrees = np.array([of._shapes[i].of_many(x) for i in self.active])
            f = self._bends(asked, degrees, self.implied(degrees))[rows, np.arange(len(x))]
            right = (f >= 0.0) == (f1 >= 0.0)
            f0, f1 = np.where(right, f0 / 2, f), np.where(right, f, f1 / 2)
            x0, x1 = np.where(right, x0, x), np.where(right, x, x1)
        return np.unique(np.concatenate([of._knots, x]))

    def _integrals(self, starts: Array, ends: Array) -> tuple[Array, Array]:
        middle, half = (starts + ends) / 2, (ends - starts) / 2
        places = middle + _NODES * half
        heights = self.heights(places.ravel()).reshape(places.shape) * _WEIGHTS
        return heights.sum(axis=0) * half, (heights * (places - self.of._low)).sum(axis=0) * half

    def parts(self) -> Parts:
        """Return area and moment of each part, halved until their sum is within the tolerance."""
        starts, ends = self.breaks[:-1], self.breaks[1:]
        areas, moments = self._integrals(starts, ends)
        done: list[Parts] = []
        whole, count = areas.sum(), 0
        for _ in range(_HALVINGS):
            middles = (starts + ends) / 2
            left, right = self._integrals(starts, middles), self._integrals(middles, ends)
            off = np.abs(left[0] + right[0] - areas) * self.of._width + np.abs(left[1] + right[1] - moments)
            good = off <= _TOLERANCE * whole * self.of._width
            halves = Parts(
                *(
                    np.concatenate(pair)
                    for pair in ((starts, middles), (middles, ends), (left[0], right[0]), (left[1], right[1]))
                )
            )
            twice = np.concatenate([good, good])
            done.append(Parts(*(column[twice] for column in halves)))
            starts, ends, areas, moments = (column[~twice] for column in halves)
            count += len(starts)
            if len(starts) == 0:
                break
            if count > _MAX_PARTS:
                raise EngineError(
                    f"output {self.of._output.name!r}: its joined terms are too rough to be integrated to {BOUND:g} of "
                    "its universe; expected smoother terms"
                )
        done.append(Parts(starts, ends, areas, moments))
        joined = Parts(*map(np.concatenate, zip(*done, strict=True)))
        order = np.argsort(joined.starts)
        return Parts(*(column[order] for column in joined))

    def of_points(self) -> float:
        """Return the mean of the singletons, weighted by their heights: what very narrow terms of one width tend to."""
        found = [
            (shape.parameters[0], float(self.of._implications[i](np.array([cut]), np.array([shape.height]))[0]))
            for i, cut in zip(self.active, self.cuts, strict=True)
            if isinstance(shape := self.of._shapes[i], Curve) and shape.kind == "singleton"
        ]
        weight = sum(height for _, height in found)
        return sum(place * height for place, height in found) / weight if weight > 0.0 else float("nan")

    def bisector(self, parts: Parts) -> float:
        """Return the place that halves the area; of several the middle one."""
        sums = np.cumsum(parts.areas)
        half = sums[-1] / 2
        i = int(np.searchsorted(sums, half * (1.0 - 1e-14)))
        start, end = parts.starts[i], parts.ends[i]
        missing = half - (sums[i] - parts.areas[i])
        if abs(missing - parts.areas[i]) <= 1e-14 * half:  # at its end, perhaps of a gap
            after = parts.starts[i + 1 :][parts.areas[i + 1 :] > 0.0]
            return float((end + after[0]) / 2) if len(after) else float(end)
        x0, x1, f0, f1 = start, end, -missing, parts.areas[i] - missing
        x = start
        for _ in range(100):
            x, before = (x0 * f1 - x1 * f0) / (f1 - f0), x
            if abs(x - before) <= 1e-15 * self.of._width:
                break
            f = self._integrals(np.array([start]), np.array([x]))[0][0] - missing
            if f > 0.0:
                x1, f1, f0 = x, f, f0 / 2
            else:
                x0, f0, f1 = x, f, f1 / 2
        return float(x)

    def of_maximum(self, kind: str) -> float:
        """Return the mean, the smallest or the largest of the places where the height is greatest."""
        starts, ends = self.breaks[:-1], self.breaks[1:]
        shares = np.linspace(_BESIDE, 1.0 - _BESIDE, 33)
        places = starts + shares[:, None] * (ends - starts)
        heights = self.heights(places.ravel()).reshape(places.shape)
        at_breaks = self.heights(self.breaks)
        greatest = max(heights.max(), at_breaks.max())
        if not greatest > 0.0:
            return float("nan")
        flat = heights.min(axis=0) >= heights.max(axis=0) * _EQUAL
        points, tops = [self.breaks], [at_breaks]
        a, b = starts[~flat], ends[~flat]
        if len(a):
            for _ in range(14):  # each closes in on the greatest of 17 places
                near = a + np.linspace(0.0, 1.0, 17)[:, None] * (b - a)
                found = self.heights(near.ravel()).reshape(near.shape)
                top = found >= found.max(axis=0) * (1.0 - 1e-15)
                order = np.arange(17)[:, None]
                first = np.where(top, order, 17).min(axis=0)
                last = np.where(top, order, -1).max(axis=0)
                columns = np.arange(len(a))
                a, b = near[np.maximum(first - 1, 0), columns], near[np.minimum(last + 1, 16), columns]
            points.append((a + b) / 2)
            tops.append(self.heights(points[-1]))
            greatest = max(greatest, tops[-1].max())
        places, heights_found = np.concatenate(points), np.concatenate(tops)
        singles = np.unique(places[heights_found >= greatest * _EQUAL])
        level = flat & (heights.max(axis=0) >= greatest * _EQUAL)
        left, right = starts[level], ends[level]
        if kind == "som":
            return float(min([*singles, *left]))
        if kind == "lom":
            return float(max([*singles, *right]))
        length = (right - left).sum()
        if length > 1e-9 * self.of._width:
            return float(((left + right) / 2 * (right - left)).sum() / length)
        apart = np.diff(singles, prepend=-np.inf) > 1e-9 * self.of._width
        return float(singles[apart].mean())
