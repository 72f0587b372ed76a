"""Verification: truth tables by hand, gaps by exact arithmetic, and verdicts against brute force."""

import itertools
import json
import math
import re
from dataclasses import replace
from functools import partial

import pytest

from fuzzy_arbiter import (
    Arbiter,
    Output,
    Rule,
    Shape,
    System,
    Term,
    Variable,
    curve,
    falling,
    rising,
    trapezoid,
    triangle,
)
from fuzzy_arbiter.criteria import Criterion, prioritized
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.verification import verify as verify_system
from fuzzy_arbiter.verification.cells import stretches

LOW_HIGH = {"low": falling(0, 1), "high": rising(0, 1)}
verify = partial(verify_system, as_criteria=True)
NAMES = ("complete", "consistent", "exclusive", "graded_complete", "graded_consistent", "graded_exclusive")


def pair(name):
    return Criterion(name).variable


def output(name, default=None):
    return Output(name, (0, 1), LOW_HIGH, default)


def system(rules, inputs="ab", outputs="y", **settings):
    return System(tuple(map(pair, inputs)), tuple(map(output, outputs)), tuple(rules), **settings)


def verdicts(verification):
    return tuple(getattr(verification, name) for name in NAMES)


def texts(verification, severity):
    return [f.text for f in verification.findings if f.severity == severity]


def about_rules(rules, conjunction):
    v = verify(system(rules, outputs="yz", conjunction=conjunction))
    return [f.text for f in v.findings if f.about == "rules"]


# section VI


def test_section_six_rules_verify():
    v = Arbiter().verify()
    assert v.ok
    assert verdicts(v) == (True,) * 6
    assert v.row_count == 8
    assert {row.terms: (*(o[0] for o in row.concluded), " ".join(row.rules)) for row in v.rows} == {
        ("exist", "complex", "not_maintain"): ("high", "low", "low", "R1 R3 R6"),
        ("exist", "complex", "maintain"): ("high", "low", "low", "R1 R3 R6 R7"),
        ("exist", "simple", "not_maintain"): ("high", "low", "low", "R1 R3 R4 R6"),
        ("exist", "simple", "maintain"): ("high", "low", "low", "R1 R3 R4 R6 R7"),
        ("not_exist", "complex", "not_maintain"): ("low", "high", "low", "R2 R5 R6"),
        ("not_exist", "complex", "maintain"): ("low", "high", "low", "R2 R5 R6 R7"),
        ("not_exist", "simple", "not_maintain"): ("low", "low", "high", "R2 R4 R8"),
        ("not_exist", "simple", "maintain"): ("low", "low", "low", "R2 R4 R7"),
    }
    (rest,) = v.findings
    assert rest.severity == "note"
    assert rest.place == {"obstacle": "not_exist", "shape": "simple", "depth": "maintain"}
    assert rest.text.endswith("at most one is, not exactly one")
    assert v.stretches == ()


def test_report_is_text_and_json():
    v = Arbiter().verify()
    lines = str(v).splitlines()
    assert lines[0] == "8 crisp rows"
    assert lines[1].split() == ["obstacle", "shape", "depth", "alpha_1", "alpha_2", "alpha_3", "rules", "that", "fire"]
    assert lines[2].split() == ["exist", "complex", "not_maintain", "high", "low", "low", "R1", "R3", "R6"]
    assert "  graded exclusive   yes  for all real inputs" in lines
    assert lines[-1] == "ok"
    data = v.as_dict()
    assert json.loads(json.dumps(data)) == data
    assert data["ok"] is True and set(data["checks"]) == set(NAMES)
    assert data["rows"][7]["outputs"] == {"alpha_1": ["low"], "alpha_2": ["low"], "alpha_3": ["low"]}


def test_a_gap_is_a_fault_unless_there_is_a_default():
    s = prioritized()
    gap = Variable("obstacle", (0, 1), {"not_exist": falling(0, 0.25), "exist": rising(0.5, 1)})
    s = replace(s, inputs=(gap, *s.inputs[1:]), normalization="none")
    v = verify(s)
    assert not v.ok
    assert verdicts(v) == (True, True, True, False, True, True)
    fault = v.findings[0]
    assert fault.severity == "fault"
    assert fault.text == "output 'alpha_1': no rule fires where obstacle = 0.25; it has no default"
    assert math.isnan(Arbiter(s)([fault.place["obstacle"], 0.0, 0.0])["obstacle"])
    assert "input 'obstacle': in [0.25, 0.5] no term has a degree above 0" in texts(v, "warning")
    assert "input 'obstacle': in (0, 1) the degrees sum to less than 1: 0 to 1" in texts(v, "note")
    v = verify(System((pair("a"),), (output("y", 0.5),), ("if a is on then y is high",)))
    assert (v.ok, v.complete, v.graded_complete) == (True, False, False)
    assert "output 'y': no rule fires where a is off; it has its default 0.5 there" in texts(v, "warning")


def test_degrees_of_curves_that_are_too_small_for_a_float_are_gaps():
    terms = {"low": curve("gaussian", 0.0, 0.015), "high": curve("gaussian", 1.0, 0.004)}
    s = System(
        (Variable("x", (0, 1), terms),), (output("y"),), ("if x is low then y is low", "if x is high then y is high")
    )
    v = verify_system(s)
    assert not v.ok and "no rule fires where x = " in v.findings[0].text
    assert math.isnan(Arbiter(s)([v.findings[0].place["x"]])["y"])
    (gap,) = [text for text in texts(v, "warning") if "no term has a degree above 0" in text]
    low, high = map(float, re.findall(r"0\.\d+", gap))
    assert (math.exp(-0.5 * (low / 0.015) ** 2) < 1e-300) and (math.exp(-0.5 * ((1.0 - high) / 0.004) ** 2) < 1e-300)


@pytest.mark.parametrize("defuzzifier", ["centroid", "bisector", "mom", "average"])
def test_overlapping_rules_are_ok_but_of_criteria(defuzzifier):
    """Rules that overlap are what a fuzzy system is made of; completeness does not depend on what joins them."""
    rules = ["if a is on then y is high", "if b is on then y is low", "if a is off then y is low"]
    made = system(rules)
    made = replace(made, outputs=(replace(made.outputs[0], defuzzifier=defuzzifier, aggregation=""),))
    v = Arbiter(made).verify()
    assert (v.ok, v.complete, v.graded_complete, v.consistent, v.exclusive) == (True, True, True, None, None)
    assert not re.search("contradict|exclusive|consistent|winner|criteri", str(v))
    short = Arbiter(replace(made, rules=made.rules[:2])).verify()
    assert (short.ok, short.complete, short.graded_complete) == (False, False, False)
    if defuzzifier == "centroid":
        assert Arbiter(made).verify(as_criteria=True).consistent is False


# sizes and forms


@pytest.mark.medium(fast=8)
@pytest.mark.parametrize("form", ["hierarchical", "minimal", "conjunctive", "complete"])
@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_every_rule_form_verifies(form, n):
    v = verify(prioritized([Criterion(f"c{i}") for i in range(n)], form))
    assert v.ok
    assert verdicts(v) == (True,) * 6
    assert texts(v, "warning") == []
    assert v.row_count == 2**n


@pytest.mark.medium
@pytest.mark.parametrize("n", [12, pytest.param(40, marks=pytest.mark.slow)])
def test_many_criteria_are_decided_in_any_order(n):
    s = prioritized([Criterion(f"c{i}") for i in range(n)])
    v = verify(s)
    assert v.ok
    assert verdicts(v) == verdicts(verify(replace(s, inputs=s.inputs[::-1]))) == (True,) * 6
    assert (v.rows, v.row_count) == ((), 2**n)  # too many
    (rest,) = v.findings
    assert rest.place == {f"c{i}": "off" for i in range(n)}


def test_exceeding_the_effort_limit_leaves_checks_undecided():
    v = verify(prioritized(), effort=8)
    assert verdicts(v) == (None,) * 6
    assert not v.ok
    assert any("not decided" in text for text in texts(v, "warning"))
    assert "exclusive" in str(v)
    assert "not decided" in str(v)
    assert "there may be more rows like that, which were not looked for" in texts(v, "note")
    # samples may refute all the same
    v = verify(system(["if a is on then y is high", "if a is on then y is low"]), effort=8)
    assert v.graded_consistent is False


# faults


def test_a_contradiction_of_full_rules_is_a_fault_with_rules_and_place():
    rules = ["if a is on then y is high", "if b is on then y is low", "if a is off then y is low"]
    v = verify(system(rules))
    assert (v.consistent, v.graded_consistent, v.ok) == (False, False, False)
    (fault,) = texts(v, "fault")
    assert fault == ("output 'y': rules contradict each other where a is on, b is on: y is low by R2, y is high by R1")
    for weight, graded in ((0.9, False), (0.5, True)):
        v = verify(system([rules[0], f"{rules[1]} with {weight}", rules[2]]))
        assert (v.ok, v.consistent, v.graded_consistent) == (True, True, graded)
    same = ["if a is on then y is high", "if a is on then y is low", "if a is on then y is low with 0.9"]
    (fault,) = (f.text for f in verify(system(same, "a")).findings if f.about == "consistent")
    assert fault.endswith("y is low by R2, y is high by R1")  # not by the weaker one


@pytest.mark.parametrize(("weight", "exclusive"), [(1, False), (0.75, False), (0.5, True)])
def test_two_high_outputs_violate_exclusivity(weight, exclusive):
    rules = []
    for name, out in ("ay", "bz"):
        rules += [f"if {name} is on then {out} is high with {weight}", f"if {name} is off then {out} is low"]
        rules += [f"if {name} is on then {out} is low with 0.001"]
    v = verify(system(rules, outputs="yz"))
    assert (v.exclusive, v.graded_exclusive) == (exclusive, exclusive)
    assert v.ok
    if not exclusive:
        assert "two outputs are high where a is on, b is on: y is high by R1, z is high by R4" in texts(v, "warning")
        (graded,) = [f for f in v.findings if f.about == "graded_exclusive"]
        assert min(Arbiter(system(rules, outputs="yz"))([graded.place["a"], graded.place["b"]])) > 0.3


def test_greatest_term_is_identified_by_its_centroid():
    turned, other = Output("y", (0, 1), dict(reversed(LOW_HIGH.items()))), output("z")
    rules = ("a is on then y is high", "a is off then y is low", "a is off then z is high", "a is on then z is low")
    assert verdicts(verify(System((pair("a"),), (turned, other), [f"if {rule}" for rule in rules]))) == (True,) * 6


# other connectives


def test_products_are_bounded_by_the_minimum_unless_negated():
    v = verify(replace(prioritized(), conjunction="prod"))
    assert verdicts(v) == (True,) * 6
    (check,) = [check for check in v.checks if check.name == "graded_exclusive"]
    assert "never above" in check.how
    # at a = b = 0.6 the one rule fires at 0.64 and the other at 0.6; with the minimum it would be 0.4 and 0.6
    rules = ["if not (a is on and b is on) then y is low", "if not (a is off or b is off) then y is high"]
    assert verify(system(rules)).graded_consistent is True
    assert verify(system(rules, conjunction="prod")).graded_consistent is not True


def test_inconclusive_bound_is_undecided_or_refuted_by_sampling():
    v = verify(replace(prioritized(), conjunction="prod", disjunction="probor"))
    # the rules for high have no or
    assert (v.graded_complete, v.graded_exclusive, v.graded_consistent, v.ok) == (True, True, None, True)
    assert "125 samples" not in str(v)
    assert "graded consistent: not decided" in " ".join(texts(v, "warning"))
    # not (a and b) with prod is 1 - a b, at a = b = 0.7 above 1/2
    rules = ["if not (a is on and b is on) then y is high", "if a is on then y is low", "if a is off then y is low"]
    assert verify(system(rules, conjunction="prod")).graded_consistent is False


def test_the_product_of_positive_degrees_fires():
    rules = ["if a is on and b is on then y is high", "if a is off or b is off then y is low"]
    for conjunction, disjunction in itertools.product(("min", "prod"), ("max", "probor")):
        v = verify(system(rules, conjunction=conjunction, disjunction=disjunction))
        assert v.graded_complete is True
    assert verify(system(rules[:1])).graded_complete is False


# terms


SAWTOOTH = Shape(((0, 0.1), (3, 0.3), (7, 0.9)))


@pytest.mark.parametrize(
    ("shapes", "expected"),
    [
        ((falling(2, 6), rising(2, 6)), []),
        ((falling(1, 2), triangle(1, 2, 4), rising(2, 4)), []),
        ((SAWTOOTH, Shape(((0, 0.9), (3, 0.7), (7, 1 - 0.9)))), []),
        ((falling(0.1, 0.3), trapezoid(0.1, 0.3, 0.7, 0.9), rising(0.7, 0.9)), []),
        ((falling(0, 2), rising(4, 6)), [("gap", "[2, 4]", 0, 0), ("below", "(0, 6)", 0, 1)]),
        # 1 - x/8 + (x - 4)/4 in (4, 8): from 1/2 at 4 to 1 at 8, then 1
        ((falling(0, 8), rising(4, 8)), [("below", "(0, 8)", 0.5, 1)]),
        ((falling(4, 8), rising(0, 8)), [("above", "(0, 8)", 1, 1.5)]),
        # a sum that passes 1 in the middle of a straight piece: 3/2 - x/10
        ((falling(0, 10), Shape(((0, 0.5),))), [("below", "(5, 10]", 0.5, 1), ("above", "[0, 5)", 1, 1.5)]),
        # a jump, where both terms have their greater degree
        ((falling(5, 5), rising(5, 5)), [("above", "5", 2, 2)]),
        ((trapezoid(0, 0, 3, 3), trapezoid(4, 4, 10, 10)), [("gap", "(3, 4)", 0, 0), ("below", "(3, 4)", 0, 0)]),
    ],
)
def test_stretches_match_manual_results(shapes, expected):
    v = Variable("x", (0, 10), {f"t{i}": shape for i, shape in enumerate(shapes)})
    assert [(s.kind, s.place, s.least, s.greatest) for s in stretches(v)] == expected


def test_unused_names_and_idle_rules_are_reported():
    x = Variable("x", (0, 2), {"small": falling(0, 1), "middle": triangle(0, 1, 2), "big": rising(1, 2)})
    s = System((x, pair("a")), (output("y", 0.0), output("z", 0.0)), ("if x is small or x is big then y is low",))
    v = verify(s)
    for text in (
        "input 'a': no rule asks for it",
        "output 'z': no rule concludes on it",
        "output 'z': no rule fires where the inputs are anything; it has its default 0 there",
    ):
        assert text in texts(v, "warning")
    assert "input 'x': no rule asks for its term 'middle'" in texts(v, "note")
    assert "output 'y': no rule concludes its term 'high'" in texts(v, "note")
    x = Variable("x", (0, 4), {"small": falling(1, 2), "big": rising(2, 3), "huge": rising(5, 6)})
    rules = ("x is small and x is big then y is high", "x is huge then y is high", "x is not huge then y is low")
    warnings = texts(verify(System((x,), (output("y"),), [f"if {rule}" for rule in rules])), "warning")
    assert "R1: never fires, as 'x is small and x is big' holds for no real inputs" in warnings
    assert "R2: never fires, as 'x is huge' holds for no real inputs" in warnings


@pytest.mark.parametrize(
    ("rules", "finding"),
    [
        (["if a is on then y is low"] * 2, "R2 .* says the same as R1"),
        (["if a is on and b is on then y is low", "if b is on and a is on then y is low"], "R2 .* says the same as R1"),
        (["if a is on and b is on then y is low", "if a is on then y is low"], "R1 .* adds nothing to R2"),
        (["if a is on or b is on then y is low", "if b is on then y is low"], "R2 .* adds nothing to R1"),
        (["if a is on then y is low with 0.5", "if a is on then y is low"], "R1 .* adds nothing to R2"),
        (["if not (a is on or b is on) then y is low", "if not a is on then y is low"], "R1 .* adds nothing to R2"),
        (["if a is on then y is low", "if a is on and b is on then y is low with 0.5"], "R2 .* adds nothing to R1"),
        (["if a is on then y is low and z is low", "if a is on then y is low"], "R2 'if .*: on y is low it says the s"),
        (["if a is on then y is low", "if a is on then y is high"], None),
        (["if a is on and b is on then y is low with 0.5", "if a is on then y is low with 0.4"], None),
        (["if a is on then y is low", "if b is on then y is low"], None),
    ],
)
@pytest.mark.parametrize("conjunction", ["min", "prod"])
def test_redundant_rules_are_reported(rules, finding, conjunction):
    found = about_rules(rules, conjunction)
    assert len(found) == (finding is not None)
    assert finding is None or re.search(finding, found[0])


def test_repeated_factors_count_in_a_product():
    (text,) = about_rules(["if a is on then y is low", "if b is on and (a is on and a is on) then y is low"], "prod")
    assert text.startswith("R2")
    rules = ["if a is on and a is on then y is low", "if a is on then y is low with 0.5"]
    assert (len(about_rules(rules, "prod")), len(about_rules(rules, "min"))) == (0, 1)


@pytest.mark.slow
def test_hundreds_of_rules_with_one_conclusion_are_not_compared():
    v = verify(prioritized([Criterion(f"c{i}") for i in range(7)], "complete"))
    (note,) = [f for f in v.findings if f.about == "rules"]
    assert note.severity == "note"
    assert note.text.startswith("not compared with each other")


@pytest.mark.parametrize("order", [1, -1])
def test_tiny_degrees_are_not_lost_in_complements(order):
    """Beside 1e-20 the other term has 1: it is no complement there, and its negation is 0."""
    terms = (Term("seldom", Shape(((0, 1e-20), (1, 1)))), Term("often", falling(0, 1)))[::order]

    def graded(rule):
        arbiter = Arbiter(System((Variable("x", (0, 1), terms),), (output("y"),), (rule,)))
        return arbiter, arbiter.verify().graded_complete

    assert graded("if x is seldom then y is high")[1] is True
    arbiter, complete = graded("if x is not often then y is high")
    assert complete is False
    assert math.isnan(arbiter([0.0])[0])


@pytest.mark.slow
def test_thousands_of_rule_weights_are_verified():
    rules = tuple(Rule(Is("a", "on"), Is("y", "low"), 0.5 + 0.5 * (i + 1) / 8401) for i in range(8400))
    v = verify(system([*rules, Rule(Is("a", "off"), Is("y", "high"))], "a"))
    assert (v.graded_complete, v.graded_consistent) == (True, True)


def test_narrow_overlap_above_one_half_is_found():
    """Both terms are above 1/2 from 0.6098 to 0.625 only."""
    x = Variable("x", (0, 1), (Term("a", Shape(((0, 1), (1, 0.2)))), Term("b", Shape(((0, 0), (1, 0.82))))))
    v = verify(System((x,), (output("y"),), ("if x is a then y is low", "if x is b then y is high")))
    assert v.graded_consistent is False
    (place,) = (f.place["x"] for f in v.findings if f.about == "graded_consistent")
    assert 0.6097 < place < 0.625


@pytest.mark.parametrize("name", ["complete", "consistent", "graded_complete"])
def test_undecided_check_is_not_ok(name):
    v = Arbiter().verify()
    checks = tuple(replace(check, holds=None) if check.name == name else check for check in v.checks)
    assert not replace(v, checks=checks).ok


@pytest.mark.medium
def test_a_variable_of_very_many_terms_is_not_verified():
    terms = {f"t{j}": triangle(j - 1.0, float(j), j + 1.0) for j in range(1000)}
    x, y = Variable("x", (0.0, 999.0), terms), Output("y", (0.0, 999.0), terms)
    made = System((x,), (y,), tuple(f"if x is t{j} then y is t{j}" for j in range(1000)))
    with pytest.raises(UnsupportedError, match="verify: 'x' has 1000 terms, expected at most 200"):
        Arbiter(made).verify()
