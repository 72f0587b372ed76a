"""The ventilation example and those of the manual, against independently computed values."""

import ast
import re
import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fuzzy_arbiter import Arbiter, Rule, Shape, Term
from fuzzy_arbiter.criteria import Criterion, prioritized
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.formats import reads, writes
from fuzzy_arbiter.hierarchy import FORMS
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.terms.curves import curve
from fuzzy_arbiter.terms.values import Constant, Linear
from tests.fuzzy_arbiter.test_inputs_and_results import TIPPING

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "ventilation.py"
MANUAL = (ROOT / "docs" / "arbiter.md").read_text()


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ventilation")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return runpy.run_path(str(EXAMPLE), run_name="__main__") | {"folder": folder}


def smoothstep(h):
    return 3.0 * h**2 - 2.0 * h**3


@pytest.mark.medium
def test_example_afternoon_weights_match_the_closed_form(ran):
    # smoke below 0.5 %/m asks for nothing; air asks to 0.25, the room to 0.75, of which the air leaves all
    assert ran["weights"] == pytest.approx((0.0, smoothstep(0.25), smoothstep(0.75)), abs=1e-15)
    assert "temperature is hot" in str(ran["explanation"])
    assert ran["verification"].ok


def test_example_day_follows_the_priorities(ran):
    """By the definition of the weights, on numpy alone."""
    low, high = np.array([[0.5, 800.0, 24.0], [3.0, 1400.0, 28.0]])
    m = np.clip((ran["day"] - low) / (high - low), 0.0, 1.0)
    free = np.cumprod(np.ones_like(m), axis=1)
    free[:, 1:] = np.minimum.accumulate(1.0 - m, axis=1)[:, :-1]
    rounding = 8 * np.finfo(float).eps  # both round h h (3 - 2 h) three times, at numbers of up to 3, and h before
    np.testing.assert_allclose(ran["day_weights"], smoothstep(np.minimum(free, m)), rtol=0.0, atol=rounding)


def test_example_smoke_takes_priority_temporarily(ran):
    leader, minutes = ran["leader"], ran["minutes"]
    smoke = minutes[leader == 0]
    assert smoke.min() == 850 and 855 < smoke.max() < 870
    assert (leader[: 8 * 60] == -1).all()
    assert (leader[9 * 60 : 12 * 60] == 1).all()
    assert (ran["folder"] / "ventilation.png").read_bytes().startswith(b"\x89PNG")
    assert "present" in (ran["folder"] / "ventilation.toml").read_text()


def test_the_fan_s_speed_is_the_centroid_of_its_rules(ran):
    """By midpoints of two million strips."""
    n = 2_000_000
    y = (np.arange(n) + 0.5) * (100.0 / n)
    stale, hot = (1250.0 - 800.0) / 600.0, 0.5  # no smoke; 15 degrees outdoors are neither warm nor cold
    half = np.clip(np.minimum(y - 30.0, 70.0 - y) / 20.0, 0.0, stale)
    slow = np.clip(np.minimum(y, 40.0 - y) / 20.0, 0.0, min(1.0 - stale, 1.0 - hot))
    full = np.clip((y - 60.0) / 30.0, 0.0, 0.6 * hot)
    joined = np.maximum(half, np.maximum(slow, full))
    assert ran["fan_speed"] == pytest.approx((joined * y).sum() / joined.sum(), abs=1e-6)
    # where no rule fires it runs slowly
    assert ran["speed"]({"smoke": 0.0, "co2": 500.0, "temperature": 30.0, "outdoors": 35.0}) == (20.0,)


# ---- the manual ----


def test_manual_definitions_match_their_code():
    names = {}
    for block in re.findall(r"```python\n(.*?)```", MANUAL, re.S):
        for statement in ast.parse(block).body:  # its expressions are compared with what they show where all pages are
            if not isinstance(statement, ast.Expr):
                exec(compile(ast.Module([statement], []), "arbiter.md", "exec"), names)
    own_file, of_criteria = (reads(text, "toml") for text in re.findall(r"```toml\n(.*?)```", MANUAL, re.S))
    assert [output.name for output in own_file.outputs] == ["sail"]
    smoke, draft = of_criteria.inputs
    assert smoke == names["arbiter"].system.inputs[0] and draft == Criterion("draft").variable
    assert names["system"] == TIPPING
    poor = names["service"]["poor"]
    assert names["system"].rules[0] == Rule(poor | names["food"]["poor"], names["tip"]["low"])
    assert poor(3) == pytest.approx(0.4)  # as the text says


def table(heading):
    """Rows of the first table below a heading, as lists of cells."""
    part = MANUAL[MANUAL.index(f"\n## {heading}\n") :]
    rows = re.search(r"((?:\|.*\n)+)", part).group(1).splitlines()
    return [[cell.strip().strip("`") for cell in row.strip("|").split("|")] for row in rows if "---" not in row]


@pytest.mark.medium
def test_rule_counts_match_the_manual():
    for form, _, sizes, _ in table("Four forms of the same rules")[1:]:
        for n, size in zip((3, 10), sizes.split(","), strict=True):
            criteria = [Criterion(f"c{i}") for i in range(n)]
            assert len(prioritized(criteria, form=form).rules) == int(size)


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_cuts_of_the_forms_are_those_of_the_manual(n):
    """Also between crisp inputs; the complete table's are other there, for more than one criterion."""
    from fuzzy_arbiter.engines.firing import Firing

    m = np.random.default_rng(n).random((500, n))
    m[:100] = m[:100].round()
    free = np.column_stack([(1.0 - m[:, :k]).min(axis=1, initial=1.0) for k in range(n)])
    h = np.minimum(free, m)
    decided = np.column_stack([np.maximum(m, 1.0 - m)[:, k + 1 :].min(axis=1, initial=1.0) for k in range(n)])
    cuts = {}
    for form in FORMS:
        firing = Firing(prioritized([Criterion(f"c{i}") for i in range(n)], form=form))
        low, high = np.array(firing.cuts(firing.strengths(m))).transpose(1, 2, 0)
        if form != "complete":
            np.testing.assert_array_equal(high, h)
            np.testing.assert_allclose(low, 1.0 - h, rtol=0.0, atol=1e-16)
        else:
            np.testing.assert_array_equal(high, np.minimum(h, decided))
            np.testing.assert_array_equal(high[:100], h[:100])
            assert n == 1 or (high < h).any()
        cuts[form] = high
    assert n == 1 or not np.array_equal(cuts["complete"], cuts["minimal"])


def test_the_complete_table_differs_by_a_sixth_at_the_most():
    criteria = (Criterion("a"), Criterion("b"))
    grid = np.linspace(0.0, 1.0, 41)
    inputs = np.column_stack([axis.ravel() for axis in np.meshgrid(grid, grid)])
    gap = abs(Arbiter(criteria, form="complete").batch(inputs) - Arbiter(criteria).batch(inputs))
    assert gap.max() == pytest.approx(1.0 / 6.0, abs=1e-12)
    assert inputs[gap.max(axis=1).argmax()].tolist() == [1.0, 0.5]


def test_scikit_fuzzy_error_is_within_the_documented_bound():
    inputs = np.random.default_rng(0).random((200, 3))
    inputs[0] = 1e-4, 0.0, 0.0  # the bound is come near to where h is next to 0
    for points in (3, 11, 101):
        step = 1.0 / (points - 1)
        for normalization, bound in (("none", step**2 / 6.0), ("range", step**2 / 2.0)):
            gap = [
                Arbiter(points=points, normalization=normalization, engine=engine).batch(inputs)
                for engine in ("skfuzzy", "exact")
            ]
            assert 0.3 * bound < abs(gap[0] - gap[1]).max() <= bound + 1e-13


PLAIN = prioritized(normalization="none")
LOW = "then alpha_1 is low"
VALUES = {"low": Constant(0.0), "high": Linear((1.0, 0.5, 0.0), 2.0)}


def with_rule(text, operators=None):
    return replace(PLAIN, rules=(*PLAIN.rules, Rule.parse(text, operators)))


def with_terms(*shapes):
    first = PLAIN.inputs[0]
    terms = (*first.terms, *(Term(f"odd{i}", shape) for i, shape in enumerate(shapes)))
    return replace(PLAIN, inputs=(replace(first, terms=terms), *PLAIN.inputs[1:]))


def with_outputs(**changes):
    return replace(PLAIN, outputs=tuple(replace(v, **changes) for v in PLAIN.outputs))


# the rules of section VI with one feature that some formats do not support
CHANGED = {
    "weights of rules": with_rule(f"if obstacle is exist {LOW} with 0.5"),
    "a default": with_outputs(default=0.5),
    "*and* with *or* in one rule": with_rule(f"if obstacle is exist and (shape is complex or depth is maintain) {LOW}"),
    "*not* of a parenthesis": with_rule(f"if not (obstacle is exist or shape is complex) {LOW}"),
    "terms of any points": with_terms(Shape(((0.0, 0.2), (0.3, 0.9), (0.6, 0.1)))),
    "prod with max": replace(PLAIN, conjunction="prod"),
    "hedges": with_rule(f"if obstacle is very exist {LOW}"),
    "blocks of other operators": with_rule(f"if obstacle is exist {LOW}", Operators("prod", "probor", "prod")),
    "Gaussians, bells, sigmoids": with_terms(curve("gaussian", 0.5, 0.1), curve("sigmoid", 0.5, 9.0)),
    "S, Z, Pi shapes": with_terms(curve("s_shape", 0.2, 0.8)),
    "other curves": with_terms(curve("spike", 0.2, 0.8)),
    "constant and linear values": with_outputs(terms=VALUES, defuzzifier="average", aggregation="sum"),
    "bisector, means of maxima": with_outputs(defuzzifier="bisector"),
    "keeping the value before": with_outputs(lock_previous=True),
    "names with spaces": prioritized([Criterion("a wall", on="near by", off="far off")], normalization="none"),
}


@pytest.mark.parametrize("row", table("Formats")[2:-1], ids=lambda row: row[0])
def test_format_support_matches_the_manual(row):
    system = CHANGED[row[0]]
    for formats, answer in zip((["json", "toml"], ["fcl"], ["fis"], ["fll"]), row[1:], strict=True):
        for name in formats:
            if answer.startswith("yes"):
                assert reads(writes(system, name), name) == system
            else:
                with pytest.raises(UnsupportedError):
                    writes(system, name)
