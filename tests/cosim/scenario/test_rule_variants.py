"""Rule variants for comparison with an arbiter, and path costs through its regions."""

import itertools
import json

import numpy as np
import pytest

from cosim.errors import ScenarioError
from cosim.scenario.arbiter_rules import rules_by_order
from cosim.scenario.criteria import PAPER, CriterionSetup, Reason
from cosim.scenario.scenario import load_scenario
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.criteria import SECTION_VI, prioritized

FOUR = (*PAPER, CriterionSetup("visibility", "#CC79A7", (Reason("ramp", None),)))
PLACES = (0.0, 0.2, 0.4, 0.6, 1.0)


def weights(variant, criteria, memberships):
    """Return the weights by the criteria's names, of memberships by their places."""
    system = rules_by_order(variant, criteria, 101)
    by_name = dict(zip((criterion.name for criterion in criteria), memberships, strict=True))
    return Arbiter(system)([by_name[variable.name] for variable in system.inputs])


@pytest.mark.medium
def test_reversed_rules_are_those_of_the_reversed_order():
    last_first = Arbiter(prioritized(SECTION_VI[::-1]))
    for memberships in itertools.product(PLACES, repeat=3):
        found = weights("reversed", PAPER, memberships)
        assert found._fields == ("obstacle", "shape", "depth")
        assert list(found) == pytest.approx(list(last_first(memberships[::-1]))[::-1], abs=1e-12)


@pytest.mark.slow
def test_crisp_rules_are_the_fuzzy_ones_of_rounded_memberships():
    for memberships in itertools.product(PLACES, repeat=4):
        rounded = [float(membership > 0.5) for membership in memberships]
        assert list(weights("crisp", FOUR, memberships)) == pytest.approx(
            list(weights("ordered", FOUR, rounded)), abs=1e-12
        )


def test_without_an_arbiter_all_weights_are_1():
    scenario = load_scenario("inspection-visibility", ['arbiter.rules="none"'])
    inputs = [signal.course[0][1] for signal in scenario.rules.inputs]
    assert list(Arbiter(scenario.rules.system)(inputs)) == pytest.approx([1.0] * 4, abs=1e-12)


@pytest.mark.parametrize("variant", ["ordered", "reversed", "crisp", "none"])
def test_rule_variants_use_the_closed_form_engine(variant):
    assert Arbiter(rules_by_order(variant, FOUR, 101)).engine == "closed"


def test_rule_variant_is_rejected_with_an_arbiter_file(tmp_path):
    Arbiter(prioritized()).save(tmp_path / "mine.json")
    table = "".join(f'arbiter.inputs.{name}="membership.{name}"\n' for name in ("obstacle", "shape", "depth"))
    changes = [f'arbiter.file="{tmp_path / "mine.json"}"', *table.splitlines()]
    assert load_scenario("docking", changes).arbiter.rules == "ordered"
    with pytest.raises(ScenarioError, match=r"arbiter\.rules is 'crisp', expected none beside arbiter\.file"):
        load_scenario("docking", [*changes, 'arbiter.rules="crisp"'])


def costs(variant):
    scenario = load_scenario("inspection-visibility", [f'arbiter.rules="{variant}"'])
    return {r.criterion: r.region.crossing_cost for r in scenario.regions if not r.region.hard}


def test_path_cost_is_highest_in_regions_of_top_priority():
    """Three criteria have soft regions. In its two pairs the first always wins, the second once, the third never."""
    assert costs("ordered") == pytest.approx({"shape": 10.0, "depth": 2.0, "visibility": 0.4}, rel=1e-9)
    assert costs("reversed") == pytest.approx({"shape": 0.4, "depth": 2.0, "visibility": 10.0}, rel=1e-9)
    assert costs("none") == pytest.approx(dict.fromkeys(("shape", "depth", "visibility"), 2.0), rel=1e-9)


def test_arbiter_file_costs_use_its_own_input_signals(tmp_path):
    """A file over clearances: full membership on the surface, zero at the end of the universe."""
    others = ("depth", "visibility", "obstacle")
    near_far = {"near": {"falling": [0, 1]}, "far": {"rising": [0, 1]}}
    low_high = {"low": {"falling": [0, 1]}, "high": {"rising": [0, 1]}}
    rules = ["if risers is near then shape is high", "if risers is far then shape is low"]
    rules += [f"if below is {term} then {name} is low" for name in others for term in near_far]
    system = {
        "inputs": [{"name": name, "universe": [0, 1], "terms": near_far} for name in ("risers", "below")],
        "outputs": [{"name": name, "universe": [0, 1], "default": 0, "terms": low_high} for name in ("shape", *others)],
        "rules": rules,
    }
    (tmp_path / "mine.json").write_text(json.dumps(system))
    signals = '{risers="clearance.risers",below="clearance.greatest depth"}'
    changes = [f'arbiter.file="{tmp_path / "mine.json"}"', 'arbiter.engine="exact"', f"arbiter.inputs={signals}"]
    scenario = load_scenario("inspection-visibility", changes)
    found = {r.criterion: r.region.crossing_cost for r in scenario.regions if not r.region.hard}
    high, low = 2.0 / 3.0, 1.0 / 3.0  # centroids of the two terms
    pressing, other = high / (high + low), 0.5
    assert found["shape"] == pytest.approx(2.0 * 5.0 ** (2.0 * pressing - 1.0), rel=1e-9)
    assert found["depth"] == pytest.approx(2.0 * 5.0 ** (2.0 * np.mean([low, other]) - 1.0), rel=1e-9)
    assert found["depth"] == found["visibility"]


def test_crossing_cost_without_soft_regions_is_the_default():
    assert {r.region.crossing_cost for r in load_scenario("dense-field").regions} == {2.0}
