"""Terms as polynomials over panels in which they rise or fall, with their integrals."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import legendre

from fuzzy_arbiter.engines.panels import Indices, points_of, roots
from fuzzy_arbiter.shapes import Array, Membership

ORDER = 16  # number of coefficients of each polynomial
_NODES, _WEIGHTS = legendre.leggauss(ORDER)
# Legendre series through the values at the nodes, and the powers of each of its polynomials: one matrix for both rounds
_SERIES = ((np.arange(ORDER) + 0.5) * legendre.legvander(_NODES, ORDER - 1)) * _WEIGHTS[:, None]
_AS_POWERS = np.array([np.pad(legendre.leg2poly(row), (0, ORDER - k - 1)) for k, row in enumerate(np.eye(ORDER))])
TABLE = -np.cos(np.linspace(0.0, np.pi, 65))  # positions in a panel of the table by which a degree's is guessed
_GUESSES = TABLE.tolist()
SPACING = math.pi / 64
_INNER_TABLE = TABLE * (1.0 - 1e-9)  # on the panel's side of a jump
EXPONENTS = np.arange(ORDER)
STEPS = 2  # of Newton's method
NOISE = 1e-14  # error of a degree by rounding
_JUMP = 1e-8  # minimum height of a jump at the end of a panel
_MIN_MARGIN = 1e-12  # terms whose degrees differ by less do not cross
# A line is a term's part over a panel, a polynomial of r from -1 to 1 which rises with r. Its column holds the panel's
# middle, from the universe's start, and half of its width; -1 where the term falls, else 1; its lowest and its highest
# degree; and coefficients of the powers of r: of its degree, of the integral of that from -1, and of r times it.
DEGREE = 5
INTEGRAL = DEGREE + ORDER
LEVER = INTEGRAL + ORDER + 1


class PlainLine:
    """A line in floats, for one sample."""

    def __init__(self, first_key: int, keys: list[float], column: list[float], full: list[float]) -> None:
        self.middle, self.half, self.sign, self.low, self.high = column[:DEGREE]
        self.degree, self.integral = column[DEGREE:INTEGRAL], column[INTEGRAL:LEVER]
        self.slopes = [k * factor for k, factor in enumerate(self.degree)][1:]
        self.lever, self.full = column[LEVER:], (full[0], full[1])
        self.keys, self.first_key = keys, first_key

    def cut(self, level: float) -> tuple[float, float]:
        """Return the area and the moment below a level that the line passes, as `_meeting` and `line_integrals` do."""
        key = self.first_key + (level - self.low) / (self.high - self.low)
        j = bisect_right(self.keys, key) - 1
        r, x = _GUESSES[j], self.keys[j]
        if key > x:
            r = (_GUESSES[j + 1] - r) / (self.keys[j + 1] - x) * (key - x) + r
        reach = SPACING * (math.sqrt(1.0 - r * r) + SPACING)
        first, last = max(r - reach, -1.0), min(r + reach, 1.0)
        for _ in range(STEPS):
            off, slope = _polynomial(self.degree, r) - level, _polynomial(self.slopes, r)
            if slope > 0.0 and abs(off) > NOISE:
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


def summed(factors: Array, rows: Array) -> Array:
    """Return the sum of rows, each times its factor."""
    return np.asarray(np.add.reduce(factors[:, None] * rows))


def dot(coefficients: Array, powers: Array) -> Array:
    """Return the values of polynomials, to the same bits for any number of columns; both (count, n)."""
    products = coefficients * powers
    if products.shape[1] == 1:  # of two columns NumPy adds rows in their order, as of many
        products = np.repeat(products, 2, axis=1)
    return np.asarray(np.add.reduce(products)[: powers.shape[1]])


def powers_of(r: Array, count: int) -> Array:
    """Return the powers of r from 0 on, shape (count, ...)."""
    result = np.empty((count, *r.shape))
    result[0], result[1:] = 1.0, r
    return np.asarray(np.multiply.accumulate(result, axis=0, out=result))


def line_integrals(lines: Array, r: Array, cut: Array | float = 0.0) -> tuple[Array, Array]:
    """Return area and moment under lines that are cut from r on."""
    (middle, half, sign), powers = lines[:3], powers_of(r, ORDER + 2)
    area = half * (dot(lines[INTEGRAL:LEVER], powers[:-1]) + cut * (1.0 - r))
    lever = dot(lines[LEVER:], powers) + cut * (1.0 - r * r) / 2
    return area, middle * area + sign * half * half * lever


def degrees_of(shapes: Sequence[Membership], positions: Array) -> Array:
    """Return the degrees of terms at positions of any shape."""
    return np.array([shape.of_many(positions.ravel()).reshape(positions.shape) for shape in shapes])


def with_crossings(edges: Array, shapes: Sequence[Membership]) -> Array:
    """Return the ends of panels in which terms do not cross, from those in which they are smooth."""
    precision = 4e-16 * float(np.abs(edges[[0, -1]]).max())
    positions = points_of(edges[:-1], edges[1:], _INNER_TABLE)
    degrees = degrees_of(shapes, positions)
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
        values, order = degrees_of(shapes, x), np.arange(len(x))
        return np.asarray(values[one[which], order] - values[other[which], order])

    crossings, _ = roots(margins, np.concatenate(starts), np.concatenate(ends), precision)
    return np.unique([*edges, *crossings[np.isfinite(crossings)]])


def quotient_humps(edges: Array, shapes: Sequence[Membership]) -> list[tuple[int, int, int, float]]:
    """Return pairs of terms, panels in which their quotient is the greatest between both ends, and a bound of it."""
    degrees = degrees_of(shapes, points_of(edges[:-1], edges[1:], _INNER_TABLE))
    result = []
    for i, k in itertools.permutations(range(len(shapes)), 2):
        with np.errstate(all="ignore"):
            ratios = np.nan_to_num(degrees[i] / degrees[k], nan=0.0, posinf=np.inf)
        highest = ratios.max(axis=0)
        panels = np.flatnonzero(highest > np.maximum(ratios[0], ratios[-1]) * (1.0 + 1e-9))
        result += [(i, k, int(p), 1.01 * float(highest[p])) for p in panels]
    return result


def term_lines(edges: Array, shapes: Sequence[Membership], ordered: bool) -> tuple[Indices, Array, Array, float]:
    """Return the slots of each panel, the highest first; their lines; the keys of these; and the area's error."""
    starts, ends = edges[:-1], edges[1:]
    half = (ends - starts) / 2
    nodes, positions = (points_of(starts, ends, points).T for points in (_NODES, _INNER_TABLE))
    at_nodes, degrees = (degrees_of(shapes, x) for x in (nodes, positions))
    series = at_nodes @ _SERIES @ _AS_POWERS  # (shapes, panels, powers)
    table = series @ powers_of(_INNER_TABLE, ORDER)
    error = np.abs(table - degrees).max(axis=-1)
    falls = series[..., 1::2].sum(axis=-1) < 0.0
    series[..., 1::2] *= np.where(falls, -1.0, 1.0)[..., None]
    table = series @ powers_of(TABLE, ORDER)
    at_edges = degrees_of(shapes, edges)
    for end, x in (
        (0, np.where(falls, at_edges[:, 1:], at_edges[:, :-1])),
        (-1, np.where(falls, at_edges[:, :-1], at_edges[:, 1:])),
    ):
        table[..., end] = np.where(np.abs(table[..., end] - x) < _JUMP, x, table[..., end])
    error += np.maximum(-np.diff(table, axis=-1), 0.0).sum(axis=-1)  # of terms that turn within a panel
    integral = np.pad(series / (EXPONENTS + 1), ((0, 0), (0, 0), (1, 0)))
    lever = np.pad(series / (EXPONENTS + 2), ((0, 0), (0, 0), (2, 0)))
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
