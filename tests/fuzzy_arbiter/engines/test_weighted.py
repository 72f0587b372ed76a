"""Weighted outputs of Sugeno and Tsukamoto, against sums computed here; defaults, locks, chains, hedges."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fuzzy_arbiter import Arbiter, Output, Rule, System, Term, Variable, falling, rising, triangle
from fuzzy_arbiter.errors import DefinitionError, EngineError, InputError, UnsupportedError
from fuzzy_arbiter.formats import reads, writes
from fuzzy_arbiter.propositions import Anything, Hedged, Is, Not
from fuzzy_arbiter.terms.curves import curve
from fuzzy_arbiter.terms.values import Constant, Formula, Linear

X = Variable("x", (0, 10), (Term("low", falling(0, 10)), Term("high", rising(0, 10))))
Z = Variable("z", (-5, 5), (Term("near", curve("gaussian", 0, 2)),))


def output(*shapes, **options):
    terms = tuple(Term(f"t{j}", shape) for j, shape in enumerate(shapes))
    return Output("y", (-100, 100), terms, **{"defuzzifier": "average", "aggregation": "sum", **options})


def system(made, *rules, **options):
    return System((X, Z), (made,), rules, **options)


def check(system, inputs, expected, tolerance=1e-13):
    """One sample and many."""
    arbiter = Arbiter(system)
    assert arbiter(inputs) == pytest.approx(expected, abs=tolerance)
    assert arbiter.batch([inputs])[0] == pytest.approx(list(expected), abs=tolerance)


RULES = ("if x is low then y is t0", "if x is high and z is near then y is t1", "if x is high then y is t1")


@pytest.mark.parametrize("defuzzifier", ["average", "sum"])
@pytest.mark.parametrize("aggregation", ["sum", "max", "probor"])
def test_values_are_weighted_by_the_strengths_of_their_rules(defuzzifier, aggregation):
    made = output(Constant(3.0), Linear((2.0, -1.0), 0.5), defuzzifier=defuzzifier, aggregation=aggregation)
    arbiter = Arbiter(system(made, *RULES))
    for x, z in ((2.0, 1.0), (7.5, -3.0), (10.0, 0.0)):
        low, high = 1 - x / 10, x / 10
        both = min(high, math.exp(-z * z / 8))
        w1 = {"sum": both + high, "max": max(both, high), "probor": both + high - both * high}[aggregation]
        total = low * 3.0 + w1 * (2.0 * x - z + 0.5)
        expected = total / (low + w1) if defuzzifier == "average" else total
        check(arbiter.system, [x, z], (expected,))
    assert arbiter.engine == "exact"
    assert "'y': weighted values, to rounding" in arbiter.engine_reason


def test_formula_may_use_inputs_and_earlier_outputs():
    first = Output("u", (0, 10), (Term("t", Formula("x * x")),), None, "average", "sum")
    second = Output("v", (0, 10), (Term("t", Formula("abs(u - z)")),), None, "average", "sum")
    rule = "if x is any then u is t and v is t"
    for inputs, expected in (([3.0, 2.0], (9.0, 7.0)), ([1.0, 4.0], (1.0, 3.0))):
        check(System((X, Z), (first, second), [rule]), inputs, expected)
    with pytest.raises(DefinitionError, match=r"output 'v': .*asks for u, expected inputs, or outputs before its own"):
        System((X, Z), (second, first), [rule])


def test_tsukamoto_inverts_the_term_at_the_rule_strength():
    made = output(rising(0.0, 50.0), curve("sigmoid", 20.0, -2.0), falling(-10.0, 10.0))
    rules = ("if x is low then y is t0", "if x is high then y is t1", "if x is high then y is t2")
    w0, w1 = 0.75, 0.25
    places = (50 * w0, 20.0 - math.log(w1 / (1 - w1)) / 2.0, 10.0 - 20.0 * w1)
    expected = (w0 * places[0] + w1 * places[1] + w1 * places[2]) / (w0 + w1 + w1)
    check(system(made, *rules), [2.5, 0.0], (expected,), 1e-12)
    with pytest.raises(DefinitionError, match="'t0' is no value, nor does it only rise or only fall, as the defuz"):
        output(triangle(0, 1, 2))
    with pytest.raises(DefinitionError, match="'t0' is a value, expected a membership function, or one of the defuz"):
        output(Constant(1.0), defuzzifier="centroid")


def test_undefined_value_gives_the_default_or_nan():
    made = output(Formula("1 / (x - 5)"))
    arbiter = Arbiter(system(made, "if x is high then y is t0"))
    assert arbiter([9.0, 0.0]) == (0.25,)
    assert math.isnan(arbiter([5.0, 0.0])[0])
    assert np.isnan(arbiter.batch([[9.0, 0.0], [0.0, 0.0]])[:, 0]).tolist() == [False, True]
    settled = Arbiter(system(replace(made, default=-1.0), "if x is high then y is t0"))
    assert settled.batch([[5.0, 0.0], [9.0, 0.0], [0.0, 0.0]])[:, 0].tolist() == [-1.0, 0.25, -1.0]


def test_locked_output_is_clipped_or_holds_its_previous_value():
    held = replace(output(Constant(150.0)), lock_range=True)
    assert Arbiter(system(held, "if x is high then y is t0"))([9.0, 0.0]) == (100.0,)
    kept = replace(output(Linear((1.0, 0.0))), lock_previous=True, default=-1.0)
    arbiter = Arbiter(system(kept, "if x is high and z is near then y is t0"))
    rows = [[0.0, 0.0], [4.0, 0.0], [0.0, 1.0], [6.0, 0.0], [0.0, 0.0]]
    assert arbiter.batch(rows)[:, 0].tolist() == [-1.0, 4.0, 4.0, 6.0, 6.0]
    assert arbiter([4.0, 0.0]) == (4.0,)
    with pytest.raises(InputError, match="no rule fires for the output 'y', which keeps its previous value"):
        arbiter([0.0, 0.0])  # a sample alone has none before it
    assert arbiter.explain([0.0, 0.0]).result == (-1.0,) and "its default -1" in str(arbiter.explain([0.0, 0.0]))
    assert (arbiter.batch([*rows[:2], *rows[:1] * 10_000])[1:, 0] == 4.0).all()  # more rows than a block
    free = Arbiter(system(replace(kept, default=None), "if x is high and z is near then y is t0"))
    assert np.isnan(free.batch(rows)[:, 0]).tolist() == [True, False, False, False, False]


def test_conditions_may_use_earlier_outputs():
    power = Output("power", (0, 1), (Term("less", falling(0, 1)), Term("more", rising(0, 1))))
    made = System(
        (X,),
        (power, replace(output(Constant(1.0), Constant(2.0)), name="fan")),
        ("if x is low then power is less", "if x is high then power is more", "if power is less then fan is t0",
         "if power is very more then fan is t1"),
    )  # fmt: skip
    for x in (2.0, 5.0, 9.0):
        low, high = 1 - x / 10, (x / 10) ** 2
        check(made, [x], (Arbiter(made)([x])[0], (low + 2 * high) / (low + high)), 1e-14)
    with pytest.raises(DefinitionError, match=r"R1 .*asks for output 'power', on which no rule before concludes"):
        replace(made, rules=(made.rules[2],))
    with pytest.raises(EngineError, match="engine 'skfuzzy': R3 asks for the output 'power'"):
        Arbiter(made, engine="skfuzzy")


@pytest.mark.parametrize(
    ("condition", "degree"),
    [
        (Hedged("very", Is("x", "low")), 0.36),
        (Hedged("somewhat", Is("x", "low")), math.sqrt(0.6)),
        (Not(Hedged("very", Is("x", "low"))), 0.64),
        (Hedged("very", Not(Is("x", "low"))), 0.16),
        (Hedged("very", Hedged("very", Is("x", "low"))), 0.1296),
        (Hedged("extremely", Is("x", "low") & Is("x", "high")), 0.32),
        (Anything("x"), 1.0),
        (Not(Anything("x")), 0.0),
    ],
)
def test_hedges_modify_strengths(condition, degree):
    made = output(Constant(1.0), defuzzifier="sum", default=0.0)
    whole = system(made, Rule(condition, (Is("y", "t0"),)))
    check(whole, [4.0, 0.0], (degree,), 1e-15)
    assert system(made, str(whole.rules[0])) == whole


def test_input_without_terms_is_allowed_only_in_formulas():
    bare = Variable("w", (0, 1), ())
    made = output(Linear((0.0, 0.0, 1.0)))
    whole = System((X, Z, bare), (made,), ("if x is any then y is t0",))
    assert Arbiter(whole)([0.0, 0.0, 0.5]) == (0.5,)
    with pytest.raises(DefinitionError, match="variable 'w': no terms, expected at least one"):
        System((X, Z, bare), (output(Constant(1.0)),), ("if x is any then y is t0",))


def test_values_of_inputs_leave_no_range_to_normalize():
    made = system(output(Linear((1.0, 0.0))), "if x is high then y is t0")
    with pytest.raises(EngineError, match="output 'y': its terms depend on the inputs"):
        Arbiter(replace(made, normalization="range"))
    two = system(output(Constant(2.0), Constant(6.0)), "if x is low then y is t0", "if x is high then y is t1")
    assert Arbiter(replace(two, normalization="range"))([2.5, 0.0]) == pytest.approx((0.25,))


def test_engines_and_verification_reject_weighted_systems():
    made = system(output(Constant(2.0)), "if x is low then y is t0")
    for engine in ("closed", "skfuzzy"):
        with pytest.raises(EngineError, match=f"engine '{engine}': output 'y' has the defuzzifier average"):
            Arbiter(made, engine=engine)
    with pytest.raises(UnsupportedError, match="verify: output 'y' has the defuzzifier average"):
        Arbiter(made).verify(as_criteria=True)
    assert np.isfinite(Arbiter(made).explain([1.0, 0.0]).result).all()


@pytest.mark.parametrize("defuzzifier", ["average", "sum"])
def test_two_rules_on_one_value_count_twice(defuzzifier):
    """As in MATLAB, pyfuzzylite and simpful; in Python as in a file."""
    terms = {"one": Constant(1.0), "none": Constant(0.0)}
    made = Output("y", (0, 1), terms, defuzzifier=defuzzifier)
    rules = ("if x is low then y is one", "if x is high then y is none", "if z is near then y is one with 0.6")
    written = System((X, Z), (made,), rules)
    # strengths of 0.6 and 0.6 for the one value, and of 0.4 for the other
    assert Arbiter(written)([4.0, 0.0])["y"] == pytest.approx(1.2 if defuzzifier == "sum" else 0.75)
    for format in ("json", "toml", "fll", "fis"):
        read = reads(writes(written, format), format)
        assert (read.outputs, read.rules) == (written.outputs, written.rules)
