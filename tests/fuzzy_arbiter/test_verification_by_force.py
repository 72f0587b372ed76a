"""Verification against brute force: random small systems, all rows, and dense samples of graded inputs."""

import functools
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import Variable
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.verification import verify as verify_system
from fuzzy_arbiter.verification.cells import stretches
from tests.examples import examples
from tests.fuzzy_arbiter import reference
from tests.fuzzy_arbiter.systems import LOW_HIGH, shapes, systems
from tests.fuzzy_arbiter.test_verification import NAMES, verdicts

small = systems(norms=False, outputs=LOW_HIGH)


def cuts(s, degrees):
    return {
        Is(output.name, term): cut
        for k, output in enumerate(s.outputs)
        for term, cut in zip(output.term_names, reference.cuts(s, k, degrees), strict=True)
    }


def at(s, positions):
    """Cuts at many positions, an array of shape (n, inputs)."""
    known = {}
    for i, v in enumerate(s.inputs):
        values, index = np.unique(positions[:, i], return_inverse=True)
        for term in v.terms:
            known[Is(v.name, term.name)] = np.array([float(reference.degree(term.shape, x)) for x in values])[index]
    return cuts(s, known.__getitem__)


def faults(s, cut, above):
    """Undefined outputs, outputs in two terms, and whether two are in their greatest term, for each sample."""
    undefined = [sum(cut[Is(v.name, t)] for t in v.term_names) == 0 for v in s.outputs]
    double = [sum(cut[Is(v.name, t)] > above for t in v.term_names) >= 2 for v in s.outputs]
    high = sum((cut[Is(v.name, "high")] > above) + np.int64(0) for v in s.outputs) >= 2
    return functools.reduce(np.logical_or, undefined), functools.reduce(np.logical_or, double), high


def samples(s):
    """Knots and positions between them in all combinations, and random ones."""
    grid = np.linspace(0, 1, 17 if len(s.inputs) < 3 else 9)
    product = np.stack(np.meshgrid(*[grid] * len(s.inputs)), axis=-1).reshape(-1, len(s.inputs))
    return np.vstack([product, np.random.default_rng(7).uniform(0, 1, (100, len(s.inputs)))])


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
@settings(max_examples=examples(150), deadline=None)
@given(small)
def test_verdicts_against_brute_force(s):
    """On crisp rows against all rows, on graded inputs against dense samples."""
    v = verify_system(s, as_criteria=True)
    assert None not in verdicts(v)
    check_graded(s, v)
    rows = list(itertools.product(*(i.term_names for i in s.inputs)))
    seen = [False] * 3
    for row in rows:
        terms = {Is(i.name, t) for i, t in zip(s.inputs, row, strict=True)}
        cut = cuts(s, lambda statement, terms=terms: np.float64(statement in terms))
        undefined, _, high = faults(s, cut, 0.5)
        found = undefined, faults(s, cut, 0.999)[1], high
        seen = [before or bool(now) for before, now in zip(seen, found, strict=True)]
    assert v.row_count == len(rows)
    assert verdicts(v)[:3] == tuple(not found for found in seen)


@pytest.mark.medium
@settings(max_examples=examples(80), deadline=None)
@given(systems(outputs=LOW_HIGH))
def test_verdicts_with_other_connectives_against_brute_force(s):
    v = verify_system(s, as_criteria=True)
    assert v.graded_complete is not None
    check_graded(s, v)


@settings(max_examples=examples(100))
@given(st.lists(shapes(), min_size=1, max_size=3))
def test_stretches_against_samples(drawn):
    v = Variable("x", (0, 1), {f"t{i}": shape for i, shape in enumerate(drawn)})
    found = stretches(v)
    for x in np.linspace(0, 1, 65).tolist():
        total = float(sum(reference.degree(t.shape, x) for t in v.terms))
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
