"""Written systems round-trip or are rejected by name; no text ends in a traceback."""

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fuzzy_arbiter import Arbiter, ArbiterError, Output, Shape, System, Term, Variable
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.errors import DefinitionError, FormatError, UnsupportedError
from fuzzy_arbiter.formats import FORMATS, reads, writes
from fuzzy_arbiter.hierarchy import FORMS
from fuzzy_arbiter.propositions import Is, Not
from fuzzy_arbiter.terms.norms import AGGREGATIONS, S_NORMS, T_NORMS
from tests.examples import examples
from tests.fuzzy_arbiter.formats.systems import RICHER, TIPPING, systems

relaxed = settings(max_examples=examples(40), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("form", FORMS)
def test_prioritized_systems_round_trip(format, form):
    for system in (prioritized(form=form), prioritized(form=form, normalization="sum", outside="clip", points=77)):
        assert reads(writes(system, format), format) == system


@pytest.mark.parametrize("format", FORMATS)
def test_richer_systems_round_trip_with_equal_results(format):
    system = RICHER[format]
    again = reads(writes(system, format), format)
    assert again == system
    rows = [[2.5, 3.0], [6.5, 3.0], [9.0, 9.5]]
    assert Arbiter(again).batch(rows).tolist() == Arbiter(system).batch(rows).tolist()


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("format", FORMATS)
@relaxed
@given(systems(plain=True))
def test_plain_systems_round_trip_in_every_format(format, system):
    assert reads(writes(system, format), format) == system


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("format", FORMATS)
@relaxed
@given(systems())
def test_any_system_round_trips_or_is_rejected_by_name(format, system):
    fault = _fault(lambda: writes(system, format), UnsupportedError)
    if fault is None:
        assert reads(writes(system, format), format) == system
    else:
        assert format in ("fcl", "fis", "fll")
        assert fault.startswith(f"{format} cannot express the ")
        assert "\n" not in fault


def _fault(call, kind):
    try:
        call()
    except kind as error:
        return str(error)
    return None


def _require_one_line(text, format):
    fault = _fault(lambda: reads(text, format), ArbiterError) or ""
    assert "\n" not in fault
    assert len(fault) < 1000


texts = {f: writes(prioritized(outside="clip", points=55), f) for f in FORMATS}
SIGNS = st.sampled_from("()[]{}\"'%#*:=;,.0123 -eE\nabct_\\/\u00e9\u2028\0")


@pytest.mark.parametrize("format", FORMATS)
@settings(max_examples=examples(100))
@given(data=st.data())
def test_damaged_text_raises_only_typed_errors(format, data):
    text = texts[format]
    for _ in range(data.draw(st.integers(1, 3))):
        kind = data.draw(st.sampled_from(("cut", "insert", "replace", "drop", "repeat", "swap")))
        i = data.draw(st.integers(0, len(text)))
        lines = text.split("\n")
        j, k = (data.draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        if kind == "cut":
            text = text[:i] + text[i + data.draw(st.integers(1, 6)) :]
        elif kind == "insert":
            text = text[:i] + data.draw(SIGNS) + text[i:]
        elif kind == "replace":
            text = text[:i] + data.draw(SIGNS) + text[i + 1 :]
        else:
            lines[k:k] = [lines[j]] if kind != "drop" else []
            if kind != "repeat":
                del lines[j]
            text = "\n".join(lines)
    _require_one_line(text, format)


@pytest.mark.parametrize("format", FORMATS)
@given(text=st.text(max_size=60))
@settings(max_examples=examples(60))
def test_arbitrary_text_raises_only_typed_errors(format, text):
    _require_one_line(text, format)


DEEP = "(" * 10_000
MONSTERS = (
    "",
    "\ufeff",
    "\0",
    DEEP,
    "[" * 100_000,
    '{"a":' * 10_000,
    "a = " + "[" * 100_000,
    "a." * 5000 + "b = 1",
    '{"points": ' + "1" * 5000 + "}",
    "points = " + "1" * 5000,
    '{"rules": ["if ' + DEEP + '"], "inputs": [], "outputs": []}',
    f"FUNCTION_BLOCK x RULEBLOCK y ACCU : MAX; RULE 1 : IF {DEEP}; END_RULEBLOCK END_FUNCTION_BLOCK",
    f"Engine: x\nRuleBlock:\n  rule: if {'not ' * 10_000}",
    f"[System]\n[Rules]\n{DEEP}",
)


@pytest.mark.medium(fast=41)
@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("text", MONSTERS)
def test_oversized_texts_give_short_errors(format, text):
    with pytest.raises(ArbiterError) as error:
        reads(text, format)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize("format", ["json", "toml", "fcl", "fll"])
def test_deepest_allowed_rule_round_trips(format):
    condition = Is("quality", "poor")
    for _ in range(50):
        condition = Not(condition) if format == "fll" else ~(condition & Is("service", "poor"))
    system = replace(TIPPING, rules=(replace(TIPPING.rules[0], condition=condition),))
    assert reads(writes(system, format), format) == system
    with pytest.raises(DefinitionError, match="nested deeper than 100 parentheses and negations"):
        Not(condition)


@pytest.mark.parametrize("format", ["fcl", "fis", "fll"])
def test_numbers_are_not_rounded(format):
    x = 0.1 + 0.2
    v = Variable("v", (-1e-5, x), (Term("t", Shape(((5e-324, 0.0), (x / 3, 1.0), (1e22, 0.0)))),))
    o = Output("o", (1 / 3, 1e16), (Term("t", Shape(((1 / 3, 0.0), (123456789.123456789, 1.0), (1e16, 0.0)))),))
    system = System((v,), (o,), ("if v is t then o is t with 1e-05",))
    assert reads(writes(system, format), format) == system


@pytest.mark.parametrize("format", ["fcl", "fis", "fll"])
def test_settings_round_trip_in_one_comment(format):
    text = writes(prioritized(), format)
    assert "fuzzy_arbiter: normalization = range" in text.splitlines()[0]
    assert "(c - 0.3333333333333333) / 0.3333333333333333, held within [0, 1], for alpha_1" in text
    plain = replace(prioritized(), normalization="none", weights_of=())
    assert "fuzzy_arbiter" not in writes(plain, format)
    assert reads(writes(plain, format), format) == plain


@pytest.mark.parametrize("format", ["fcl", "fis", "fll"])
@pytest.mark.parametrize(
    ("said", "fault"),
    [
        ("fuzzy_arbiter: normalization = ranje", "line 1: normalization is 'ranje', expected one of none, range, sum,"),
        ("fuzzy_arbiter: scale = range", "line 1: 'scale = range', expected each once, with = and its value: normaliz"),
        ("fuzzy_arbiter: normalization", "line 1: 'normalization', expected each once"),
        ("fuzzy_arbiter: normalization = sum, normalization = sum", "line 1: 'normalization = sum', expected each onc"),
        ("fuzzy_arbiter: normalization = range, normalization", "line 1: 'normalization', expected each once"),
        ("fuzy_arbiter: normalization = range", "line 1: .* is almost such a comment, expected 'fuzzy_arbiter:'"),
        ("fuzzy_arbiter normalization = range", "line 1: .* is almost such a comment, expected 'fuzzy_arbiter:'"),
    ],
)
def test_unknown_settings_are_rejected(format, said, fault):
    text = writes(prioritized(), format).replace("fuzzy_arbiter: normalization = range", said)
    with pytest.raises(FormatError, match=fault):
        reads(text, format)


@pytest.mark.parametrize("format", ["fcl", "fis", "fll"])
def test_duplicate_settings_are_rejected(format):
    text = writes(prioritized(), format)
    with pytest.raises(FormatError, match=r"line 2: .* is the second such comment after line 1, expected one"):
        reads(f"{text.splitlines()[0]}\n{text}", format)


@pytest.mark.parametrize("call", [lambda: reads("", "xml"), lambda: writes(TIPPING, "xml")])
def test_other_formats_are_refused(call):
    with pytest.raises(FormatError, match="format is 'xml', expected one of json, toml, fcl, fis, fll"):
        call()


@pytest.mark.parametrize("format", FORMATS)
def test_every_norm_has_a_word(format):
    norms = [
        (key, n)
        for key, known in (("conjunction", T_NORMS), ("implication", T_NORMS), ("disjunction", S_NORMS))
        for n in known
    ]
    for change in (
        *({key: n} for key, n in norms),
        *({"outputs": (replace(TIPPING.outputs[0], aggregation=n),)} for n in AGGREGATIONS),
    ):
        system = replace(TIPPING, **change)
        assert reads(writes(system, format), format) == system
