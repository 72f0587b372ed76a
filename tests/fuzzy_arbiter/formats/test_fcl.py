"""The Fuzzy Control Language: foreign files, and rejected content."""

from dataclasses import replace

import pytest

from fuzzy_arbiter import Arbiter, Output, Term, Variable, falling, rising, triangle
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
from fuzzy_arbiter.formats import reads, writes
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms.curves import curve
from fuzzy_arbiter.terms.values import Constant
from tests.fuzzy_arbiter.formats.systems import FOREIGN, TIPPING

# in the manner of jFuzzyLogic's example: comments of three kinds, no ranges, no OR
OTHERS = FOREIGN["tipper.fcl"]


def test_foreign_function_block_is_read():
    system = reads(OTHERS, "fcl")
    assert system.name == "tipper"
    assert [v.universe for v in (*system.inputs, *system.outputs)] == [(0, 9), (0, 9), (0, 30)]
    assert system.inputs[1].terms[0].shape == falling(1, 3)
    assert system.outputs[0].terms[1].shape == triangle(10, 15, 20)
    assert system.outputs[0].default == 0.0
    assert (system.conjunction, system.disjunction, system.implication) == ("min", "max", "min")
    assert (system.normalization, system.outside, system.points) == ("none", "refuse", 101)
    assert str(system.rules[1]) == "if service is good then tip is average with 0.5"
    assert str(system.rules[2].condition) == "not (service is not excellent or food is not delicious)"


def test_several_rule_blocks_of_like_operators_are_one():
    parts = OTHERS.split("    RULE 2")
    text = f"{parts[0]}END_RULEBLOCK RULEBLOCK No2 OR : MAX; ACCU : MAX;    RULE 2{parts[1]}"
    assert reads(text, "fcl").rules == reads(OTHERS, "fcl").rules
    with pytest.raises(FormatError, match="RULEBLOCK has another ACCU than that before it, expected the same"):
        reads(text.replace("OR : MAX; ACCU : MAX", "OR : MAX; ACCU : BSUM"), "fcl")


def test_rules_keep_the_operators_of_their_block():
    parts = OTHERS.split("    RULE 2")
    text = f"{parts[0]}END_RULEBLOCK RULEBLOCK No2 OR : ASUM; ACT : PROD; ACCU : MAX;    RULE 2{parts[1]}"
    system = reads(text, "fcl")
    own = Operators("prod", "probor", "prod")
    assert [rule.operators for rule in system.rules] == [None, own, own]
    assert reads(writes(system, "fcl"), "fcl") == system


def test_accumulation_may_be_set_per_output():
    moved = OTHERS.replace("ACCU : MAX;", "").replace("METHOD : COG;", "METHOD : COG; ACCU : MAX;")
    assert moved != OTHERS
    assert reads(moved, "fcl") == reads(OTHERS, "fcl")


def test_range_may_omit_the_assignment_operator():
    text = writes(TIPPING, "fcl")
    assert reads(text.replace("RANGE := (", "RANGE ("), "fcl") == TIPPING


@pytest.mark.parametrize(
    ("operators", "norms"),
    [
        ("AND : PROD;", ("prod", "probor", "min")),
        ("OR : ASUM; ACT : PROD;", ("prod", "probor", "prod")),
        ("OR : MAX; AND : MIN;", ("min", "max", "min")),
        ("", ("min", "max", "min")),
    ],
)
def test_missing_operator_is_the_dual_of_the_given_one(operators, norms):
    system = reads(OTHERS.replace("AND : MIN;\n    ACT : MIN;", operators), "fcl")
    assert (system.conjunction, system.disjunction, system.implication) == norms


def test_input_range_is_written_only_if_not_implied_by_its_points():
    assert "RANGE" not in writes(prioritized(), "fcl").split("END_VAR")[0]
    wide = replace(TIPPING.inputs[0], universe=(-1.5, 10))
    text = writes(replace(TIPPING, inputs=(wide, TIPPING.inputs[1])), "fcl")
    assert "  quality : REAL; RANGE := (-1.5 .. 10);\n  service : REAL;\n" in text
    assert reads(text.replace("RANGE := (-1.5 .. 10);", "", 1), "fcl").inputs[0].universe == (0, 10)
    moved = text.replace(" RANGE := (-1.5 .. 10);", "", 1)
    moved = moved.replace("FUZZIFY quality\n", "FUZZIFY quality RANGE := (-1.5..10);\n")
    assert reads(moved, "fcl") == reads(text, "fcl")


def test_numbers_are_those_of_the_standard():
    tiny = Variable("v", (0, 1e-5), (Term("t", rising(0, 1e-5)),))
    text = writes(replace(TIPPING, inputs=(tiny,), rules=("if v is t then tip is low",)), "fcl")
    assert "TERM t := (0, 0) (1.0e-05, 1);" in text


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"name": "not exist"}, "the name 'not exist': expected letters, digits and _, a letter first"),
        ({"name": "_x"}, "the name '_x': expected letters, digits and _, a letter first"),
        ({"name": "Range"}, "the name 'Range': it is a word of the language"),
        ({"rules": ("if quality is very poor then tip is low",)}, "the condition of R1 .*: expected no hedges"),
        *(
            ({"inputs": (Variable("quality", (0, 10), (Term("poor", shape),)),),
              "rules": ("if quality is poor then tip is low",)}, fault)
            for shape, fault in (
                (curve("spike", 3, 1), "the kind 'spike' of term 'poor': expected points, or one of gaussian"),
                (curve("gaussian", 3, 1, height=0.5), "the height 0.5 of term 'poor': expected 1"),
                (curve("sigmoid_difference", 8, 1, 1, 3), "term 'poor', a sigmoid_difference of which the second"),
            )
        ),
        ({"outputs": (Output("tip", (0, 1), (Term("low", Constant(1)),), None, "sum"),),
          "rules": ("if quality is poor then tip is low",)}, "the defuzzifier 'sum' of output 'tip': expected 'av"),
    ],
)  # fmt: skip
def test_unsupported_features_are_rejected_by_name(change, fault):
    with pytest.raises(UnsupportedError, match=f"^fcl cannot express {fault}"):
        writes(replace(TIPPING, **change), "fcl")


def test_names_that_differ_only_in_case_are_rejected():
    twin = Variable("QUALITY", (0, 1), TIPPING.inputs[0].terms)
    with pytest.raises(UnsupportedError, match="the names 'quality' and 'QUALITY': they differ in case alone"):
        writes(replace(TIPPING, inputs=(*TIPPING.inputs, twin)), "fcl")


BLOCKS = FOREIGN["blocks.fcl"]
DEFAULT = (
    "FUNCTION_BLOCK b VAR_INPUT x : REAL; END_VAR VAR_OUTPUT y : REAL; END_VAR FUZZIFY x TERM on := (0, 0) (1, 1); "
    "END_FUZZIFY DEFUZZIFY y {} END_DEFUZZIFY RULEBLOCK r RULE 1 : IF x IS on THEN y IS hi; END_RULEBLOCK "
    "END_FUNCTION_BLOCK"
)


def test_one_of_several_blocks_is_chosen_by_name(tmp_path):
    text = BLOCKS + BLOCKS.replace("first", "second of two").replace("high := 3", "high := 5")
    assert reads(text, "fcl", "first") == reads(BLOCKS, "fcl")
    assert reads(text, "fcl", "second of two").name == "second of two"
    with pytest.raises(
        FormatError, match="line 12: got another FUNCTION_BLOCK, expected block=, one of first, second of"
    ):
        reads(text, "fcl")
    with pytest.raises(FormatError, match="line 1: block is 'third', expected one of first, second of two, each once"):
        reads(text, "fcl", "third")
    with pytest.raises(FormatError, match="block is 'first', expected one of first, first, each once"):
        reads(BLOCKS + BLOCKS, "fcl", "first")
    with pytest.raises(FormatError, match="expected none: there is no FUNCTION_BLOCK"):
        reads("VAR_INPUT", "fcl", "first")
    with pytest.raises(FormatError, match="block is 'first', expected none for json: only FCL has function blocks"):
        reads("{}", "json", "first")
    path = tmp_path / "two.fcl"
    path.write_text(text)
    assert Arbiter.load(path, block="second of two")([1.0]) == pytest.approx((3.0,))


def test_strengths_are_joined_by_value_as_in_jfuzzylogic():
    assert Arbiter(reads(BLOCKS, "fcl"))([1.0]) == pytest.approx(((1.0 + 3.0) / 2.0,))  # not (1 + 1 + 3) / 3
    ours = BLOCKS.replace("TERM on := (0, 0) (1, 1)", "TERM on := Ramp 0.0 1.0")  # a word of fuzzylite, which adds them
    assert Arbiter(reads(ours, "fcl"))([1.0]) == pytest.approx(((1.0 + 1.0 + 3.0) / 3.0,))


def test_a_default_may_lie_outside_the_values():
    """A universe without RANGE is that of the terms: of singletons 10 and 100, or of sets."""
    singletons = "TERM lo := 10; TERM hi := 100; METHOD : COGS; DEFAULT := 0;"
    sets = "TERM lo := (10, 0) (20, 1) (30, 0); TERM hi := (30, 0) (90, 1) (100, 0); METHOD : COG; DEFAULT := 0;"
    for terms in (singletons, sets):
        arbiter = Arbiter(reads(DEFAULT.format(terms), "fcl"))
        assert (arbiter([0.0])["y"], arbiter.batch([[0.0], [1.0]])[0, 0]) == (0.0, 0.0)
        assert reads(writes(arbiter.system, "fcl"), "fcl").outputs[0].default == 0.0


def test_duplicate_term_names_are_rejected():
    for head in ("", "(* generated with fuzzylite *)"):
        with pytest.raises(DefinitionError, match="two terms are named 'low', expected each name once"):
            reads(head + BLOCKS.replace("small", "low"), "fcl")


def test_words_of_the_standard_and_of_fuzzylite():
    """LM and RM are the left and the right most maximum of IEC 61131-7; NMIN is fuzzylite's."""
    for word, name in (("COA", "bisector"), ("MM", "mom"), ("LM", "som"), ("RM", "lom")):
        assert reads(OTHERS.replace("METHOD : COG", f"METHOD : {word}"), "fcl").outputs[0].defuzzifier == name
    for word, name in (("NMIN", "nilpotent_minimum"), ("DPROD", "drastic_product"), ("HPROD", "hamacher_product")):
        assert reads(OTHERS.replace("AND : MIN", f"AND : {word}"), "fcl").conjunction == name
    locked = reads(OTHERS.replace("DEFAULT := 0;", "LOCK : PREVIOUS;"), "fcl").outputs[0]
    assert (locked.lock_previous, locked.lock_range) == (True, False)
