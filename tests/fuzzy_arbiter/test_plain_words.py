"""Whoever has no criteria never reads of them."""

import re
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO

import pytest

from fuzzy_arbiter import (
    Arbiter,
    ArbiterError,
    Constant,
    Linear,
    Output,
    System,
    Variable,
    auto_terms,
    falling,
    rising,
    triangle,
)
from fuzzy_arbiter.__main__ import main
from fuzzy_arbiter.export import to_c, to_python

FOREIGN = re.compile(r"\bweights?\b|criteri|winner|prioriti|\bnormaliz|\balpha", re.IGNORECASE)
SERVICE, FOOD = (Variable(name, (0, 10), auto_terms(3)) for name in ("service", "food"))
TIP = Output("tip", (0, 25), {"low": triangle(0, 0, 13), "medium": triangle(0, 13, 25), "high": triangle(13, 25, 25)})
THANKS = Output("thanks", (0, 1), {"few": Constant(0.0), "many": Linear((0.1, 0.0), 0.0)}, defuzzifier="average")
RULES = (
    "if service is poor or food is poor then tip is low and thanks is few",
    "if service is average then tip is medium",
    "if service is good and food is good then tip is high and thanks is many",
)
TIPPING = System((SERVICE, FOOD), (TIP, THANKS), RULES, name="tipping")
SAMPLES = ([9.8, 6.5], [0.0, 0.0], [5.0, 10.0], [5.0, 5.0])


def faults(arbiter):
    """Yield the messages of what may go wrong with a plain system."""
    rows = {"service": [1.0], "food": [2.0]}
    for work in (
        lambda: arbiter([1.0]), lambda: arbiter([1.0, 11.0]), lambda: arbiter(1, 2), lambda: arbiter(service=1),
        lambda: arbiter(service=1, foot=2), lambda: arbiter([1, 2], service=1), lambda: arbiter("ab"),
        lambda: arbiter(None), lambda: arbiter([[1, 2]]), lambda: arbiter.batch([1, 2]),
        lambda: arbiter.batch([["a", 2]]),
        lambda: arbiter.batch([[1, float("nan")]]), lambda: arbiter.batch(rows | {"food": [1, 2]}),
        lambda: arbiter([1, 2])["top"], lambda: float(arbiter([1, 2])), lambda: arbiter.system["top"],
        lambda: arbiter.system["tip"]["top"], lambda: Arbiter(TIPPING, engine="closed"),
        lambda: Arbiter(TIPPING, engine="x"),
        lambda: Arbiter(TIPPING, engine="skfuzzy"), lambda: Arbiter(3), lambda: System((), (TIP,), RULES),
        lambda: replace(TIPPING, rules=("if service is bad then tip is low",)), lambda: replace(TIPPING, rules=("if",)),
        lambda: replace(TIPPING, outputs=(TIP,)), lambda: replace(TIPPING, conjunction="und"),
        lambda: replace(TIP, terms={"low": falling(30, 40)}), lambda: replace(TIP, default="x"),
        lambda: replace(TIP, defuzzifier="cog"), lambda: arbiter.save("tip.txt"), lambda: Arbiter.load("missing.fis"),
    ):  # fmt: skip
        try:
            work()
        except ArbiterError as error:
            yield str(error)


def test_texts_of_a_plain_system_speak_of_outputs_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arbiter = Arbiter(TIPPING)
    texts = [str(arbiter), repr(arbiter), arbiter._repr_html_(), arbiter.engine_reason, str(arbiter.verify())]
    texts += [str(arbiter.verify().as_dict()), to_c(TIPPING), to_python(TIPPING), repr(arbiter(SAMPLES[0]))]
    for sample in SAMPLES:
        explanation = arbiter.explain(sample)
        texts += [str(explanation), str(explanation.as_dict())]
    found = list(faults(arbiter))
    assert len(found) >= 28
    gaps = Arbiter(replace(TIPPING, rules=RULES[:1]))
    texts += [str(gaps.verify()), str(gaps.explain([9.0, 9.0])), str(replace(TIPPING, implication="prod").rule_table())]
    for name in ("tip.toml", "tip.json"):
        arbiter.save(name)
    (tmp_path / "bad.csv").write_text("service,food\n1,11\n")
    commands = ["show", "eval 9.8 6.5", "eval --csv bad.csv", "eval 1", "explain 5 5", "explain 5 5 --json", "verify"]
    commands += [
        "verify --json",
        "convert tip.py",
        "convert tip.fis",
        "plot terms --at x=1 --out a.svg",
        "plot rules --out a.png",
    ]
    for command in commands:
        out = StringIO()
        with redirect_stdout(out), redirect_stderr(out):
            verb, *words = command.split()
            main([verb, "tip.toml", *words])
        texts.append(f"{command}\n{out.getvalue()}")
    for text in (*texts, *found):
        assert not FOREIGN.search(text), text


@pytest.mark.parametrize("verb", ["", "show", "eval", "explain", "verify", "plot", "bench"])
def test_help_speaks_of_systems(verb, capsys):
    with pytest.raises(SystemExit):
        main([*verb.split(), "--help"])
    text = capsys.readouterr().out
    assert "usage" in text and not re.search("weights|winner|(?<!--as-)criteri", text)


def test_rules_are_a_table_also_for_notebooks():
    assert TIPPING.rule_table()[0] == {
        "rule": "R1",
        "if": "service is poor or food is poor",
        "tip": "low",
        "thanks": "few",
    }
    flat = System((SERVICE, FOOD), (TIP,), ("if service is poor and food is not good then tip is low with 0.5",
                                            "if food is very good then tip is high"))  # fmt: skip
    assert flat.rule_table() == [
        {"rule": "R1", "service": "poor", "food": "not good", "tip": "low", "with": "0.5"},
        {"rule": "R2", "service": "", "food": "very good", "tip": "high", "with": "1"},
    ]
    twice = replace(flat, rules=("if food is not poor and food is not good then tip is medium",))
    assert twice.rule_table()[0]["if"] == "food is not poor and food is not good"
    chained = replace(flat, rules=(*flat.rules, "if tip is high then tip is low"))
    assert chained.rule_table()[-1]["if"] == "tip is high"
    html = replace(
        flat, inputs=(replace(SERVICE, terms={"a<b": rising(0, 1), "poor": falling(0, 10)}), FOOD)
    )._repr_html_()
    assert "<td>a&lt;b, poor</td>" in html and "<th>service</th><th>food</th><th>tip</th>" in html
    assert html.count("<table>") == html.count("</table>") == 2


def test_mid_range_is_the_default_where_it_is_asked_for(tmp_path):
    arbiter = Arbiter(replace(TIPPING, rules=RULES[:1], outputs=(TIP, replace(THANKS, universe=(0, 4)))))
    arbiter.save(tmp_path / "tip.toml")
    for default, expected in (("mid-range", (12.5, 2.0)), ({"tip": "mid-range", "thanks": 1}, (12.5, 1.0))):
        assert Arbiter.load(tmp_path / "tip.toml", default=default)([9.0, 9.0]) == expected
    with pytest.raises(ArbiterError, match=r"tip\.toml: output 'tip': default is 'mean', expected a finite number"):
        Arbiter.load(tmp_path / "tip.toml", default="mean")
