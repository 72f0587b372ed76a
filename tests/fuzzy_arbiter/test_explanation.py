"""Explanations: fired rules, their strengths, and the deciding rule."""

import json
import math

import pytest

from fuzzy_arbiter import Arbiter, Output, System, Term, Variable, falling, rising
from fuzzy_arbiter.criteria import Criterion
from fuzzy_arbiter.engines.firing import Firing

SAMPLES = [(0.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.3, 0.6, 0.5), (0.5, 0.5, 0.5), (0.25, 1.0, 0.75)]


def lamp(rules, default=None, normalization="range", outputs=1):
    """Return a system of one input, with a gap between dark and bright, and lamps."""
    light = Variable("light", (0, 10), (Term("dark", falling(2, 4)), Term("bright", rising(6, 8))))
    low_high = (Term("low", falling(0, 1)), Term("high", rising(0, 1)))
    lamps = tuple(Output(f"lamp_{k + 1}", (0, 1), low_high, default) for k in range(outputs))
    return Arbiter(System((light,), lamps, rules, normalization=normalization))


def test_strengths_and_decisions_by_hand():
    e = Arbiter().explain({"obstacle": 0.3, "shape": 0.6, "depth": 0.5})
    assert [i.name for i in e.inputs] == ["obstacle", "shape", "depth"]
    assert e.inputs[0].value == 0.3
    assert e.inputs[0].degrees == {"not_exist": 0.7, "exist": 0.3}
    # R5 is min(.7, .6), R6 max(.3, .6), R8 min(.7, .4, .5)
    assert [r.strength for r in e.rules] == [0.3, 0.7, 0.3, 0.4, 0.6, 0.6, 0.5, 0.4]
    assert [r.label for r in e.rules] == [f"R{i}" for i in range(1, 9)]
    assert e.rules[4].text == "if obstacle is not_exist and shape is complex then alpha_2 is high"
    assert e.rules[4].conclusions == {"alpha_2": "high"}
    one, two, three = e.outputs
    assert one.cuts == {"low": 0.7, "high": 0.3}
    assert (one.decided_by, one.runner_up, one.margin) == ("R2", "R1", pytest.approx(0.4))
    assert (two.decided_by, two.runner_up, two.margin) == ("R5", "R4", pytest.approx(0.2))
    assert (three.decided_by, three.runner_up) == ("R6", "R8")
    # alpha = smoothstep(h), and before normalizing (1 + alpha) / 3
    for output, h in zip(e.outputs, (0.3, 0.6, 0.4), strict=True):
        alpha = 3 * h**2 - 2 * h**3
        assert output.value == pytest.approx(alpha, abs=1e-15)
        assert output.centroid == pytest.approx((1 + alpha) / 3, abs=1e-15)
    assert (e.winner, e.runner_up) == ("shape", "depth")
    assert e.margin == pytest.approx(0.648 - 0.352)


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("engine", ["auto", "exact", "grid", "skfuzzy"])
def test_weights_are_those_of_the_arbiter(sample, engine):
    arbiter = Arbiter(engine=engine)
    e = arbiter.explain(sample)
    assert e.result == arbiter(sample)
    assert [r.strength for r in e.rules] == Firing(arbiter.system).strengths(sample)


def test_no_winner_where_all_are_zero_and_where_two_tie():
    rest = Arbiter().explain([0, 0, 0])
    assert (rest.winner, rest.runner_up, rest.margin, rest.tied) == (None, None, 0.0, ())
    assert "all weights are 0" in str(rest)
    tie = Arbiter().explain([0.5, 0.5, 0.0])
    assert (tie.winner, tie.tied) == (None, ("obstacle", "shape"))
    assert "obstacle, shape are equal" in str(tie)
    assert tie.outputs[0].margin == 0.0
    assert "alike" in str(tie)


ON_DARK = "if light is dark then lamp_1 is high"
ON_BRIGHT = "if light is bright then lamp_1 is low"
BOTH = (
    "if light is dark then lamp_1 is high and lamp_2 is low",
    "if light is not dark then lamp_1 is low, lamp_2 is low",
)


@pytest.mark.parametrize(
    ("rules", "light", "strengths", "decisions"),
    [
        ((ON_DARK, ON_BRIGHT), 3.0, [0.5, 0.0], [("R1", None, 0.5)]),
        # of lamp_2 both rules conclude the same term
        (BOTH, 2.5, [0.75, 0.25], [("R1", "R2", 0.5), ("R1", None, 0.75)]),
        ((f"{ON_DARK} with 0.25", "if light is not bright then lamp_1 is low"), 0, [0.25, 1.0], [("R2", "R1", 0.75)]),
    ],
)
def test_strongest_rules_for_two_terms_decide(rules, light, strengths, decisions):
    e = lamp(rules, outputs=len(decisions)).explain([light])
    assert [r.strength for r in e.rules] == strengths
    assert [(o.decided_by, o.runner_up, o.margin) for o in e.outputs] == decisions
    assert (e.winner, e.runner_up, e.margin, e.tied) == (None, None, 0.0, ())  # outputs that are no criteria
    if len(decisions) == 1:
        assert (" alone" in str(e)) == (decisions[0][1] is None)


def test_used_default_is_reported():
    arbiter = lamp((ON_DARK,), default=0.25, normalization="none")
    (output,) = arbiter.explain([5.0]).outputs
    assert (output.centroid, output.value, output.decided_by, output.margin) == (0.25, 0.25, None, 0.0)
    assert output.default_used and not arbiter.explain([1.0]).outputs[0].default_used
    assert "no rule fired: its default 0.25" in str(arbiter.explain([5.0]))


def test_output_without_a_firing_rule_is_reported_and_others_are_decided():
    e = lamp((ON_DARK, ON_BRIGHT, "if light is dark or light is not dark then lamp_2 is high"), outputs=2).explain(
        [5.0]
    )
    first, second = e.outputs
    assert math.isnan(first.value) and math.isnan(first.centroid) and first.default_used and first.decided_by is None
    assert second.decided_by == "R3"
    assert "no rule fired, and no default" in str(e)
    data = json.loads(json.dumps(e.as_dict(), allow_nan=False))
    assert data["outputs"][0]["value"] is data["outputs"][0]["centroid"] is None
    assert data.keys() == {"inputs", "rules", "outputs"}


def test_text_lists_only_fired_rules():
    text = str(Arbiter().explain([0.0, 0.25, 0.0]))
    lines = text.splitlines()
    assert "rules that fired, 5 of 8" in lines
    assert "R1" not in text
    assert "  R5  0.25  if obstacle is not_exist and shape is complex then alpha_2 is high" in lines
    assert lines[-1] == "winner: shape, 0.15625 above obstacle"
    assert all(line == line.rstrip() for line in lines)
    ten = str(Arbiter([Criterion(f"c{i}") for i in range(10)]).explain([0.3] * 10))
    assert max(map(len, ten.splitlines())) <= 120
    assert len(ten.splitlines()) <= 10 + 29 + 10 + 4


def test_as_dict_is_json():
    e = Arbiter().explain([0.3, 0.6, 0.5])
    data = json.loads(json.dumps(e.as_dict()))
    assert data == e.as_dict()
    assert (data["winner"], data["outputs"][1]["cuts"]) == ("shape", {"low": 0.4, "high": 0.6})
    assert data["rules"][7] == {
        "label": "R8",
        "text": "if obstacle is not_exist and shape is simple and depth is not_maintain then alpha_3 is high",
        "strength": 0.4,
        "conclusions": {"alpha_3": "high"},
        "fired": True,
    }
