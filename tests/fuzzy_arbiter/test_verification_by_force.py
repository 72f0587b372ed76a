"""Verification against brute force: random small systems, all rows, and dense samples of graded inputs."""

import functools
import itertools
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import Arbiter, Output, System, Variable, curve, falling, rising
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.terms.norms import S_NORMS, T_NORMS
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
        if any(0.0 < abs(x - end) < 1e-12 for s in found for end in (s.start, s.end)):  # an end is rounded
            continue
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


@pytest.mark.medium(fast=12)
@pytest.mark.parametrize("conjunction", T_NORMS)
@pytest.mark.parametrize("disjunction", S_NORMS)
def test_completeness_of_any_norms_and_curves_against_samples(conjunction, disjunction):
    """Samples refute no yes, the engine has no value where a no says so, and the usual norms are decided."""
    x = Variable("x", (0, 10), {"a": curve("gaussian", 3, 1), "b": curve("s_shape", 2, 9)})
    z = Variable("z", (0, 10), {"a": rising(2, 4), "b": falling(2, 4)})
    y = Output("y", (0, 1), LOW_HIGH[0].terms)
    w = Output("w", (0, 1), LOW_HIGH[0].terms, defuzzifier="bisector")
    cases = (
        ("if z is a and x is a then y is low", "if z is very b or x is not b then y is high"),
        ("if not (z is a and z is b) then y is low",),
        ("if not (z is a or x is b) then y is low", "if z is a then y is high"),
        ("if z is a then y is low", "if y is low or z is b then w is low", "if z is b and w is not low then y is high"),
    )
    for rules in cases:
        concluded = tuple(v for v in (y, w) if any(f"then {v.name}" in rule for rule in rules))
        made = System((x, z), concluded, rules, conjunction=conjunction, disjunction=disjunction)
        answer, arbiter = verify_system(made), Arbiter(made)
        rng = np.random.default_rng(1)
        undefined = np.isnan(arbiter.batch(np.round(rng.uniform(0, 10, (400, 2)), 1)))
        assert answer.graded_complete is not True or not undefined.any()
        for finding in answer.findings:
            if finding.about == "graded_complete" and finding.place is not None:
                k = [v.name for v in concluded].index(re.search("output '(.)'", finding.text)[1])
                assert np.isnan(arbiter([finding.place.get(v.name, 0.0) for v in made.inputs])[k])
        if conjunction in ("min", "prod") and disjunction in ("max", "probor"):
            assert answer.graded_complete is not None or "w is not" in rules[-1]
