"""Worst error of each defuzzifier over random outputs, against integrals over many thousand cells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from fuzzy_arbiter import Output, Rule, System, Term, Variable, rising, trapezoid, triangle
from fuzzy_arbiter.engines.exact import ExactEngine
from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.shapes import Array, Membership, Shape
from fuzzy_arbiter.terms.curves import Curve
from fuzzy_arbiter.terms.kinds import KINDS
from fuzzy_arbiter.terms.norms import AGGREGATIONS, T_NORMS

SYSTEMS = 1000
DEFUZZIFIERS = ("centroid", "bisector", "mom", "som", "lom")
BOUND = 1e-9  # maximum error: of the universe's width, of the area, and of the maximum height
_CELLS = 20_000  # number of equal cells of the reference, before their division
_HALVINGS = 50
_STRIDE = 53  # from one system to the next in the list of all operators, which it visits in turn
_MAX_CELLS = 100_000
# Lobatto's rule has the ends of a cell among its points, so that it sees a bend near one
_NODES = np.array([-1.0, -np.sqrt(3 / 7), 0.0, np.sqrt(3 / 7), 1.0])
_WEIGHTS = np.array([9.0, 49.0, 64.0, 49.0, 9.0]) / 90.0
_TOP = 1e-13  # fraction of the maximum height within which the reference counts a place as one of the greatest


@dataclass(frozen=True)
class Case:
    """A system whose inputs are the strengths of its rules, one rule for each term of its output, and a sample."""

    system: System
    cuts: tuple[float, ...]

    @property
    def output(self) -> Output:
        """The only output."""
        return self.system.outputs[0]


def random_cases(count: int, seed: int = 0) -> Iterator[Case]:
    """Yield systems with random terms of all kinds, and all implications, aggregations and defuzzifiers in turn."""
    rng = np.random.default_rng(seed)
    ways = [(d, a, i) for i in T_NORMS for a in AGGREGATIONS for d in DEFUZZIFIERS]
    made = 0
    while made < count:
        defuzzifier, aggregation, implication = ways[made * _STRIDE % len(ways)]
        low = float(rng.choice([0.0, -3.0, 100.0]))
        width = float(rng.choice([1.0, 10.0, 25.0]))
        terms = tuple(Term(f"t{j}", _random_shape(rng, low, width)) for j in range(rng.integers(1, 5)))
        try:
            output = Output("y", (low, low + width), terms, None, defuzzifier, aggregation)  # type: ignore[arg-type]
        except DefinitionError:  # a term has no area in the universe
            continue
        yield Case(strengths_system(output, implication), _random_cuts(rng, len(terms)))
        made += 1


def strengths_system(output: Output, implication: str) -> System:
    """Return the system whose inputs are the strengths of rules, one for each term of an output."""
    inputs = tuple(Variable(f"x{j}", (0, 1), (Term("on", rising(0, 1)),)) for j in range(len(output.terms)))
    rules = tuple(Rule(Is(v.name, "on"), (Is("y", t.name),)) for v, t in zip(inputs, output.terms, strict=True))
    return System(inputs, (output,), rules, implication=implication)


def _random_cuts(rng: np.random.Generator, count: int) -> tuple[float, ...]:
    """Return strengths: none, one, two or all fire, some alike, some whole, some slight."""
    drawn = rng.choice(3, p=[0.6, 0.2, 0.2])
    cuts = rng.random(count) if drawn == 0 else np.full(count, rng.choice([1.0, 0.5, 0.75]))
    if drawn == 2:
        cuts = rng.choice([1.0, 0.999, 1e-3, 1e-9, 0.5], count)
    fires = rng.permutation(count) < rng.choice([0, 1, 2, count], p=[0.05, 0.2, 0.25, 0.5])
    return tuple(np.where(fires, cuts, 0.0).tolist())


def _random_shape(rng: np.random.Generator, low: float, width: float) -> Membership:
    """Return a straight or a smooth term, from a thousandth of the universe's width to all of it."""
    kind = str(rng.choice(["triangle", "trapezoid", "jump", *KINDS]))
    scale = width * 10 ** rng.uniform(-3.0, 0.0)
    center = low + width * rng.uniform(-0.1, 1.1)
    a, b, c, d = np.sort(center + scale * rng.uniform(-1.0, 1.0, 4)).tolist()
    height = float(rng.choice([1.0, 1.0, 0.7]))
    slope = float(rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(0.0, 1.5) / scale)
    parameters: dict[str, tuple[float, ...]] = {
        "gaussian": (center, scale),
        "gaussian2": (b, scale, c, scale * rng.uniform(0.1, 1.0)),
        "bell": (center, scale, float(rng.uniform(0.5, 6.0))),
        "sigmoid": (center, slope),
        "sigmoid_difference": (a, abs(slope), abs(slope) * float(rng.uniform(0.5, 2.0)), d),
        "sigmoid_product": (a, abs(slope), -abs(slope), d),
        "z_shape": (a, d),
        "s_shape": (a, d),
        "pi_shape": (a, b, c, d),
        "cosine": (center, scale),
        "spike": (center, scale),
        "concave": (center, center + slope),
        "arc": (a, d) if slope > 0.0 else (d, a),
        "semi_ellipse": (a, d),
        "singleton": (center,),
    }
    if kind == "triangle":
        return triangle(a, c, d)
    if kind == "trapezoid":
        return trapezoid(a, b, c, d)
    if kind == "jump":
        return Shape(((a, 0.25), (b, 0.25), (b, 1.0), (c, 1.0), (c, 0.0)))
    return Curve(kind, parameters[kind], height)


class Reference:
    """The joined terms of a case on cells, divided until two rules of quadrature agree on each."""

    def __init__(self, case: Case) -> None:
        output = case.output
        self.low, self.width = output.universe[0], output.universe[1] - output.universe[0]
        self._cuts, self._implication = case.cuts, T_NORMS[case.system.implication].array
        self._join = AGGREGATIONS[output.aggregation].array
        self._shapes = [term.membership for term in output.terms]
        own = [x for shape in self._shapes for x in (*shape.breaks(output.universe), *_numbers(shape))]
        away = np.concatenate([[0.0], *(s * self.width * 2.0 ** -np.arange(1.0, 40.0) for s in (-1, 1))])
        near = (np.array(own)[:, None] + away).ravel() if own else np.zeros(0)
        edges = np.concatenate([np.linspace(*output.universe, _CELLS + 1), near])
        self.edges = np.unique(edges[(edges >= output.universe[0]) & (edges <= output.universe[1])])
        starts, ends = self.edges[:-1], self.edges[1:]
        done: list[Array] = []
        areas, moments = self._integrals(starts, ends)
        whole = max(float(areas.sum()), 1e-300)
        for _ in range(_HALVINGS):
            middles = (starts + ends) / 2
            (left, first), (right, second) = self._integrals(starts, middles), self._integrals(middles, ends)
            off = np.abs(left + right - areas) * self.width + np.abs(first + second - moments)
            rough = (off > 1e-16 * whole * self.width) & (middles > starts) & (ends > middles)
            if rough.sum() > _MAX_CELLS:  # what is left is rounding
                break
            done.append(np.array([starts, ends, left + right, first + second])[:, ~rough])
            starts, ends = (np.concatenate(x) for x in ((starts[rough], middles[rough]), (middles[rough], ends[rough])))
            areas, moments = (np.concatenate([x[rough], y[rough]]) for x, y in ((left, right), (first, second)))
        done.append(np.array([starts, ends, areas, moments]))
        columns = np.concatenate(done, axis=1)
        self.starts, self.ends, self.areas, self.moments = columns[:, np.argsort(columns[0])]

    def height(self, places: Array) -> Array:
        """Return the joined height at places."""
        height = np.zeros(len(places))
        for shape, cut in zip(self._shapes, self._cuts, strict=True):
            height = self._join(height, self._implication(np.full(len(places), cut), _degrees(shape, places)))
        return height

    def _integrals(self, starts: Array, ends: Array) -> tuple[Array, Array]:
        half = (ends - starts) / 2
        places = (starts + ends) / 2 + _NODES[:, None] * half
        heights = self.height(places.ravel()).reshape(places.shape) * _WEIGHTS[:, None]
        heights[:, half < np.spacing(max(abs(self.low), abs(self.low + self.width)))] = (
            0.0  # around a singleton, or a jump
        )
        return heights.sum(axis=0) * half, (heights * (places - self.low)).sum(axis=0) * half

    def error(self, defuzzifier: str, value: float) -> float:
        """Return the error of a value: of the width for a centroid, of the area for a bisector, else of the height."""
        area = self.areas.sum()
        if defuzzifier == "centroid":
            return float(abs(self.low + self.moments.sum() / area - value) / self.width)
        if defuzzifier == "bisector":
            i = int(np.clip(np.searchsorted(self.starts, value) - 1, 0, len(self.starts) - 1))
            part = self._integrals(self.starts[i : i + 1], np.array([min(value, self.ends[i])]))[0][0]
            return float(abs((self.areas[:i].sum() + part) / area - 0.5))
        places = np.unique(np.concatenate([self.edges, self.starts, self.ends, (self.starts + self.ends) / 2]))
        places, heights = self._with_tops(places)
        if defuzzifier != "mom":
            around = value + self.width * np.array([-1e-12, 0.0, 1e-12])
            around = around[(around >= self.low) & (around <= self.low + self.width)]
            return float(1.0 - self.height(around).max() / heights.max())
        return self._off_mean(value, places, heights)

    def _with_tops(self, places: Array) -> tuple[Array, Array]:
        """Return places with those between them where the height turns, by thirds, and their heights."""
        heights = self.height(places)
        middle = heights[1:-1]
        likely = (middle >= heights.max() * (1.0 - 1e-3)) & (middle >= heights[:-2]) & (middle > heights[2:])
        low, high = places[:-2][likely], places[2:][likely]
        for _ in range(50):
            left, right = low + (high - low) / 3, high - (high - low) / 3
            rises = self.height(left) < self.height(right)
            low, high = np.where(rises, left, low), np.where(rises, high, right)
        places = np.unique(np.concatenate([places, low, high]))
        return places, self.height(places)

    def _off_mean(self, value: float, places: Array, heights: Array) -> float:
        """Return the error of a mean of the places of the maximum height."""
        top = np.flatnonzero(heights >= heights.max() * (1.0 - _TOP))
        first = np.flatnonzero(np.diff(top, prepend=-2) > 1)
        last = np.append(first[1:] - 1, len(top) - 1)
        starts, ends = places[top[first]], places[top[last]]
        if len(starts) == 1:
            off = max(starts[0] - value, value - ends[0], 0.0) / self.width
            return float(min(off, 1.0 - self.height(np.array([value]))[0] / heights.max()))
        if (ends - starts).sum() > 1e-3 * self.width:
            return 0.0
        return float(max(starts[0] - value, value - ends[-1], 0.0)) / self.width


def _degrees(shape: Membership, places: Array) -> Array:
    """Return degrees, of which those that only round to 0 or 1 are within them: operators jump there."""
    degrees = shape.of_many(places)
    if not isinstance(shape, Curve):
        return degrees
    constant = np.array([isinstance(tree, float) for tree in shape.trees])[np.searchsorted(shape.ends, places)]
    inside = ~constant & ~np.isin(places, (*shape.parameters, *shape.ends))
    return np.where(inside, np.clip(degrees, 1e-300, 1.0 - 2.0**-53), degrees)


def _numbers(shape: Membership) -> tuple[float, ...]:
    return shape.parameters if isinstance(shape, Curve) else ()


def errors(case: Case) -> tuple[float, str]:
    """Return the error of the exact engine for a case, and what it says about its bound; NaN where nothing has area."""
    engine = ExactEngine(case.system)
    value = engine.centroids(case.cuts)[0]
    reference = Reference(case)
    method = engine.methods["y"]
    if case.output.defuzzifier in ("mom", "som", "lom"):
        # where single places are the greatest, as of singletons, the reference may not meet them
        some = case.system.implication != "drastic_product" and reference.height(reference.starts).max() > 0.0
    else:
        some = reference.areas.sum() > 1e-14 * reference.width * max(case.cuts)
    if not some:
        return np.nan, method
    return (np.inf if np.isnan(value) else reference.error(case.output.defuzzifier, value)), method


def print_worst(systems: int, seed: int) -> None:
    """Print the worst error of each defuzzifier over random systems, and how many are beyond the bound."""
    by_defuzzifier: dict[str, list[float]] = {name: [] for name in DEFUZZIFIERS}
    for case in random_cases(systems, seed):
        error, _ = errors(case)
        by_defuzzifier[case.output.defuzzifier].append(error)
    print(f"{'defuzzifier':12} {'systems':>8} {'without area':>13} {'worst error':>12} {f'beyond {BOUND:g}':>13}")
    for name, values in by_defuzzifier.items():
        known: Any = np.array(values)
        empty = int(np.isnan(known).sum())
        worst = float(np.nanmax(known)) if empty < len(known) else 0.0
        print(f"{name:12} {len(known):8} {empty:13} {worst:12.1e} {int((known > BOUND).sum()):13}")
