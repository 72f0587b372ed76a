"""Values of terms of any smooth shape that are clipped or scaled, for many samples at once."""

# Over a panel in which each term rises or falls and no two cross, the highest term counts up to its cut, the next one
# above that up to its own, and so on, as in `clipped_centroid`. The area under a term that is clipped at c is the
# integral of a polynomial up to the position where the term is c, and c times the rest of the panel. An error of this
# position counts by its square, as the height on both sides of it is c.

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.defuzzification import HEIGHT_RATIO, positions_of_maximum
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.engines.firing import Slot
from fuzzy_arbiter.engines.panels import Indices, Mask, halved, roots, smooth_panels
from fuzzy_arbiter.engines.quadrature import BOUND, Quadrature, centroid_bound
from fuzzy_arbiter.engines.term_lines import (
    DEGREE,
    EXPONENTS,
    INTEGRAL,
    LEVER,
    NOISE,
    ORDER,
    SPACING,
    STEPS,
    TABLE,
    PlainLine,
    dot,
    line_integrals,
    powers_of,
    quotient_humps,
    summed,
    term_lines,
    with_crossings,
)
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.values import Formula

_FINE_STEPS = 5  # of Newton's method where the position counts, and not the area alone
_ERROR = 1e-10  # maximum error of a sample's area, as a fraction of it; quadrature takes the others
_MIN_HEIGHT = 1e-6  # minimum height of which a polynomial tells the position; quadrature takes lower ones
_GAP = 1e-12  # fraction of the area, nearer to which the half may lie in a gap
_MAX_TABLE = 2**24  # maximum number of degrees in the tables of terms, and that are compared to find crossings
_BLOCK = 2**18  # number of heights that are computed at a time


class ClippedCurves(Defuzzifier):
    """Centroid or bisector of smooth terms, clipped or in a sum; or where the maximum of clipped or scaled ones is."""

    def __init__(self, output: Output, slots: Sequence[Slot]) -> None:
        shapes = [output.terms[slot.term].membership for slot in slots]
        if any(isinstance(s, Formula) or (isinstance(s, Curve) and s.kind == "singleton") for s in shapes):
            raise EngineError(f"output {output.name!r}: a term is a formula or a singleton, expected smooth terms")
        self._make_quadrature = functools.partial(Quadrature, output, slots)
        self._universe, self._kind = output.universe, output.defuzzifier
        bound = f"within {centroid_bound(output):g} of the universe's width"
        self.method = {
            "centroid": "integrals of polynomials, " + ("to rounding" if all(s.polynomial for s in shapes) else bound),
            "bisector": f"integrals of polynomials, halves of the area within {BOUND:g} of it",
        }.get(self._kind, "positions at which polynomials have the maximum height, without a bound of their errors")
        self._max, self._scales = output.aggregation == "max", slots[0].implication == "prod"
        self._envelops = self._max and self._scales and self._kind == "centroid"
        edges = smooth_panels(output.universe, list(dict.fromkeys(shapes)))
        if len(shapes) ** (2 if self._max else 1) * len(edges) * len(TABLE) > _MAX_TABLE:
            raise EngineError(f"output {output.name!r}: its {len(shapes)} terms have too many panels or crossings")
        edges = with_crossings(edges, shapes) if self._max else edges
        edges = halved(edges) if self._scales and self._kind != "centroid" else edges
        self._slots, lines, keys, self._error = term_lines(edges, shapes, self._max and not self._envelops)
        if not self._error < _ERROR * max(shape.area(output.universe) for shape in shapes):
            raise EngineError(f"output {output.name!r}: its terms are too rough, expected smooth terms")
        self._humps = quotient_humps(edges, shapes) if self._envelops else []
        # clipped at tops, and at bottoms
        self._lines = np.concatenate([lines, lines], axis=1) if self._max and not self._envelops else lines
        self._plain_slots: list[list[int]] = self._slots.tolist()
        self._keys, self._positions = keys, np.tile(TABLE, self._slots.size)
        ones = np.ones(self._lines.shape[1])
        self._full = np.array(line_integrals(self._lines, ones, ones))
        self._signs = np.repeat([1.0, -1.0], self._slots.size)[: len(ones)]

    def values(self, cuts: Array, inputs: Array) -> Array:
        """Return the values for many samples; cuts (slots, n)."""
        size = max(1, _BLOCK // self._lines.shape[1])
        compute = self._of_area if self._kind in ("centroid", "bisector") else self._of_maximum
        return np.concatenate([compute(cuts[:, i : i + size]) for i in range(0, max(1, cuts.shape[1]), size)])

    def value(self, cuts: Sequence[float], inputs: Sequence[float]) -> float:
        """Return the value for one sample; the centroid of clipped terms by the operations of `values`, on floats."""
        if self._scales or not self._max or self._kind != "centroid":
            return super().value(cuts, inputs)
        tops, bottoms = [], []
        for slots in self._plain_slots:
            below = 0.0
            for slot in slots:
                counts, top = cuts[slot] > below, max(cuts[slot], below)
                tops.append((top, counts))
                bottoms.append((below, counts))
                below = top
        area = moment = 0.0
        for sign, levels in ((1.0, tops), (-1.0, bottoms)):
            for line, (level, counts) in zip(self._plain_lines, levels, strict=True):
                if level >= line.high:
                    part, lever = line.full
                elif counts and level > line.low:
                    part, lever = line.cut(level)
                else:
                    part = 2.0 * line.half * level
                    lever = line.middle * part
                area += sign * part
                moment += sign * lever
        if not area * _ERROR >= self._error:
            return super().value(cuts, inputs)
        return min(max(self._universe[0] + moment / area, self._universe[0]), self._universe[1])

    @functools.cached_property
    def _plain_lines(self) -> list[PlainLine]:
        keys = self._keys.reshape(-1, len(TABLE)).tolist()
        columns = self._lines.T[: len(keys)].tolist(), self._full.T[: len(keys)].tolist()
        return [PlainLine(2 * i, own, *each) for i, (own, *each) in enumerate(zip(keys, *columns, strict=True))]

    @functools.cached_property
    def _quadrature(self) -> Quadrature:
        return self._make_quadrature()

    def _of_area(self, cuts: Array) -> Array:
        """Return centroids or bisectors; quadrature takes those of an area that is too small."""
        if cuts.shape[1] == 1:  # of two columns NumPy adds rows in their order, as of many
            return self._of_area(np.repeat(cuts, 2, axis=1))[:1]
        if self._kind == "bisector":
            result, smooth = self._bisectors(cuts)
        else:
            compute = self._enveloped if self._envelops else self._scaled if self._scales else self._clipped
            area, moment = compute(cuts)
            smooth = area * _ERROR >= self._error
            result = self._universe[0] + moment / np.where(smooth, area, 1.0)
        if not smooth.all():
            result[~smooth] = self._quadrature.values(cuts[:, ~smooth], cuts)
        return np.minimum(np.maximum(result, self._universe[0]), self._universe[1])

    def _scaled(self, cuts: Array) -> tuple[Array, Array]:
        """Return the areas and moments of scaled terms; cuts (slots, n), returns (n,)."""
        heights = cuts[self._slots.ravel()]
        return summed(self._full[0], heights), summed(self._full[1], heights)

    def _enveloped(self, cuts: Array) -> tuple[Array, Array]:
        """Return the areas and moments under the highest scaled terms; NaN where these may cross more than once."""
        sign, low, high = self._lines[2:DEGREE].reshape(3, *self._slots.shape, 1)
        scales, rows, slots = cuts[self._slots], np.arange(cuts.shape[1]), self._slots.ravel()
        ends = (np.where(sign > 0.0, *sides) * scales for sides in ((low, high), (high, low)))
        # the highest lines at both ends of a panel, between which the quotients of terms only rise or only fall
        left, right = (x.argmax(axis=1) + self._slots.shape[1] * np.arange(len(self._slots))[:, None] for x in ends)
        areas, moments = (full[left] * cuts[slots[left], rows] for full in self._full)
        panel, row = np.nonzero(left != right)
        pair = np.array([left[panel, row], right[panel, row]])  # (2, crossings)
        cut, lines = cuts[slots[pair], row], self._lines[:, pair]

        def heights(t: Array, chosen: Array, cut: Array) -> Array:
            return np.asarray((chosen[DEGREE:INTEGRAL] * powers_of(chosen[2] * t, ORDER)).sum(axis=0) * cut)

        def margin(t: Array, which: Indices) -> Array:
            return np.asarray(np.subtract(*heights(t, lines[:, :, which], cut[:, which])))

        t, has_root = roots(margin, np.full(len(row), -1.0), np.ones(len(row)), 1e-15)
        t = np.where(has_root, t, 1.0)  # where both are equal at an end
        for total, full, part in zip(
            (areas, moments), self._full[:, pair], line_integrals(lines, lines[2] * t), strict=True
        ):
            before = np.where(lines[2] > 0.0, part, full - part)
            total[panel, row] = cut[0] * before[0] + cut[1] * (full - before)[1]
        area = areas.sum(axis=0)
        others = heights(
            t, self._lines.reshape(-1, *self._slots.shape)[:, panel].swapaxes(1, 2), scales[panel, :, row].T
        )
        area[row[(others > heights(t, lines[:, 0], cut[0]) * (1.0 + 1e-9) + 1e-15).any(axis=0)]] = np.nan
        for slot, below, place, ratio in self._humps:
            tops = slots[left[place]], slots[right[place]]
            unsure = ((tops[0] == below) | (tops[1] == below)) & (tops[0] != slot) & (tops[1] != slot)
            area[unsure & (cuts[slot] * ratio > cuts[below])] = np.nan
        return area, moments.sum(axis=0)

    def _clipped(self, cuts: Array) -> tuple[Array, Array]:
        """Return the areas and moments of clipped terms; cuts (slots, n), returns (n,)."""
        areas, moments, _, _ = self._parts(cuts)
        return summed(self._signs, areas), summed(self._signs, moments)

    def _parts(self, cuts: Array) -> tuple[Array, Array, Array, Array]:
        """Return each line's area and moment, (lines, n), above those before it, its level, and where it meets that."""
        tops = cuts[self._slots]  # (panels, terms of a panel, n)
        bottoms = np.zeros_like(tops)
        if self._max:
            np.maximum.accumulate(tops[:, :-1], axis=1, out=bottoms[:, 1:])
        counts = (tops > bottoms).reshape(self._slots.size, tops.shape[2])
        if self._max:
            tops, counts = np.stack([np.maximum(tops, bottoms), bottoms]), np.concatenate([counts, counts])
        levels = tops.reshape(counts.shape)
        middle, half, _, low, high = self._lines[:DEGREE, :, None]
        full = levels >= high
        areas = np.where(full, self._full[0][:, None], 2.0 * half * levels)
        moments = np.where(full, self._full[1][:, None], middle * areas)
        meets = np.nonzero(counts & (levels > low) & ~full)
        lines, cut = self._lines[:, meets[0]], levels[meets]
        ends = np.where(full, 1.0, -1.0)
        ends[meets] = self._meeting(lines, meets[0], cut)
        areas[meets], moments[meets] = line_integrals(lines, ends[meets], cut)
        return areas, moments, levels, ends

    def _bisectors(self, cuts: Array) -> tuple[Array, Mask]:
        """Return the positions that halve the areas, and True where they are accurate and not in or beside a gap."""
        areas, _, levels, ends = self._parts(cuts)
        count, rows = len(self._slots), np.arange(cuts.shape[1])
        index = np.arange(len(areas)).reshape(-1, count, self._slots.shape[1])  # of tops and bottoms, by panel
        of_panels = (self._signs[:, None] * areas)[index].sum(axis=(0, 2))
        sums = np.cumsum(of_panels, axis=0)
        half = sums[-1] / 2
        panel = np.minimum((sums < half).sum(axis=0), count - 1)
        missing = half - sums[panel, rows] + of_panels[panel, rows]
        chosen = index[:, panel].transpose(0, 2, 1).reshape(-1, len(rows))  # (lines, n)
        middle, width, sign, *_ = self._lines[:DEGREE, chosen]
        integral, level, end = self._lines[INTEGRAL:LEVER, chosen], levels[chosen, rows], ends[chosen, rows]

        def below(r: Array, which: Indices) -> Array:
            """Return each line's area before a position in its panel."""
            before = (integral[:, :, which] * powers_of(np.minimum(r, end[:, which]), ORDER + 1)).sum(axis=0)
            return np.asarray(before + level[:, which] * np.maximum(r - end[:, which], 0.0))

        whole = below(np.ones(chosen.shape), rows)

        def lacking(t: Array, which: Indices) -> Array:
            rises = sign[:, which] > 0.0
            part = below(np.where(rises, t, -t), which)
            part = np.where(rises, part, whole[:, which] - part) * width[:, which] * self._signs[chosen[:, which]]
            return np.asarray(part.sum(axis=0) - missing[which])

        t, has_root = roots(lacking, np.full(len(rows), -1.0), np.ones(len(rows)), 1e-16)
        inside = (missing > half * _GAP) & (of_panels[panel, rows] - missing > half * _GAP)
        result = self._universe[0] + middle[0] + width[0] * np.where(has_root, t, 0.0)
        return result, has_root & inside & (2 * half * _ERROR >= self._error)

    def _of_maximum(self, cuts: Array) -> Array:
        """Return the mean, smallest or largest position of the maximum height; cuts (slots, n)."""
        low, high = self._lines[3:DEGREE, : self._slots.size].reshape(2, *self._slots.shape, 1)
        tops = cuts[self._slots]
        heights = high * tops if self._scales else np.minimum(high, tops)
        maximum = heights.max(axis=(0, 1))
        reaches = (heights >= maximum * HEIGHT_RATIO) & (heights > 0.0)
        panel, row = np.nonzero(reaches.any(axis=1))
        order = np.argsort(row, kind="stable")
        panel, row = panel[order], row[order]
        highest = reaches[panel, :, row].argmax(axis=1)
        index, degree = panel * self._slots.shape[1] + highest, maximum[row]
        if self._scales:
            degree = degree / tops[panel, highest, row]
        lines = self._lines[:, index]
        middle, half, sign, low, high = lines[:DEGREE]
        meeting = self._meeting(lines, index, np.minimum(np.maximum(degree, low), high), _FINE_STEPS)
        r = np.where(low >= degree * HEIGHT_RATIO, -1.0, np.where(high * HEIGHT_RATIO <= degree, 1.0, meeting))
        ends = self._universe[0] + middle + sign * half * np.array([r, np.ones(len(r))])
        starts, ends = ends.min(axis=0), ends.max(axis=0)
        result = positions_of_maximum(self._kind, row, starts, ends, cuts.shape[1], self._universe)
        lowest = maximum < _MIN_HEIGHT
        if lowest.any():
            result[lowest] = self._quadrature.values(cuts[:, lowest], cuts)
        return result

    def _meeting(self, lines: Array, index: Indices, cut: Array, steps: int = STEPS) -> Array:
        """Return the r at which each line has the degree of its cut."""
        _, _, _, low, high = lines[:DEGREE]
        rise = np.where(high > low, high - low, np.inf)
        r = np.interp(2 * (index % self._slots.size) + (cut - low) / rise, self._keys, self._positions)
        reach = SPACING * (np.sqrt(1.0 - r * r) + SPACING)
        first, last = np.maximum(r - reach, -1.0), np.minimum(r + reach, 1.0)
        degree = lines[DEGREE:INTEGRAL]
        slopes = degree[1:] * EXPONENTS[1:, None]
        for _ in range(steps):  # of Newton's method
            powers = powers_of(r, ORDER)
            off, slope = dot(degree, powers) - cut, dot(slopes, powers[:-1])
            r = r - off / np.where((slope > 0.0) & (np.abs(off) > NOISE), slope, np.inf)
            r = np.minimum(np.maximum(r, first), last)
        return np.asarray(r)
