"""The Mamdani system by its definition, in rational numbers, independent of the engines."""

import itertools
from fractions import Fraction

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


def holds(system, proposition, inputs):
    if isinstance(proposition, Is):
        i = [v.name for v in system.inputs].index(proposition.variable)
        (shape,) = (t.shape for t in system.inputs[i].terms if t.name == proposition.term)
        return degree(shape, inputs[i])
    if isinstance(proposition, Not):
        return 1 - holds(system, proposition.part, inputs)
    parts = [holds(system, part, inputs) for part in proposition.parts]
    result = parts[0]
    for other in parts[1:]:
        if isinstance(proposition, And):
            result = min(result, other) if system.conjunction == "min" else result * other
        else:
            result = max(result, other) if system.disjunction == "max" else result + other - result * other
    return result


def cuts(system, k, inputs):
    """Cut of each term of the k-th output."""
    output = system.outputs[k]
    result = dict.fromkeys(output.term_names, Fraction(0))
    for rule in system.rules:
        for conclusion in rule.conclusions:
            if conclusion.variable == output.name:
                strength = holds(system, rule.condition, inputs) * Fraction(rule.weight)
                result[conclusion.term] = max(result[conclusion.term], strength)
    return list(result.values())


def centroid(output, levels, scaled=False):
    """Exact centroid: between all places where anything can bend, the envelope is a straight line."""
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
    return moment / area


def centroids(system, inputs):
    """Exact raw value of every output; None where no rule fires and there is no default."""
    result = []
    for k, output in enumerate(system.outputs):
        levels = cuts(system, k, inputs)
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
