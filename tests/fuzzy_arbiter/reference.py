"""The Mamdani system by its definition, in rational numbers, independent of the engines."""

import functools
import itertools
from fractions import Fraction

import numpy as np

from fuzzy_arbiter.propositions import And, Is, Not


def degree(shape, x):
    """Degree of a piecewise-linear shape; where it jumps, the greater one."""
    x = Fraction(x)
    points = [(Fraction(a), Fraction(b)) for a, b in shape.points]
    at = [y for a, y in points if a == x]
    if at:
        return max(at)
    if x < points[0][0]:
        return points[0][1]
    for (a, left), (b, right) in itertools.pairwise(points):
        if a < x < b:
            return left + (right - left) * (x - a) / (b - a)
    return points[-1][1]


def degrees_at(system, inputs):
    """Exact degree of a statement at inputs."""
    known = {
        Is(v.name, term.name): degree(term.shape, x)
        for v, x in zip(system.inputs, inputs, strict=True)
        for term in v.terms
    }
    return known.__getitem__


def holds(system, proposition, degrees):
    """Strength of a proposition, from the degrees of its statements: rational numbers, or arrays."""
    if isinstance(proposition, Is):
        return degrees(proposition)
    if isinstance(proposition, Not):
        return 1 - holds(system, proposition.part, degrees)
    parts = [holds(system, part, degrees) for part in proposition.parts]
    if isinstance(proposition, And):
        join = {"min": np.minimum, "prod": lambda a, b: a * b}[system.conjunction]
    else:
        join = {"max": np.maximum, "probor": lambda a, b: 1 - (1 - a) * (1 - b)}[system.disjunction]
    return functools.reduce(join, parts)


def cuts(system, k, degrees):
    """Cut of each term of the k-th output."""
    output = system.outputs[k]
    result = dict.fromkeys(output.term_names, 0)
    for rule in system.rules:
        for conclusion in rule.conclusions:
            if conclusion.variable == output.name:
                strength = holds(system, rule.condition, degrees)
                weight = Fraction(rule.weight) if isinstance(strength, Fraction) else rule.weight
                result[conclusion.term] = np.maximum(result[conclusion.term], strength * weight)
    return list(result.values())


def centroid(output, levels, scaled=False):
    area, moment = integrals(output, levels, scaled)
    return moment / area


def integrals(output, levels, scaled=False):
    """Exact area and moment: between all places where anything can bend, the envelope is a straight line."""
    low, high = map(Fraction, output.universe)
    shapes = [t.shape for t in output.terms]
    knots = {low, high, *(Fraction(x) for s in shapes for x, _ in s.points if low < x < high)}
    area = moment = Fraction(0)
    for a, b in itertools.pairwise(sorted(knots)):
        # each term as a line through its degrees at a third and at two thirds, away from jumps
        third = (b - a) / 3
        lines = []
        for s, level in zip(shapes, levels, strict=True):
            y1, y2 = degree(s, a + third), degree(s, a + 2 * third)
            slope, start = (y2 - y1) / third, 2 * y1 - y2
            lines.append((start * level, slope * level) if scaled else (start, slope))
        flat = [] if scaled else [(level, Fraction(0)) for level in levels]
        meets = {a, b}
        for (p, q), (r, s) in itertools.combinations([*lines, *flat], 2):
            if q != s:
                meets |= {a + x for x in [(r - p) / (q - s)] if 0 < x < b - a}

        def height(x, lines=lines, a=a):
            heights = [p + q * (x - a) for p, q in lines]
            return max(heights if scaled else map(min, heights, levels))

        for x0, x1 in itertools.pairwise(sorted(meets)):
            y0, y1 = height(x0), height(x1)
            area += (x1 - x0) * (y0 + y1) / 2
            moment += (x1 - x0) * (x0 * (2 * y0 + y1) + x1 * (y0 + 2 * y1)) / 6
    return area, moment


def centroids(system, inputs):
    """Exact raw value of every output; None where no rule fires and there is no default."""
    result = []
    for k, output in enumerate(system.outputs):
        levels = cuts(system, k, degrees_at(system, inputs))
        empty = output.default if output.default is None else Fraction(output.default)
        result.append(centroid(output, levels, system.implication == "prod") if any(levels) else empty)
    return result


def weights(system, inputs):
    """Exact range-normalized weight of every output."""
    result = []
    for output, raw in zip(system.outputs, centroids(system, inputs), strict=True):
        alone = [
            centroid(output, [Fraction(i == j) for i in range(len(output.terms))]) for j in range(len(output.terms))
        ]
        result.append(min(max((raw - min(alone)) / (max(alone) - min(alone)), Fraction(0)), Fraction(1)))
    return result
