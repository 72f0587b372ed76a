"""The MATLAB format FIS: files of MATLAB and Octave, and rejected content."""

from dataclasses import replace

import pytest

from fuzzy_arbiter import Output, Rule, Shape, System, Term, Variable, falling, prioritized, rising, trapezoid, triangle
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
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


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("1 1, 1 (1) : 2", "1.000 1.000 , 1.000 (1.000) : 2"),  # as fuzzylite writes
        ("'trimf',[0 5 10]", "'trimf',[0 5 10 0]"),  # as in old files of MATLAB's
        ("Version=2.0\n", ""),
    ],
)
def test_equivalent_spellings_are_read(old, new):
    assert old in OTHERS
    assert reads(OTHERS.replace(old, new), "fis") == reads(OTHERS, "fis")


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


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("mamdani", "anfis", "line 5: Type of System 'Tip for two' is anfis, expected mamdani or sugeno"),
        ("mamdani", "sugeno", "line 14: DefuzzMethod is 'centroid' in a file of the type 'sugeno', expected wtaver or"),
        ("AggMethod='max'", "AggMethod='most'", "line 13: AggMethod of System 'Tip for two' is most, expected max or"),
        ("centroid", "wtaver", "line 14: DefuzzMethod is 'wtaver' in a file of the type 'mamdani', expected centroid"),
        ("centroid", "median", "line 14: DefuzzMethod is 'median'.*expected centroid"),
        ("Type='mamdani'", "Type=mamdani", "line 5: Type is mamdani, expected text in single quotes"),
        ("Version=2.0", "Reduction='km'", "line 6: 'Reduction' is not known in System, expected one of Name"),
        ("NumInputs=2", "NumInputs=3", "line 7: NumInputs of System 'Tip for two' is 3, expected 2, since there are 2"),
        ("NumRules=3\n", "", "line 3: NumRules of System 'Tip for two' is missing, expected 3"),
        ("'linsmf',[4 6]", "'gausmf',[4 6]", "line 21: term 'good' is 'gausmf', which is not known.*trimf, trapmf"),
        ("'linsmf',[4 6]", "'gaussmf',[4]", "line 21: gaussmf has the numbers '4', expected 2, and perhaps a height"),
        ("'linsmf',[4 6]", "'linear',[4 6]", "line 21: an input's term is linear, which is a value, expected"),
        ("'linsmf',[4 6]", "'linsmf',[4 6 7]", r"line 21: term 'good' has the places \[4 6 7\], expected 2 for linsmf"),
        ("'trimf',[0 5 10]", "'trimf',[0 5 10 1]", r"line 36: term 'cheap' has the places \[0 5 10 1\], expected 3"),
        ("'linsmf',[4 6]", "'linsmf',[6 4]", "line 21: term 'good': shape: place 4.0 comes after 6.0"),
        ("MF2='good'", "MF4='good'", "line 21: got MF4 in Input1 'service', expected MF2"),
        ("MF2='good'", "MF1='good'", r"line 21: MF1 appears twice in Input1 'service'"),
        ("MF2='good':", "MF2=good:", "line 21: good:.*, expected a membership function such as"),
        ("Range = [0 10]", "Range = [0 10 20]", r"line 18: Range of Input1 'service' is \[0 10 20\], expected two num"),
        ("Range = [0 10]\n", "", "line 16: Input1 'service' has no Range"),
        ("[Input2]", "[Input3]", r"got \[Input3\] without \[Input2\]; expected them numbered from 1"),
        ("[Input2]", "[Input1]", r"line 25: section '\[Input1\]' appears twice"),
        ("[Input2]", "[Input]", r"line 25: section '\[Input\]', expected"),
        ("[Rules]\n", "", r"line 39: '1 1, 1 \(1\) : 2', expected a key, = and its value"),
        ("1 1, 1 (1) : 2", "1 1, 0 (1) : 2", "line 40: '1 1, 0 .* has no conclusion"),
        ("1 1, 1 (1) : 2", "0 0, 1 (1) : 2", "line 40: '0 0, 1 .* has no condition"),
        ("1 1, 1 (1) : 2", "4 1, 1 (1) : 2", "line 40: .*: 4 for 'service', expected a whole number from -3 to 3"),
        ("1 1, 1 (1) : 2", "1 1 1, 1 (1) : 2", "line 40: .* has 3 numbers in '1 1 1', expected 2"),
        ("1 1, 1 (1) : 2", "1 1, 1 (1) : 3", "line 40: .* ends in '3', expected 1 for and, 2 for or"),
        ("1 1, 1 (1) : 2", "1 1, 1 (0) : 2", "line 40: .*weight is 0.0, expected above 0"),
        ("1 1, 1 (1) : 2", "1 1 1 (1) : 2", "line 40: '1 1 1 .*, expected a rule such as"),
    ],
)
def test_unknown_constructs_are_rejected_with_their_line(old, new, fault):
    assert old in OTHERS
    with pytest.raises((FormatError, DefinitionError), match=fault):
        reads(OTHERS.replace(old, new, 1), "fis")


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
    with pytest.raises(UnsupportedError, match=f"^fis cannot say {fault}"):
        writes(replace(TIPPING, **change), "fis")


def test_conclusions_must_follow_the_output_order():
    system = prioritized(form="minimal")
    rule = Rule(system.rules[0].condition, (system.outputs[1]["low"], system.outputs[0]["high"]))
    with pytest.raises(
        UnsupportedError, match=r"fis cannot say the conclusions of R1 .*: expected each output in the order"
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
    with pytest.raises(UnsupportedError, match="fis cannot say the term 'up' of 'y'"):
        writes(System((x,), (low,), ("if x is on then y is up",)), "fis")
