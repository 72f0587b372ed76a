"""Definitions: invalid ones are rejected in one line with the given and the expected value."""

import copy
import pickle
from fractions import Fraction

import numpy as np
import pytest

from fuzzy_arbiter import Output, Rule, Shape, System, Term, Variable, falling, rising, trapezoid
from fuzzy_arbiter.criteria import Criterion, prioritized
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
from fuzzy_arbiter.formats import reads, writes
from fuzzy_arbiter.propositions import Is, Not, Or
from fuzzy_arbiter.rule import parse_rule

TERMS = (Term("calm", falling(2, 6)), Term("strong", rising(4, 12)))
wind = Variable("wind", (0, 20), TERMS)
sail = Output("sail", (0, 1), (Term("reefed", falling(0, 1)), Term("full", rising(0, 1))), default=0.0)
HUGE = 10**5000
CALM = wind["calm"]


def system(*rules, **others):
    return System(**{"inputs": (wind,), "outputs": (sail,), "rules": rules, **others})


def nested(depth):
    condition = CALM
    for i in range(depth):
        condition = condition & wind["strong"] if i % 2 else condition | wind["strong"]
    return condition


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda: CALM and wind["strong"], "wind is calm: a proposition is not true or false; combine with &"),
        (lambda: CALM & "wind is strong", "And: got 'wind is strong' among them, expected such as variable"),
        (lambda: Or(CALM for _ in range(1)), "Or of 1 propositions, expected two or more"),
        (lambda: Not("x"), "not: got 'x', expected such as"),
        (lambda: Is("wind", 3), "'wind' is 3: expected the names of both"),
        (lambda: nested(200), "nested deeper than 100 parentheses and negations"),
        (lambda: parse_rule("if " + "not " * 99 + "a is b then c is d"), "rule 'if not .*: nested deeper than 100"),
        (lambda: parse_rule(None), "rule: got None, expected text"),
        (lambda: wind[0], "'wind' has no term 0, expected one of calm, strong"),
        (lambda: Variable("v", None, TERMS), "variable 'v': universe is None, expected two finite numbers"),
        (lambda: Variable("v", (False, True), TERMS), r"universe is \(False, True\), expected two"),
        (lambda: Variable("v", (0, HUGE), TERMS), "universe is a tuple that is too long to show, expected two"),
        (lambda: Variable("v", (-1.7e308, 1.7e308), TERMS), "expected a finite width"),
        (lambda: Variable("v", (0, 1), {"calm": (2, 6)}), r"term 'calm': shape is \(2, 6\), expected such as"),
        (lambda: Variable("v", (0, 1), TERMS[0]), r"terms: got Term\(.*\), expected a mapping from names"),
        (lambda: Term("low", [(0, 1), (1, 0)]), r"term 'low': shape is \[.*\], expected such as triangle\(0, 1, 2\)"),
        (
            lambda: Shape((("0", "1"),)),
            r"shape: point \('0', '1'\), expected a finite position and a degree in \[0, 1\]",
        ),
        (lambda: Shape(((HUGE, 1),)), "shape: point .* that is too long to show, 1"),
        (
            lambda: trapezoid(1, 1, 1, 1),
            r"two points at 1.0, .*; one position alone is curve\('singleton', 1.0\)",
        ),
        (lambda: rising(-1e308, 1e308), "shape: positions -1e.308 to 1e.308, expected a finite distance"),
        (lambda: Output("o", (0, 1e200), sail.terms), r"output 'o': universe is \[0, 1e.200\], expected a width from"),
        (
            lambda: Output("o", (0, 1), sail.terms, 1.5, lock_range=True),
            "default is 1.5, expected a number in .* holds",
        ),
        (lambda: Output("o", (0, 1), sail.terms, HUGE), "default is a int that is too long .*, expected a finite num"),
        (lambda: Rule("wind is calm", sail["full"]), "rule: condition is 'wind is calm', expected such as"),
        (lambda: Rule(CALM, "sail is full"), r"wind is calm: got 'sail is full', expected as conclusions output\["),
        (lambda: Rule(CALM, ~sail["full"]), r"wind is calm: got Not\(.*\), expected as conclusions"),
        (lambda: Rule(CALM, ()), "wind is calm: no conclusions, expected output"),
        *(
            (lambda w=weight: Rule(CALM, sail["full"], w), "full': weight is .*, expected above 0 and at most 1")
            for weight in (True, "0.5", None, float("nan"), 0, 1.5, np.array([0.5]), Fraction(1, 10**400))
        ),
        (lambda: system(rules="if wind is calm then sail is full"), "rules: got 'if wind .*', expected a sequence"),
        (lambda: system(None), "rules: got None among them, expected a sequence of Rule or text"),
        (lambda: system(inputs=wind), r"inputs: got Variable\(.*, expected a sequence of Variable"),
        (lambda: system(outputs=(wind,)), r"outputs: got Variable\(.* among them, expected a sequence of Output"),
        (lambda: system(normalization=np.array(["sum", "max"])), "normalization is array.*, expected one of none"),
        (lambda: system(points=HUGE), "points is a int that is too long to show, expected a whole number, 3 or more"),
        (lambda: prioritized(["a", "b"]), "criteria: got 'a' among them, expected a sequence of Criterion"),
        (lambda: prioritized(weight="w"), "weight is 'w', expected an Output"),
        (lambda: prioritized(form=["minimal"]), r"form is \['minimal'\], expected one of hierarchical"),
        (lambda: Criterion("a", membership=[(0, 0), (1, 1)]), "criterion 'a': membership is .*, expected such as"),
        (lambda: Criterion("a", "on", "on"), "both terms are 'on'"),
        (lambda: Criterion("a", membership=rising(1.0, 1.0)), "without jumps"),
        (lambda: Criterion(None), "criterion name is None, expected printable text"),
        (lambda: Criterion("a", on=3), "criterion 'a': on name is 3, expected printable text"),
    ],
)
def test_invalid_definitions_give_one_line_errors(make, fault):
    with pytest.raises(DefinitionError, match=fault) as error:
        make()
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


def test_numbers_of_other_libraries_become_floats():
    places = np.array([[0, 1], [1, 0]])
    made = Variable("v", np.array([0.0, 1.0]), [Term("a", Shape(places))])
    places[:] = 7
    assert made == Variable("v", (0.0, 1.0), (Term("a", falling(0.0, 1.0)),))
    assert type(Rule(CALM, sail["full"], np.float32(0.25)).weight) is float
    assert str(Shape(((-0.0, 0), (1, 1)))) == str(Shape(((0.0, 0), (1, 1))))


@pytest.mark.parametrize("text", ["(a is b) and (c is d)", "(a is b and c is d)", "((a is b), c is d)"])
def test_conclusions_may_stand_in_parentheses(text):
    rule = Rule.parse(f"if wind is calm then {text} with 0.5")
    assert str(rule) == "if wind is calm then a is b and c is d with 0.5"
    for fault in ("(a is b", "(a is b or c is d)", "()"):
        with pytest.raises(DefinitionError, match="expected"):
            Rule.parse(f"if wind is calm then {fault}")


def test_definition_copies_lists_and_generators():
    terms, rules = list(TERMS), [Rule(nested(7), [sail["full"]]), "if wind is not calm then sail is reefed with 0.3"]
    made = system(inputs=(v for v in [Variable("wind", [0, 20], terms)]), rules=rules)
    terms.clear()
    rules.clear()
    assert made == system(Rule(nested(7), sail["full"]), "if wind is not calm then sail is reefed with 0.3")
    for other in (eval(repr(made), globals()), pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert other == made
        assert hash(other) == hash(made)


def test_terms_are_listed_once_for_all_rules(monkeypatch):
    """So that the work to build a system grows with the number of rules, not with its square."""
    counts, names = [], Variable.term_names.fget
    monkeypatch.setattr(Variable, "term_names", property(lambda v: (counts.append(v), names(v))[1]))
    system(*("if wind is calm then sail is full", "if wind is strong then sail is reefed") * 200)
    assert len(counts) < 10


def test_writers_require_systems_and_readers_require_text():
    with pytest.raises(UnsupportedError, match="got 'x', expected a System"):
        writes("x", "json")
    with pytest.raises(FormatError, match=r"got b'{}', expected text"):
        reads(b"{}", "json")
