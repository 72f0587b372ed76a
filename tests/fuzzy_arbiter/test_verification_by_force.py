"""Verification against brute force: random small systems, all rows, and dense samples of graded inputs."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import Output, Rule, Shape, System, Term, Variable, falling, rising
from fuzzy_arbiter.propositions import And, Is, Not, Or
from fuzzy_arbiter.verification import verify
from fuzzy_arbiter.verification.cells import stretches
from tests.examples import examples

NAMES = ("complete", "consistent", "exclusive", "graded_complete", "graded_consistent", "graded_exclusive")


def verdicts(verification):
    return tuple(getattr(verification, name) for name in NAMES)


def output(name):
    return Output(name, (0, 1), (Term("low", falling(0, 1)), Term("high", rising(0, 1))))


def degree(shape, x):
    """Degree by the shape's definition, in another way than the package."""
    points = shape.points
    at = [y for px, y in points if px == x]
    if at:
        return max(at)
    before, after = [p for p in points if p[0] < x], [p for p in points if p[0] > x]
    if not before or not after:
        return (before[-1] if before else after[0])[1]
    (a, ya), (b, yb) = before[-1], after[0]
    return ya * (b - x) / (b - a) + yb * (x - a) / (b - a)


def held(proposition, of, conjunction="min", disjunction="max"):
    if isinstance(proposition, Is):
        return of(proposition)
    if isinstance(proposition, Not):
        return 1 - held(proposition.part, of, conjunction, disjunction)
    parts = [held(part, of, conjunction, disjunction) for part in proposition.parts]
    if isinstance(proposition, And):
        return np.minimum.reduce(parts) if conjunction == "min" else np.multiply.reduce(parts)
    return np.maximum.reduce(parts) if disjunction == "max" else 1 - np.multiply.reduce([1 - p for p in parts])


def cuts(s, of, n=1):
    """Cut of every output term, for n samples."""
    result = {Is(v.name, t): np.zeros(n) for v in s.outputs for t in v.term_names}
    for rule in s.rules:
        strength = held(rule.condition, of, s.conjunction, s.disjunction) * rule.weight
        for conclusion in rule.conclusions:
            result[conclusion] = np.maximum(result[conclusion], strength)
    return result


def at(s, places):
    """Cuts at many places, an array of shape (n, inputs)."""
    known = {}
    for i, v in enumerate(s.inputs):
        values, index = np.unique(places[:, i], return_inverse=True)
        for term in v.terms:
            known[Is(v.name, term.name)] = np.array([degree(term.shape, x) for x in values.tolist()])[index]
    return cuts(s, known.__getitem__, len(places))


def faults(s, cut, above):
    """Undefined outputs, outputs in two terms, and whether two are in their greatest term, for each sample."""
    undefined = [sum(cut[Is(v.name, t)] for t in v.term_names) == 0 for v in s.outputs]
    double = [sum(cut[Is(v.name, t)] > above for t in v.term_names) >= 2 for v in s.outputs]
    high = sum((cut[Is(v.name, "high")] > above).astype(int) for v in s.outputs) >= 2
    return np.any(undefined, axis=0), np.any(double, axis=0), high


quarters = st.integers(0, 4).map(lambda q: q / 4)


@st.composite
def shapes(draw):
    places = sorted(draw(st.lists(st.integers(0, 4), min_size=1, max_size=4)))
    places = [x for i, x in enumerate(places) if places[max(0, i - 2) : i] != [x, x]]
    return Shape(tuple((x, draw(quarters)) for x in places))


@st.composite
def systems(draw, connectives=False):
    inputs = tuple(
        Variable(name, (0, 4), tuple(Term(f"t{j}", draw(shapes())) for j in range(draw(st.integers(1, 3)))))
        for name in "abc"[: draw(st.integers(2, 3))]
    )
    outputs = tuple(map(output, "yz"[: draw(st.integers(1, 2))]))
    statements = st.sampled_from([v[t] for v in inputs for t in v.term_names])
    conditions = st.recursive(
        statements,
        lambda inner: st.one_of(
            inner.map(Not), st.lists(inner, min_size=2, max_size=3).flatmap(
                lambda parts: st.sampled_from([And(tuple(parts)), Or(tuple(parts))])
            )
        ),
        max_leaves=5,
    )  # fmt: skip
    conclusions = st.sampled_from([o[t] for o in outputs for t in o.term_names])
    weights = st.sampled_from([1.0, 1.0, 0.75, 0.5])
    rules = draw(
        st.lists(st.builds(Rule, conditions, conclusions.map(lambda c: (c,)), weights), min_size=1, max_size=6)
    )
    settings = {}
    if connectives:
        settings = {"conjunction": draw(st.sampled_from(["min", "prod"]))}
        settings["disjunction"] = draw(st.sampled_from(["max", "probor"]))
    return System(inputs, outputs, tuple(rules), **settings)


def samples(s):
    """Knots and places between them in all combinations, and random ones."""
    grid = np.linspace(0, 4, 17 if len(s.inputs) == 2 else 9)
    product = np.stack(np.meshgrid(*[grid] * len(s.inputs)), axis=-1).reshape(-1, len(s.inputs))
    return np.vstack([product, np.random.default_rng(7).uniform(0, 4, (300, len(s.inputs)))])


def check_graded(s, v):
    seen = faults(s, at(s, samples(s)), 0.5 + 1e-12)
    for name, flags in zip(NAMES[3:], seen, strict=True):
        holds = getattr(v, name)
        assert holds is not True or not np.any(flags), name
        places = [f.place for f in v.findings if f.about == name and f.place is not None]
        assert (holds is False) == bool(places)
        for place in places:
            inputs = np.array([[place.get(i.name, i.universe[0]) for i in s.inputs]])
            assert np.all(faults(s, at(s, inputs), 0.5)[NAMES[3:].index(name)]), (name, place)


@pytest.mark.medium
@settings(max_examples=examples(150))
@given(systems())
def test_verdicts_on_graded_inputs_against_brute_force(s):
    v = verify(s)
    assert None not in verdicts(v)
    check_graded(s, v)


@pytest.mark.medium
@settings(max_examples=examples(80))
@given(systems(connectives=True))
def test_verdicts_with_other_connectives_against_brute_force(s):
    v = verify(s)
    assert v.graded_complete is not None
    check_graded(s, v)


@pytest.mark.medium
@settings(max_examples=examples(100))
@given(systems())
def test_verdicts_on_crisp_rows_against_all_rows(s):
    v = verify(s)
    seen = dict.fromkeys(NAMES[:3], False)
    rows = list(itertools.product(*(i.term_names for i in s.inputs)))
    for row in rows:
        terms = {Is(i.name, t) for i, t in zip(s.inputs, row, strict=True)}
        cut = cuts(s, lambda statement, terms=terms: np.array([float(statement in terms)]))
        undefined, _, high = (bool(np.any(x)) for x in faults(s, cut, 0.5))
        full = bool(np.any(faults(s, cut, 0.999)[1]))
        for name, found in zip(NAMES[:3], (undefined, full, high), strict=True):
            seen[name] |= found
    assert v.row_count == len(rows)
    assert {name: getattr(v, name) for name in NAMES[:3]} == {name: not found for name, found in seen.items()}


@settings(max_examples=examples(100))
@given(st.lists(shapes(), min_size=1, max_size=3))
def test_stretches_against_samples(terms):
    v = Variable("x", (0, 4), tuple(Term(f"t{i}", shape) for i, shape in enumerate(terms)))
    found = stretches(v)
    for x in np.linspace(0, 4, 65).tolist():
        total = sum(degree(t.shape, x) for t in v.terms)
        inside = {
            s.kind: s
            for s in found
            if s.start < x < s.end or (x == s.start and s.start_in) or (x == s.end and s.end_in)
        }
        assert ("below" in inside) == (total < 1 - 1e-12)
        assert ("above" in inside) == (total > 1 + 1e-12)
        assert ("gap" in inside) == (total == 0)
        for stretch in inside.values():
            assert stretch.least - 1e-12 <= total <= stretch.greatest + 1e-12
