"""The Fuzzy Control Language: foreign files, and rejected content."""

from dataclasses import replace

import pytest

from fuzzy_arbiter import Arbiter, Output, Term, Variable, falling, prioritized, rising, triangle
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
    ("old", "new", "fault"),
    [
        ("METHOD : COG", "METHOD : COGS", r"line 19: output 'tip': term 'cheap' is no value"),
        ("METHOD : COG", "METHOD : COM", r"line 23: METHOD of DEFUZZIFY 'tip' is COM, expected COG or COA"),
        ("METHOD : COG;", "", None),
        ("ACCU : MAX", "ACCU : DIFF", r"line 29: ACCU of RULEBLOCK 'No1' is DIFF, expected MAX or ASUM"),
        ("ACCU : MAX;", "", None),
        ("AND : MIN;", "ENABLED : FALSE;", r"line 27: ENABLED of RULEBLOCK 'No1' is FALSE, expected TRUE"),
        ("AND : MIN;", "AND : MIN; AND : MIN;", r"line 27: AND appears twice"),
        ("TERM poor := (0, 1) (4, 0)", "TERM poor := GAUS 0 2", r"line 11: 'GAUS 0 2' is no membership function, exp"),
        ("TERM poor := (0, 1) (4, 0)", "TERM poor := GAUSS 0", r"line 11: GAUSS has the numbers '0', expected 2"),
        ("TERM poor := (0, 1) (4, 0)", "TERM poor := GAUSS 0 0", r"line 11: .*got \(0.0, 0.0\), expected a dev"),
        ("TERM poor := (0, 1) (4, 0)", "TERM poor := Constant 4", r"line 11: an input's term is Constant, which"),
        ("TRIAN 0 5 10", "FUNCTION 2 * service", r"line 19: output 'tip': term 'cheap' is a value, expected a"),
        ("(0, 1) (4, 0)", "(0, 1) (low, 0)", r"line 11: a place is the variable 'low', which jFuzzyLogic allows; exp"),
        ("TRIAN 0 5 10", "TRIAN 0 mid 10", r"line 20: a parameter is the variable 'mid', which jFuzzyLogic allows; ex"),
        ("(0, 1) (4, 0)", "(0, 1) (-4, 0)", r"line 11: term 'poor': shape: place -4.0 comes after 0.0"),
        ("(0, 1) (4, 0)", "(0, 1) (4e999, 0)", r"line 11: a place is '4e999', expected a finite number"),
        ("TERM good", "TERM poor", r"line 10: variable 'service': two terms are named 'poor'"),
        ("FUZZIFY food", "FUZZIFY fod", r"line 15: FUZZIFY 'fod', expected one of service, food"),
        ("food : real;", "food, wine : REAL;", r"line 7: 'wine' has no FUZZIFY"),
        ("food : real;", "food : INT;", r"line 7: 'food : INT', expected a variable's name, a colon and REAL"),
        ("VAR_OUTPUT", "VAR x : REAL; VAR_OUTPUT", r"line 9: got 'VAR' after 'END_VAR', expected VAR_IN"),
        ("IF service IS good", "IF service IS god", r"line 31: R2 .*'service' has no term 'god', expected one of exc"),
        ("IF service IS good", "IF service good", r"line 31: rule .*: got 'good' after 'service', expected 'is'"),
        ("tip IS average", "tip", r"line 31: rule 'IF service IS good THEN tip WITH 0.5': got 'WITH' after 'tip'"),
        ("WITH 0.5", "WITH 1.5", r"line 31: 'if service .*': weight is 1.5"),
        ("average WITH 0.5;", "average WITH 0.5", None),
        ("average WITH 0.5;", "average WITH 0.5 ACCU : MAX;", r"line 31: rule .*':' cannot stand in a rule"),
        ("DEFAULT := 0;", "DEFAULT := none;", r"line 24: the default, or NC, is 'none', expected a finite"),
        ("DEFAULT := 0;", "DEFAULT := 0 | 1;", r"line 24: DEFAULT of DEFUZZIFY 'tip' is 0 \| 1, expected NC after"),
        ("(* Center", "(* Center (*", None),
        ("Gravity *)", "Gravity", r"line 23: the comment that begins here with '\(\*' has no end"),
        ("ACT : MIN;", "ACT = MIN;", r"line 28: '=' is no sign of FCL"),
        ("END_FUNCTION_BLOCK\n", "", r"line 34: got the end of the file after 'END_RULEBLOCK', expected VAR_INPUT"),
        ("END_FUNCTION_BLOCK\n", "END_FUNCTION_BLOCK FUNCTION_BLOCK", r"line 34: got another FUNCTION_BLOCK"),
        ("TRIAN 0 5 10;", "TRIAN 40 45 50; RANGE := (0 .. 30);", r"line 19: .*term 'cheap' has no area"),
        ("food : real;", "food, service : REAL;", r"line 7: 'service' is declared twice"),
        ("VAR_OUTPUT tip", "VAR_OUTPUT food : REAL; tip", r"line 9: 'food' is declared twice"),
        ("food : real;", "food : REAL; RANGE := (0 .. 5); RANGE := (-3 .. 9);", r"line 7: RANGE of 'food' appears twi"),
        ("METHOD : COG;", "METHOD := COG;", r"line 23: 'METHOD := COG', expected a key"),
        ("METHOD : COG;", "METHOD : COG", r"line 24: got 'DEFAULT' after 'COG', expected ;"),
        ("END_FUZZIFY\nFUZZIFY food", "FUZZIFY food", r"line 1\d: got 'FUZZIFY' after ';', expected END_FUZZIFY"),
        ("END_RULEBLOCK", "", r"got 'END_FUNCTION_BLOCK' after .*expected END_RULEBLOCK"),
        ("FUZZIFY food", "FUZZIFY service", r"line 15: FUZZIFY 'service' appears twice"),
        ("TERM poor :=", "TERM range :=", r"line 11: TERM 'range', expected a term's name"),
        ("DEFAULT := 0;", "RANGE := (0, 30);", r"line 24: RANGE of DEFUZZIFY 'tip' is \( 0 , 30 \), expected"),
        ("DEFAULT := 0;", "LOCK : PREVIOUS, RANGE;", r"line 24: LOCK is PREVIOUS , RANGE, expected PREVIOUS, RANGE"),
        ("DEFAULT := 0;\n", "DEFAULT := 0\n", r"line 25: got 'END_DEFUZZIFY' after '0', expected ;"),
        ("END_FUNCTION_BLOCK\n", "END_FUNCTION_BLOCK ;", r"line 34: got ';' after 'END_FUNCTION_BLOCK', expected the"),
    ],
)  # fmt: skip
def test_unknown_constructs_are_rejected_with_their_line(old, new, fault):
    assert old in OTHERS
    if fault is None:
        assert reads(OTHERS.replace(old, new), "fcl") == reads(OTHERS, "fcl")
        return
    with pytest.raises((FormatError, DefinitionError), match=fault):
        reads(OTHERS.replace(old, new), "fcl")


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
    with pytest.raises(UnsupportedError, match=f"^fcl cannot say {fault}"):
        writes(replace(TIPPING, **change), "fcl")


def test_names_that_differ_only_in_case_are_rejected():
    twin = Variable("QUALITY", (0, 1), TIPPING.inputs[0].terms)
    with pytest.raises(UnsupportedError, match="the names 'quality' and 'QUALITY': they differ in case alone"):
        writes(replace(TIPPING, inputs=(*TIPPING.inputs, twin)), "fcl")


BLOCKS = FOREIGN["blocks.fcl"]


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
    assert Arbiter(system=reads(BLOCKS, "fcl"))([1.0]) == pytest.approx(((1.0 + 3.0) / 2.0,))  # not (1 + 1 + 3) / 3
    ours = BLOCKS.replace("TERM on := (0, 0) (1, 1)", "TERM on := Ramp 0.0 1.0")  # a word of fuzzylite, which adds them
    assert Arbiter(system=reads(ours, "fcl"))([1.0]) == pytest.approx(((1.0 + 1.0 + 3.0) / 3.0,))


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
