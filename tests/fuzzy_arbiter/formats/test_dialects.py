"""The dialects of jFuzzyLogic, fuzzylite, MATLAB and Octave beyond the standard."""

import math

import pytest

from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.errors import DefinitionError, FormatError
from fuzzy_arbiter.formats import reads
from fuzzy_arbiter.terms import Constant, Curve, Formula, Linear
from tests.fuzzy_arbiter.formats.systems import FAULTS, FOREIGN

JFUZZYLOGIC = FOREIGN["jfuzzylogic.fcl"]


def test_jfuzzylogic_functions_and_defaults_are_read():
    system = reads(JFUZZYLOGIC, "fcl")
    of = {term.name: term.shape for term in system.inputs[0].terms}
    assert of["a"](2.5) == pytest.approx((math.cos(math.pi / 2) + 1) / 2)
    assert of["b"](7.0) == pytest.approx(0.5)
    assert of["c"](3.5) == pytest.approx(1 / (1 + math.exp(-1)))
    assert isinstance(of["d"], Curve)
    assert isinstance(of["e"], Formula)  # whose difference is below 0 somewhere, where jFuzzyLogic has 0
    for x in (2.0, 3.0, 4.5):
        assert of["e"](x) == max(0.0, 1 / (1 + math.exp(5 - x)) - 1 / (1 + math.exp(6 - 2 * x)))
    assert (of["f"](1.0), of["f"](3.0)) == (pytest.approx(math.exp(-0.5)), 1.0)
    assert [of["g"](3.0), of["g"](3.1), of["h"](6.0)] == [1.0, 0.0, 1.0]
    low, mid, high = (term.shape for term in system.outputs[0].terms)
    assert (low, mid) == (Constant(5), Linear((2.0, 0.5), 1.0))
    assert high.expression(("x", "z"))({"x": 10.0, "z": 0.0}) == pytest.approx(1.0 + 100 % 4)
    # singletons and functions by COGS; of two rules for one the greater counts, for ACCU is MAX
    assert (system.outputs[0].defuzzifier, system.outputs[0].aggregation) == ("average", "max")
    assert Arbiter(system)([3.0, 0.25]) == pytest.approx((0.25 * 5 + 0.75 * 7.125,))


FUZZYLITE = FOREIGN["fuzzylite.fcl"]


def test_fuzzylite_dialect_of_fcl_is_read():
    """Ranges in FUZZIFY; rules end with their line, or go on; a term may be named any, which else is each term."""
    system = reads(FUZZYLITE, "fcl")
    y, u = system.outputs
    norms = system.conjunction, system.disjunction, system.implication
    assert (system.name, system.inputs[0].universe) == ("my - fan", (0.0, 10.0))
    assert norms == ("einstein_product", "nilpotent_maximum", "hamacher_product")
    assert (y.default, y.lock_previous, y.lock_range, y.aggregation) == (None, True, True, "sum")
    assert (u.default, u.lock_previous, u.lock_range, u.aggregation) == (0.25, True, False, "einstein_sum")
    assert (y.defuzzifier, u.defuzzifier) == ("average", "bisector")
    # a hedge in a conclusion bends that one and those after it
    rules = [
        "if x is low then y is t",
        "if x is very very high then y is w and u is s",
        'if x is high and x is "any" then y is w',
    ]
    assert [str(rule) for rule in system.rules] == rules
    assert (
        str(reads(FUZZYLITE.replace("TERM any", "TERM other"), "fcl").rules[2])
        == "if x is high and x is any then y is w"
    )


FIS = FOREIGN["template.fis"]


def fis(rule="1 1, 1 (1) : 1", head="", type="sugeno", method="wtaver", function="linear',[1 2 3]"):
    return reads(head + FIS.format(rule=rule, type=type, method=method, function=function), "fis")


def test_matlab_functions_are_read():
    system = fis()
    a, b, c, d, e, f = (term.shape for term in system.inputs[0].terms)
    assert system.inputs[0].universe == (-math.pi, math.pi / 2)
    assert a(1.0) == pytest.approx(math.exp(-1 / 8))
    assert (b(1.9), b(2.1)) == (0.0, 1.0)  # whose foot is beyond its top: a step half-way
    assert c(0.0) == pytest.approx(2 / 3)  # of which rise and fall cross
    assert (d(1.0), d(0.9), e(0.25)) == (1.0, 0.0, 0.75)
    assert f(0.5) == pytest.approx(1 / (1 + math.exp(-1)) / (1 + math.exp(-2.5)))
    assert Arbiter(system)([1.0, 0.5]) == pytest.approx((1.0 + 2 * 0.5 + 3,))


@pytest.mark.parametrize(
    ("rule", "head", "said"),
    [
        ("1.20 -1.05, 1 (1) : 2", "", ["if x is very a or z is not somewhat on then y is mf1"]),
        ("1.3 0, 1 (1) : 1", "", ["if x is cubed a then y is mf1"]),
        ("1 0, 1.2 (1) : 1", "", ["if x is somewhat a then y is mf1"]),  # values: Octave takes the inverse power
        ("1 1, 2.3 (1) : 1", "", ["if cube_root (x is a and z is on) then y is mf2"]),
        ("1.4 0, 1 (0.5) : 1", "", ["if x is very very a then y is mf1 with 0.5"]),
        ("1.3 0.99, 2 (1) : 1", "# generated with fuzzylite\n", ["if x is extremely a and z is any then y is mf2"]),
        ("1.01 1, 1.2 (1) : 1", "# generated with fuzzylite\n", ["if very (x is seldom a and z is on) then y is mf1"]),
    ],
)
def test_hedges_are_fractions(rule, head, said):
    assert [str(rule) for rule in fis(rule, head).rules] == said


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"rule": "1.25 1, 1 (1) : 1"}, "line 32: .*1.25 for 'x', expected a whole number from -6 to 6, or .05, .2, ."),
        (
            {"rule": "1 1, 1.2 (1) : 1", "type": "mamdani", "method": "mom", "function": "trimf',[0 1 2]"},
            "line 32: .*a hedge in the conclusion on 'y', expected none on a set",
        ),
        ({"rule": "1 1, -1 (1) : 1"}, "concludes that 'y' is not in a term, expected a set"),
        ({"rule": "1 1, 1.2 (0.5) : 1", "head": "# generated with fuzzylite\n"}, "a hedge in a conclusion and a weigh"),
        ({"rule": "1 0.2, 1 (1) : 1"}, "line 32: .*0.2 for 'z', expected a whole number"),
        ({"function": "linear',[1 2 3 4]"}, "line 29: linear has 4 numbers, expected 2 or 3"),
        ({"function": "constant',[1 2]"}, "line 29: constant has 2 numbers, expected 1"),
        ({"function": "function',[sin(q)]"}, "asks for q, expected inputs"),
        ({"function": "trimf',[0 1 2]"}, "'mf1' is no value, nor does it only rise or only fall"),
    ],
)
def test_invalid_fis_options_are_rejected(options, fault):
    with pytest.raises((FormatError, DefinitionError), match=fault):
        fis(**options)


@pytest.mark.parametrize(
    ("function", "at", "degree"),
    [
        ("trimf',[0 0.5 1]", 0.25, 0.5),
        ("trapmf',[0 0 0.5 1]", 0.0, 0.0),
        ("gaussmf',[0.2 1]", 0.8, 1.0 - math.exp(-0.5)),
    ],
)
def test_negated_conclusion_becomes_a_complement_term(function, at, degree):
    system = fis("1 1, -2 (1) : 1", type="mamdani", method="centroid", function=function)
    output = system.outputs[0]
    assert (str(system.rules[0]), output.term_names) == (
        *("if x is a and z is on then y is not_mf2",), ("mf1", "mf2", "not_mf2"),
    )  # fmt: skip
    assert output.terms[2].shape(at) == pytest.approx(degree)


def test_complement_of_a_piecewise_curve_is_rejected():
    with pytest.raises(DefinitionError, match=r"line 32: .*the complement of this function is not known"):
        fis("1 1, -1 (1) : 1", type="mamdani", method="centroid", function="smf',[0 1]")


def test_octave_aggregates_strengths_and_matlab_sums_them():
    text = FIS.replace("[System]", "[System]\nAggMethod='max'")
    both = text.format(rule="1 1, 1 (1) : 1", type="sugeno", method="wtaver", function="constant',[1]")
    assert reads(both, "fis").outputs[0].aggregation == "sum"
    assert reads("## This file is part of the fuzzy-logic-toolkit.\n" + both, "fis").outputs[0].aggregation == "max"
    assert fis(type="mamdani", method="centroid_integral", function="trimf',[0 0.5 1]").outputs[0].defuzzifier == (
        "centroid"
    )


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ("Enabled=1\nDefault=nan\nLockPrevious=1\nLockRange=0", (None, False, True)),
        ("Default=0.500\nLockRange=1", (0.5, True, False)),
    ],
)
def test_fuzzylite_5_adds_keys_to_outputs(keys, expected):
    text = FIS.replace("[Output1]", f"[Output1]\n{keys}").format(
        rule="1.300 0.990, 1 (1) : 1", type="sugeno", method="wtaver", function="linear',[1 2 3]"
    )
    system = reads(text, "fis")
    output = system.outputs[0]
    assert (output.default, output.lock_range, output.lock_previous) == expected
    assert str(system.rules[0]) == "if x is extremely a and z is any then y is mf1"  # as fuzzylite has hedges
    with pytest.raises(FormatError, match=r"line \d+: Enabled of Input2 'z' is 0, expected 1"):
        reads(text.replace("[Input2]", "[Input2]\nEnabled=0"), "fis")


def test_hybrid_systems_are_read():
    assert fis(type="hybrid", method="centroid", function="constant',[0.5]").outputs[0].defuzzifier == "average"
    assert fis(type="hybrid", method="bisector", function="trimf',[0 0.5 1]").outputs[0].defuzzifier == "bisector"
    assert fis(type="tsukamoto", function="rampmf',[0 1]").outputs[0].weighted


def test_fuzzylite_5_keywords_are_read():
    text = (
        "Engine: old\nInputVariable: x\n  range: 0.000 1.000\n  term: on Ramp 0.000 1.000\nOutputVariable: y\n"
        "  range: 0.000 1.000\n  accumulation: BoundedSum\n  defuzzifier: LargestOfMaximum 50\n"
        "  lock-valid: true\n  term: low Ramp 1.000 0.000\nRuleBlock: only\n  activation: EinsteinProduct\n"
        "  rule: if x is on then y is low\n"
    )
    system = reads(text, "fll")
    (y,) = system.outputs
    assert (system.implication, system.points) == ("einstein_product", 50)
    assert (y.aggregation, y.defuzzifier, y.lock_previous) == ("bounded_sum", "lom", True)
    with pytest.raises(FormatError, match="lock-previous appears twice in OutputVariable 'y'"):
        reads(text.replace("  lock-valid: true\n", "  lock-valid: true\n  lock-previous: true\n"), "fll")


@pytest.mark.parametrize(
    ("file", "old", "new", "fault"), [(file, *row) for file in FAULTS if file != "sail.toml" for row in FAULTS[file]]
)
def test_unknown_constructs_are_rejected_with_their_line(file, old, new, fault):
    text, format = FOREIGN[file], file.partition(".")[2]
    assert old in text
    edited = text.replace(old, new) if format == "fcl" else text.replace(old, new, 1)
    if not fault:
        assert reads(edited, format) == reads(text, format)
        return
    with pytest.raises((FormatError, DefinitionError), match=fault):
        reads(edited, format)
