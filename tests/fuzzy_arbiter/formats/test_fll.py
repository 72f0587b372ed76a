"""The FuzzyLite Language: files of fuzzylite, and rejected content."""

from dataclasses import replace

import pytest

from fuzzy_arbiter import Arbiter, Output, Shape, System, Term, Variable, falling, rising, trapezoid, triangle
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.errors import FormatError, UnsupportedError
from fuzzy_arbiter.formats import reads, writes
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms.values import Formula
from tests.fuzzy_arbiter.formats.systems import FOREIGN, TIPPING

OTHERS = FOREIGN["tipper.fll"]


def test_foreign_engine_is_read():
    system = reads(OTHERS, "fll")
    assert (system.name, system.outside, system.points) == ("tip for two", "clip", 1000)
    assert (system.conjunction, system.disjunction, system.implication) == ("prod", "max", "prod")
    assert [term.shape for term in system.inputs[0].terms] == [
        falling(0, 5),
        rising(0, 5),
        Shape(((1, 0), (1, 0.5), (2, 0.5), (2, 0))),
        rising(6, 6),
        Shape(((0, 0), (5, 0.5), (10, 0.25))),
    ]
    assert [term.shape for term in system.outputs[0].terms] == [falling(5, 20), rising(5, 20)]
    assert system.outputs[0].default is None
    assert list(map(str, system.rules)) == [
        "if service is poor and service is not drawn then tip is cheap with 0.5",
        "if service is good then tip is generous",
    ]


def test_points_and_clipping_use_fll_keywords():
    system = prioritized(outside="clip", points=64)
    text = writes(system, "fll")
    assert text.count("lock-range: true") == 3
    assert text.count("defuzzifier: Centroid 64\n") == 3
    said = 'weights_of = "obstacle" "shape" "depth"'
    assert text.splitlines()[0] == f"# fuzzy_arbiter: normalization = range, {said}"


def test_terms_are_triangles_trapezoids_and_ramps_where_they_can_be():
    said = {
        triangle(1, 2, 3): "Triangle 1 2 3",
        trapezoid(1, 2, 2.5, 3): "Trapezoid 1 2 2.5 3",
        rising(1, 3): "Ramp 1 3",
        falling(1, 3): "Ramp 3 1",
        rising(3, 3): "Discrete 3 0 3 1",
        Shape(((1, 0.5), (2, 0.25), (3, 1))): "Discrete 1 0.5 2 0.25 3 1",
        Shape(((0, 0.5),)): "Discrete 0 0.5",
    }
    v = Variable("v", (0, 10), tuple(Term(f"t{i}", shape) for i, shape in enumerate(said)))
    system = replace(TIPPING, inputs=(v,), rules=("if v is t0 then tip is low",))
    text = writes(system, "fll")
    for i, words in enumerate(said.values()):
        assert f"  term: t{i} {words}\n" in text
    assert reads(text, "fll") == system


def test_outputs_share_one_resolution_and_locking():
    text = writes(prioritized(), "fll")
    assert reads(text.replace("Centroid 101", "Centroid 100", 1), "fll").points == 101  # the most of any
    with pytest.raises(FormatError, match="'shape' has another lock-range than 'obstacle'"):
        reads(text.replace("lock-range: false", "lock-range: true", 1), "fll")


def test_rules_keep_the_operators_of_their_block():
    head, tail = OTHERS.split("RuleBlock: more")
    system = reads(
        head + "RuleBlock: more" + tail.replace("implication: AlgebraicProduct", "implication: Minimum"), "fll"
    )
    assert [rule.operators for rule in system.rules] == [None, Operators("prod", "max", "min")]
    assert reads(writes(system, "fll"), "fll") == system


def test_file_with_two_engines_is_rejected():
    text = writes(prioritized(), "fll")
    with pytest.raises(FormatError, match="expected one Engine in a FLL file, got 2"):
        reads(f"{text}Engine: twin\n", "fll")


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"name": "a#b"}, "the name 'a#b': what follows # is a comment"),
        ({"inputs": (Variable("max", (0, 1), (Term("a", rising(0, 1)),)),), "rules": ("if max is a then tip is low",)},
         "the name 'max': it is a word of the language"),
        ({"outputs": (Output("tip", (0, 1), (Term("very", rising(0, 1)),)),),
          "rules": ("if quality is poor then tip is very",)}, "the name 'very': it is a word of the language"),
        ({"rules": ("if not (quality is poor or service is poor) then tip is low",)}, "the condition of R1 .*: expect"),
    ],
)  # fmt: skip
def test_unsupported_features_are_rejected_by_name(change, fault):
    with pytest.raises(UnsupportedError, match=f"^fll cannot express {fault}"):
        writes(replace(TIPPING, **change), "fll")


def test_names_differ_from_functions_by_capital_letters_and_may_have_accents():
    v = Variable("LE", (0, 1), (Term("Abs", rising(0, 1)),))
    values = {"Nível": Formula("le(LE, 0.5) + LE")}
    system = System((v,), (Output("é", (0, 2), values, defuzzifier="average"),), ('if LE is Abs then "é" is "Nível"',))
    system = replace(system, points=1000)
    assert reads(writes(system, "fll"), "fll") == system
    assert Arbiter(system)([0.25])["é"] == 1.25


def test_engine_names_may_be_any_text():
    system = replace(TIPPING, name="a: b, 'c'")
    assert reads(writes(system, "fll"), "fll") == system
