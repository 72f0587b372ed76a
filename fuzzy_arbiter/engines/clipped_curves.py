"""Values of terms of any smooth shape that are clipped or scaled, for many samples at once."""

# Over a panel in which each term rises or falls and no two cross, the highest term counts up to its cut, the next one
# above that up to its own, and so on, as in `clipped_centroid`. The area under a term that is clipped at c is the
# integral of a polynomial up to the position where the term is c, and c times the rest of the panel. An error of this
# position counts by its square, as the height on both sides of it is c.

from __future__ import annotations

import functools
import itertools
import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import legendre

from fuzzy_arbiter.definition import Output
from fuzzy_arbiter.engines.defuzzification import HEIGHT_RATIO, positions_of_maximum
from fuzzy_arbiter.engines.engine import Defuzzifier
from fuzzy_arbiter.engines.firing import Slot
from fuzzy_arbiter.engines.panels import Indices, Mask, halved, points_of, roots, smooth_panels
from fuzzy_arbiter.engines.quadrature import BOUND, Quadrature, centroid_bound
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.shapes import Array, Membership
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.values import Formula

_ORDER = 16  # number of coefficients of each polynomial
_NODES, _WEIGHTS = legendre.leggauss(_ORDER)
# Legendre series through the values at the nodes, and the powers of each of its polynomials: one matrix for both rounds
_SERIES = ((np.arange(_ORDER) + 0.5) * legendre.legvander(_NODES, _ORDER - 1)) * _WEIGHTS[:, None]
_AS_POWERS = np.array([np.pad(legendre.leg2poly(row), (0, _ORDER - k - 1)) for k, row in enumerate(np.eye(_ORDER))])
_TABLE = -np.cos(np.linspace(0.0, np.pi, 65))  # positions in a panel of the table by which a degree's is guessed
_GUESSES = _TABLE.tolist()
_SPACING = math.pi / 64
_INNER_TABLE = _TABLE * (1.0 - 1e-9)  # on the panel's side of a jump
_POWERS = np.arange(_ORDER)
_STEPS, _FINE_STEPS = 2, 5  # of Newton's method: where the area counts, and where the position does
_ERROR = 1e-10  # maximum error of a sample's area, as a fraction of it; quadrature takes the others
_NOISE = 1e-14  # error of a degree by rounding
_MIN_HEIGHT = 1e-6  # minimum height of which a polynomial tells the position; quadrature takes lower ones
_JUMP = 1e-8  # minimum height of a jump at the end of a panel
_GAP = 1e-12  # fraction of the area, nearer to which the half may lie in a gap
_MIN_MARGIN = 1e-12  # terms whose degrees differ by less do not cross
_MAX_TABLE = 2**24  # maximum number of degrees in the tables of terms, and that are compared to find crossings
_BLOCK = 2**18  # number of heights that are computed at a time
# A line is a term's part over a panel, a polynomial of r from -1 to 1 which rises with r. Its column holds the panel's
# middle, from the universe's start, and half of its width; -1 where the term falls, else 1; its lowest and its highest
# degree; and coefficients of the powers of r: of its degree, of the integral of that from -1, and of r times it.
_DEGREE = 5
_INTEGRAL = _DEGREE + _ORDER
_LEVER = _INTEGRAL + _ORDER + 1


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
        if len(shapes) ** (2 if self._max else 1) * len(edges) * len(_TABLE) > _MAX_TABLE:
            raise EngineError(f"output {output.name!r}: its {len(shapes)} terms have too many panels or crossings")
        edges = with_crossings(edges, shapes) if self._max else edges
        edges = halved(edges) if self._scales and self._kind != "centroid" else edges
        self._slots, lines, keys, self._error = _lines(edges, shapes, self._max and not self._envelops)
        if not self._error < _ERROR * max(shape.area(output.universe) for shape in shapes):
            raise EngineError(f"output {output.name!r}: its terms are too rough, expected smooth terms")
        self._humps = _humps(edges, shapes) if self._envelops else []
        # clipped at tops, and at bottoms
        self._lines = np.concatenate([lines, lines], axis=1) if self._max and not self._envelops else lines
        self._plain_slots: list[list[int]] = self._slots.tolist()
        self._keys, self._positions = keys, np.tile(_TABLE, self._slots.size)
        ones = np.ones(self._lines.shape[1])
        self._full = np.array(_integrals(self._lines, ones, ones))
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
    def _plain_lines(self) -> list[_PlainLine]:
        keys = self._keys.reshape(-1, len(_TABLE)).tolist()
        columns = self._lines.T[: len(keys)].tolist(), self._full.T[: len(keys)].tolist()
        return [_PlainLine(2 * i, own, *each) for i, (own, *each) in enumerate(zip(keys, *columns, strict=True))]

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
        return _summed(self._full[0], heights), _summed(self._full[1], heights)

    def _enveloped(self, cuts: Array) -> tuple[Array, Array]:
        """Return the areas and moments under the highest scaled terms; NaN where these may cross more than once."""
        sign, low, high = self._lines[2:_DEGREE].reshape(3, *self._slots.shape, 1)
        scales, rows, slots = cuts[self._slots], np.arange(cuts.shape[1]), self._slots.ravel()
        ends = (np.where(sign > 0.0, *sides) * scales for sides in ((low, high), (high, low)))
        # the highest lines at both ends of a panel, between which the quotients of terms only rise or only fall
        left, right = (x.argmax(axis=1) + self._slots.shape[1] * np.arange(len(self._slots))[:, None] for x in ends)
        areas, moments = (full[left] * cuts[slots[left], rows] for full in self._full)
        panel, row = np.nonzero(left != right)
        pair = np.array([left[panel, row], right[panel, row]])  # (2, crossings)
        cut, lines = cuts[slots[pair], row], self._lines[:, pair]

        def heights(t: Array, chosen: Array, cut: Array) -> Array:
            return np.asarray((chosen[_DEGREE:_INTEGRAL] * _powers(chosen[2] * t, _ORDER)).sum(axis=0) * cut)

        def margin(t: Array, which: Indices) -> Array:
            return np.asarray(np.subtract(*heights(t, lines[:, :, which], cut[:, which])))

        t, has_root = roots(margin, np.full(len(row), -1.0), np.ones(len(row)), 1e-15)
        t = np.where(has_root, t, 1.0)  # where both are equal at an end
        for total, full, part in zip(
            (areas, moments), self._full[:, pair], _integrals(lines, lines[2] * t), strict=True
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
        return _summed(self._signs, areas), _summed(self._signs, moments)

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
        middle, half, _, low, high = self._lines[:_DEGREE, :, None]
        full = levels >= high
        areas = np.where(full, self._full[0][:, None], 2.0 * half * levels)
        moments = np.where(full, self._full[1][:, None], middle * areas)
        meets = np.nonzero(counts & (levels > low) & ~full)
        lines, cut = self._lines[:, meets[0]], levels[meets]
        ends = np.where(full, 1.0, -1.0)
        ends[meets] = self._meeting(lines, meets[0], cut)
        areas[meets], moments[meets] = _integrals(lines, ends[meets], cut)
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
        middle, width, sign, *_ = self._lines[:_DEGREE, chosen]
        integral, level, end = self._lines[_INTEGRAL:_LEVER, chosen], levels[chosen, rows], ends[chosen, rows]

        def below(r: Array, which: Indices) -> Array:
            """Return each line's area before a position in its panel."""
            before = (integral[:, :, which] * _powers(np.minimum(r, end[:, which]), _ORDER + 1)).sum(axis=0)
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
        low, high = self._lines[3:_DEGREE, : self._slots.size].reshape(2, *self._slots.shape, 1)
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
        middle, half, sign, low, high = lines[:_DEGREE]
        meeting = self._meeting(lines, index, np.minimum(np.maximum(degree, low), high), _FINE_STEPS)
        r = np.where(low >= degree * HEIGHT_RATIO, -1.0, np.where(high * HEIGHT_RATIO <= degree, 1.0, meeting))
        ends = self._universe[0] + middle + sign * half * np.array([r, np.ones(len(r))])
        starts, ends = ends.min(axis=0), ends.max(axis=0)
        result = positions_of_maximum(self._kind, row, starts, ends, cuts.shape[1], self._universe)
        lowest = maximum < _MIN_HEIGHT
        if lowest.any():
            result[lowest] = self._quadrature.values(cuts[:, lowest], cuts)
        return result

    def _meeting(self, lines: Array, index: Indices, cut: Array, steps: int = _STEPS) -> Array:
        """Return the r at which each line has the degree of its cut."""
        _, _, _, low, high = lines[:_DEGREE]
        rise = np.where(high > low, high - low, np.inf)
        r = np.interp(2 * (index % self._slots.size) + (cut - low) / rise, self._keys, self._positions)
        reach = _SPACING * (np.sqrt(1.0 - r * r) + _SPACING)
        first, last = np.maximum(r - reach, -1.0), np.minimum(r + reach, 1.0)
        degree = lines[_DEGREE:_INTEGRAL]
        slopes = degree[1:] * _POWERS[1:, None]
        for _ in range(steps):  # of Newton's method
            powers = _powers(r, _ORDER)
            off, slope = _dot(degree, powers) - cut, _dot(slopes, powers[:-1])
            r = r - off / np.where((slope > 0.0) & (np.abs(off) > _NOISE), slope, np.inf)
            r = np.minimum(np.maximum(r, first), last)
        return np.asarray(r)


class _PlainLine:
    """A line in floats, for one sample."""

    def __init__(self, first_key: int, keys: list[float], column: list[float], full: list[float]) -> None:
        self.middle, self.half, self.sign, self.low, self.high = column[:_DEGREE]
        self.degree, self.integral = column[_DEGREE:_INTEGRAL], column[_INTEGRAL:_LEVER]
        self.slopes = [k * factor for k, factor in enumerate(self.degree)][1:]
        self.lever, self.full = column[_LEVER:], (full[0], full[1])
        self.keys, self.first_key = keys, first_key

    def cut(self, level: float) -> tuple[float, float]:
        """Return the area and the moment below a level that the line passes, as `_meeting` and `_integrals` do."""
        key = self.first_key + (level - self.low) / (self.high - self.low)
        j = bisect_right(self.keys, key) - 1
        r, x = _GUESSES[j], self.keys[j]
        if key > x:
            r = (_GUESSES[j + 1] - r) / (self.keys[j + 1] - x) * (key - x) + r
        reach = _SPACING * (math.sqrt(1.0 - r * r) + _SPACING)
        first, last = max(r - reach, -1.0), min(r + reach, 1.0)
        for _ in range(_STEPS):
            off, slope = _polynomial(self.degree, r) - level, _polynomial(self.slopes, r)
            if slope > 0.0 and abs(off) > _NOISE:
                r = min(max(r - off / slope, first), last)
        area = self.half * (_polynomial(self.integral, r) + level * (1.0 - r))
        lever = _polynomial(self.lever, r) + level * (1.0 - r * r) / 2
        return area, self.middle * area + self.sign * self.half * self.half * lever


def _polynomial(coefficients: Sequence[float], r: float) -> float:
    total = coefficients[0]
    power = 1.0
    for coefficient in coefficients[1:]:
        power *= r
        total += coefficient * power
    return total


def _summed(factors: Array, rows: Array) -> Array:
    return np.asarray(np.add.reduce(factors[:, None] * rows))


def _dot(coefficients: Array, powers: Array) -> Array:
    """Return the values of polynomials, to the same bits for any number of columns; both (count, n)."""
    products = coefficients * powers
    if products.shape[1] == 1:  # of two columns NumPy adds rows in their order, as of many
        products = np.repeat(products, 2, axis=1)
    return np.asarray(np.add.reduce(products)[: powers.shape[1]])


def _powers(r: Array, count: int) -> Array:
    """Return the powers of r from 0 on, shape (count, ...)."""
    result = np.empty((count, *r.shape))
    result[0], result[1:] = 1.0, r
    return np.asarray(np.multiply.accumulate(result, axis=0, out=result))


def _integrals(lines: Array, r: Array, cut: Array | float = 0.0) -> tuple[Array, Array]:
    """Return area and moment under lines that are cut from r on."""
    (middle, half, sign), powers = lines[:3], _powers(r, _ORDER + 2)
    area = half * (_dot(lines[_INTEGRAL:_LEVER], powers[:-1]) + cut * (1.0 - r))
    lever = _dot(lines[_LEVER:], powers) + cut * (1.0 - r * r) / 2
    return area, middle * area + sign * half * half * lever


def _degrees(shapes: Sequence[Membership], positions: Array) -> Array:
    return np.array([shape.of_many(positions.ravel()).reshape(positions.shape) for shape in shapes])


def with_crossings(edges: Array, shapes: Sequence[Membership]) -> Array:
    """Return the ends of panels in which terms do not cross, from those in which they are smooth."""
    precision = 4e-16 * float(np.abs(edges[[0, -1]]).max())
    positions = points_of(edges[:-1], edges[1:], _INNER_TABLE)
    degrees = _degrees(shapes, positions)
    starts, ends, pairs = [np.zeros(0)], [np.zeros(0)], [np.zeros((0, 2), dtype=np.intp)]
    for i, j in itertools.combinations(range(len(shapes)), 2):
        margin = degrees[i] - degrees[j]
        changes = (margin[1:] >= 0.0) != (margin[:-1] >= 0.0)
        changes &= np.maximum(np.abs(margin[1:]), np.abs(margin[:-1])) > _MIN_MARGIN
        starts.append(positions[:-1][changes])
        ends.append(positions[1:][changes])
        pairs.append(np.tile([i, j], (len(ends[-1]), 1)))
    one, other = np.concatenate(pairs).T

    def margins(x: Array, which: Indices) -> Array:
        values, order = _degrees(shapes, x), np.arange(len(x))
        return np.asarray(values[one[which], order] - values[other[which], order])

    crossings, _ = roots(margins, np.concatenate(starts), np.concatenate(ends), precision)
    return np.unique([*edges, *crossings[np.isfinite(crossings)]])


def _humps(edges: Array, shapes: Sequence[Membership]) -> list[tuple[int, int, int, float]]:
    """Return pairs of terms, panels in which their quotient is the greatest between both ends, and a bound of it."""
    degrees = _degrees(shapes, points_of(edges[:-1], edges[1:], _INNER_TABLE))
    result = []
    for i, k in itertools.permutations(range(len(shapes)), 2):
        with np.errstate(all="ignore"):
            ratios = np.nan_to_num(degrees[i] / degrees[k], nan=0.0, posinf=np.inf)
        highest = ratios.max(axis=0)
        panels = np.flatnonzero(highest > np.maximum(ratios[0], ratios[-1]) * (1.0 + 1e-9))
        result += [(i, k, int(p), 1.01 * float(highest[p])) for p in panels]
    return result


def _lines(edges: Array, shapes: Sequence[Membership], ordered: bool) -> tuple[Indices, Array, Array, float]:
    """Return the slots of each panel, the highest first; their lines; the keys of these; and the area's error."""
    starts, ends = edges[:-1], edges[1:]
    half = (ends - starts) / 2
    nodes, positions = (points_of(starts, ends, points).T for points in (_NODES, _INNER_TABLE))
    at_nodes, degrees = (_degrees(shapes, x) for x in (nodes, positions))
    series = at_nodes @ _SERIES @ _AS_POWERS  # (shapes, panels, powers)
    table = series @ _powers(_INNER_TABLE, _ORDER)
    error = np.abs(table - degrees).max(axis=-1)
    falls = series[..., 1::2].sum(axis=-1) < 0.0
    series[..., 1::2] *= np.where(falls, -1.0, 1.0)[..., None]
    table = series @ _powers(_TABLE, _ORDER)
    at_edges = _degrees(shapes, edges)
    for end, x in (
        (0, np.where(falls, at_edges[:, 1:], at_edges[:, :-1])),
        (-1, np.where(falls, at_edges[:, :-1], at_edges[:, 1:])),
    ):
        table[..., end] = np.where(np.abs(table[..., end] - x) < _JUMP, x, table[..., end])
    error += np.maximum(-np.diff(table, axis=-1), 0.0).sum(axis=-1)  # of terms that turn within a panel
    integral = np.pad(series / (_POWERS + 1), ((0, 0), (0, 0), (1, 0)))
    lever = np.pad(series / (_POWERS + 2), ((0, 0), (0, 0), (2, 0)))
    for each in (integral, lever):
        each[..., 0] -= (each * (-1.0) ** np.arange(each.shape[-1])).sum(axis=-1)
    order = np.argsort(-integral.sum(axis=-1), axis=0)
    order = order[: max(1, int((degrees.max(axis=-1) > 0.0).sum(axis=0).max()))]
    upper, lower = (np.take_along_axis(degrees, rows[..., None], axis=0) for rows in (order[:-1], order[1:]))
    error = error.sum(axis=0) + ordered * np.maximum(lower - upper, 0.0).max(axis=-1).sum(axis=0)
    slots, panel = np.asarray(order.T, dtype=np.intp), np.repeat(np.arange(len(half)), len(order))
    chosen = [each[slots.ravel(), panel].T for each in (series, integral, lever, table)]
    low, high = np.maximum(chosen[3][0], 0.0), chosen[3][-1]
    rise = np.where(high > low, high - low, np.inf)
    keys = np.maximum.accumulate(np.clip((chosen[3] - low) / rise, 0.0, 1.0), axis=0) + 2 * np.arange(len(panel))
    sign = np.where(falls[slots.ravel(), panel], -1.0, 1.0)
    lines: Array = np.vstack([(starts + half - starts[0])[panel], half[panel], sign, low, high, *chosen[:3]])
    return slots, lines, np.asarray(keys.T.ravel(), dtype=np.float64), float(2.0 * half @ error)
