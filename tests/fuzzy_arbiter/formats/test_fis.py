"""The MATLAB format FIS: files of MATLAB and Octave, and rejected content."""

from dataclasses import replace

import pytest

from fuzzy_arbiter import Output, Rule, Shape, System, Term, Variable, falling, rising, trapezoid, triangle
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats import reads, writes
from fuzzy_arbiter.terms.curves import curve
from tests.fuzzy_arbiter.formats.systems import FOREIGN, TIPPING

OTHERS = FOREIGN["tipper.fis"]


def test_foreign_file_is_read():
    system = reads(OTHERS, "fis")
    assert system.name == "Tip for two"
    service, food = system.inputs
    assert [term.shape for term in service.terms] == [falling(0, 4), rising(4, 6), falling(1, 3)]
    assert [term.shape for term in food.terms] == [falling(1, 3), rising(7, 9)]
    assert (system.conjunction, system.disjunction, system.implication) == ("prod", "probor", "prod")
    assert list(map(str, system.rules)) == [
        'if service is "very poor" or food is rancid then tip is cheap',
        "if service is not good then tip is cheap with 0.5",
        "if service is good and food is not rancid then tip is generous",
    ]


def test_empty_operators_default_to_min_and_max():
    text = OTHERS.replace("'algebraic_product'", "''").replace("'probor'", "''")
    system = reads(text, "fis")
    assert (system.conjunction, system.disjunction) == ("min", "max")


def test_half_triangles_are_extended_beyond_the_range():
    text = writes(prioritized(), "fis")
    assert "MF1='low':'trimf',[-1 0 1]\nMF2='high':'trimf',[0 1 2]" in text


@pytest.mark.parametrize(
    "shape",
    [
        *(falling(0, 10), falling(2, 5), falling(-3, 4), falling(-3, 14), falling(4, 4), falling(2, 10)),
        *(rising(0, 10), rising(2, 5), rising(-3, 4), rising(4, 13), rising(4, 4), rising(2, 10), rising(10, 10)),
        *(triangle(1, 2, 3), triangle(1, 1, 3), triangle(-5, 5, 20), trapezoid(1, 2, 2.5, 3), trapezoid(2, 2, 3, 3)),
        *(Shape(((3, 1),)), Shape(((3, 0),)), falling(0, 5e-324), rising(10 - 1e-15, 10)),
    ],
)
def test_shapes_with_degrees_0_and_1_round_trip(shape):
    term = Term("t", shape)
    system = replace(TIPPING, inputs=(Variable("v", (0, 10), (term,)),), rules=("if v is t then tip is low",))
    assert reads(writes(system, "fis"), "fis") == system


def test_duplicate_term_names_are_made_unique():
    named = reads(OTHERS, "fis").inputs[0].term_names
    again = reads(OTHERS.replace("'good'", f"'{named[0]}'", 1), "fis")
    assert again.inputs[0].term_names == (named[0], f"{named[0]}_2", *named[2:])
    assert [term.shape for term in again.inputs[0].terms] == [t.shape for t in reads(OTHERS, "fis").inputs[0].terms]


def bent():
    return Output("tip", (0, 1), (Term("low", Shape(((0, 0), (0.5, 0.7), (1, 0)))),))


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"name": "it's"}, "the name \"it's\": expected none of ' = : ,"),
        ({"outputs": (replace(TIPPING.outputs[0], default=0.5),)}, "the default 0.5 of output 'tip'"),
        (
            {"outputs": (bent(),), "rules": ("if quality is poor then tip is low",)},
            r"the term 'low' of 'tip', \(0, 0\) \(0.5, 0.7\) \(1, 0\): expected a triangle, a trapezoid or a half",
        ),
        *(
            ({"rules": (f"if {condition} then tip is low",)}, f"the condition of R1 .*: expected {expected}")
            for condition, expected in (
                ("quality is poor and (service is poor or service is good)", "one connective per rule"),
                ("not (quality is poor and service is poor)", "one connective per rule, and only terms negated"),
                ("quality is not not poor", "one connective per rule, and only terms negated"),
                ("quality is poor or quality is good", "each input once, in the order of the inputs"),
                ("service is poor or quality is good", "each input once, in the order of the inputs"),
            )
        ),
    ],
)
def test_unsupported_features_are_rejected_by_name(change, fault):
    with pytest.raises(UnsupportedError, match=f"^fis cannot express {fault}"):
        writes(replace(TIPPING, **change), "fis")


def test_conclusions_must_follow_the_output_order():
    system = prioritized(form="minimal")
    rule = Rule(system.rules[0].condition, (system.outputs[1]["low"], system.outputs[0]["high"]))
    with pytest.raises(
        UnsupportedError, match=r"fis cannot express the conclusions of R1 .*: expected each output in the order"
    ):
        writes(replace(system, rules=(rule,)), "fis")


def test_tsukamoto_ramps_follow_fuzzylite():
    terms = {"up": rising(0.0, 0.25), "down": falling(0.4, 0.6), "s": curve("s_shape", 0.0, 1.0)}
    x, y = Variable("x", (0, 1), {"on": rising(0, 1)}), Output("y", (0, 1), terms, None, "average", "sum")
    system = System((x,), (y,), tuple(f"if x is on then y is {name}" for name in terms))
    text = writes(system, "fis")
    assert reads(text, "fis") == system
    assert "Type='tsukamoto'" in text and "'rampmf',[0 0.25]" in text and "'rampmf',[0.6 0.4]" in text
    low = replace(y, terms=(Term("up", Shape(((0.0, 0.0), (1.0, 0.7)))),))
    with pytest.raises(UnsupportedError, match="fis cannot express the term 'up' of 'y'"):
        writes(System((x,), (low,), ("if x is on then y is up",)), "fis")
