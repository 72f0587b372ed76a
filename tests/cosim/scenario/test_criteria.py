"""Criteria and rules of a scenario: file content, defaults, and rejected values."""

import tomllib

import pytest

from cosim.errors import ScenarioError
from cosim.scenario.scenario import load_scenario
from fuzzy_arbiter import Arbiter, falling
from fuzzy_arbiter.criteria import Criterion, prioritized

FOUR = "inspection-visibility"
RULES = """
name = "mine"
normalization = "range"
rules = [
  "if distance is near or soon is now then obstacle is high",
  "if distance is far and soon is later then obstacle is low",
  "if charge is full and depth_asks is yes then depth is high",
  "if charge is low or depth_asks is no then depth is low",
]
[[inputs]]
name = "distance"
universe = [0, 5]
terms = { near = { falling = [0.2, 1.5] }, far = { rising = [0.2, 1.5] } }
[[inputs]]
name = "soon"
universe = [0, 10]
terms = { now = { falling = [1, 5] }, later = { rising = [1, 5] } }
[[inputs]]
name = "charge"
universe = [0, 1]
terms = { low = { falling = [0.2, 0.5] }, full = { rising = [0.2, 0.5] } }
[[inputs]]
name = "depth_asks"
universe = [0, 1]
terms = { no = { falling = [0, 1] }, yes = { rising = [0, 1] } }
[[outputs]]
name = "depth"
universe = [0, 1]
terms = { low = { falling = [0, 1] }, high = { rising = [0, 1] } }
[[outputs]]
name = "obstacle"
universe = [0, 1]
terms = { low = { falling = [0, 1] }, high = { rising = [0, 1] } }
"""
SCENARIO = """
base = "depth-transit"
title = "Rules of one's own"
criteria = [{ name = "obstacle" }, { name = "depth" }]
[arbiter]
file = "mine.toml"
[arbiter.inputs]
distance = "clearance.mooring"
soon = "approach_time.mooring"
charge = [[0.0, 1.0], [10.0, 0.6], [20.0, 0.1]]
depth_asks = "membership.depth"
"""


@pytest.fixture
def own(tmp_path):
    (tmp_path / "mine.toml").write_text(RULES)
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    return tmp_path / "scenario.toml"


def test_without_criteria_they_are_the_papers():
    scenario = load_scenario("docking")
    assert scenario.criterion_names == ("obstacle", "shape", "depth") and scenario.has_paper_criteria
    assert scenario.rules.system == Arbiter().system
    assert [signal.kind for signal in scenario.rules.inputs] == ["membership"] * 3
    assert not load_scenario("docking", ["criteria.shape.membership.ramp=0.2"]).has_paper_criteria


def test_four_criteria_are_weighted_by_the_rules_of_section_vi():
    system = load_scenario(FOUR).rules.system
    arbiter = Arbiter([Criterion(name) for name in "abcd"])
    for sample in ([1, 1, 1, 1], [0, 0, 0, 1], [0.2, 0.5, 0.1, 0.9], [0, 0.7, 1, 0.4]):
        assert Arbiter(system)(sample) == arbiter(sample)


def test_criteria_order_sets_priority_and_column_order():
    assert load_scenario(FOUR).criterion_names == ("obstacle", "shape", "depth", "visibility")
    first = load_scenario(FOUR, ["criteria.visibility.order=0"])
    assert first.criterion_names == ("visibility", "obstacle", "shape", "depth")
    assert "criteria.visibility.order = 0" in first.title
    assert [first.criterion_names[i] for i in first.criterion_places] == ["obstacle", "shape", "depth", "visibility"]


def test_default_criterion_colors_are_distinct():
    names = ["obstacle", "a", "b", "depth"]
    criteria = ", ".join(f'{{name = "{name}"}}' for name in names)
    scenario = load_scenario("sitl", [f"criteria=[{criteria}]"])
    colors = [criterion.color for criterion in scenario.criteria]
    assert colors[0] == "#D55E00" and colors[3] == "#56B4E9" and len(set(colors)) == 4


def test_keys_of_the_default_can_be_set():
    scenario = load_scenario("paper", ["criteria.depth.order=0", "criteria.depth.membership.ramp=0.5"])
    assert scenario.criterion_names == ("depth", "obstacle", "shape")
    assert scenario.criteria[0].reasons[0].ramp == 0.5
    no_obstacles = ['criteria=[{name="depth"}]', "regions=[]", "commands.enabled=true", "commands.obstacles=0"]
    assert load_scenario("sitl", no_obstacles).criterion_names == ("depth",)


def test_arbiter_file_is_saved_with_the_scenario(own, tmp_path):
    scenario = load_scenario(own)
    assert scenario.rules.system.outside == "clip"
    assert [output.name for output in scenario.rules.system.outputs] == ["obstacle", "depth"]
    assert [(signal.name, signal.what, signal.unit) for signal in scenario.rules.inputs] == [
        ("distance", "clearance.mooring", "m"), ("soon", "approach_time.mooring", "s"), ("charge", "given", ""),
        ("depth_asks", "membership.depth", ""),
    ]  # fmt: skip
    text = scenario.toml()
    assert tomllib.loads(text)["arbiter"]["file"] == "mine.toml" and tomllib.loads(text)["arbiter"]["text"] == RULES
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "again.toml").write_text(text)
    again = load_scenario(tmp_path / "elsewhere" / "again.toml")
    assert again.rules == scenario.rules and again.toml() == text


def test_clearing_the_arbiter_file_drops_its_inputs(own):
    assert load_scenario(own, ['arbiter.file=""']).rules.system == prioritized(
        [Criterion("obstacle", "exist", "not_exist"), Criterion("depth", "not_maintain", "maintain")]
    )


def test_titles_do_not_quote_the_file(own):
    other = own.parent / "other.toml"
    other.write_text(RULES.replace("1.5", "1.4"))
    inputs = ['arbiter.inputs={distance="speed",soon="time",charge=1,depth_asks="depth"}']
    title = load_scenario(own, [f"arbiter.file={other}", *inputs]).title
    assert "arbiter.file = other.toml" in title and "rules" not in title


@pytest.mark.parametrize("suffix", ["json", "toml", "fcl", "fll", "fis"])
def test_a_file_of_saved_criteria_has_weights_by_their_names(own, suffix):
    path = own.parent / f"saved.{suffix}"
    saved = Arbiter([Criterion("depth"), Criterion("obstacle")])  # in another order than the scenario's
    saved.save(path)
    inputs = '{ depth = "membership.depth", obstacle = "membership.obstacle" }'
    loaded = load_scenario(own, [f"arbiter.file={path}", f"arbiter.inputs={inputs}"])
    weights = Arbiter(loaded.rules.system)([0.25, 1.0])
    assert weights._fields == ("obstacle", "depth")
    assert weights._asdict() == pytest.approx(saved([0.25, 1.0])._asdict(), abs=1e-12)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("arbiter.inputs.distance=foo", "arbiter.inputs.distance is 'foo', expected one of time, depth, speed"),
        ("arbiter.inputs.distance=clearance.mast", "arbiter.inputs.distance is 'clearance.mast', of no region"),
        ("arbiter.inputs.depth_asks=membership.dpth", "of no criterion; did you mean 'depth'?"),
        ("arbiter.inputs.chrge=1", "arbiter.inputs.chrge: mine.toml has no such input; did you mean 'charge'?"),
        ("arbiter.inputs.charge=nan", "arbiter.inputs.charge is nan, expected a signal, a finite number"),
        ("arbiter.inputs.charge=[[0,1],[0,2]]", "arbiter.inputs.charge has the times [0.0, 0.0]"),
        ("arbiter.inputs.charge=[[0,1,2]]", "arbiter.inputs.charge is [[0, 1, 2]], expected a signal"),
        ("arbiter.inputs={}", "arbiter.inputs.distance is missing"),
        ('criteria=[{name="obstacle"},{name="depth"},{name="shape"}]', "mine.toml has no output 'shape'"),
    ],
)
def test_invalid_inputs_and_outputs_are_rejected_by_name(own, change, words):
    with pytest.raises(ScenarioError) as caught:
        load_scenario(own, [change])
    assert words in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("depth is", "deep is", "mine.toml has the output 'deep', no criterion"),
        ("if distance", "if distanc", "arbiter.file: mine.toml: "),
        ("no then depth is low", "no then depth is low with 0.5", "arbiter.engine is 'closed'"),
        ('"range"', '"none"', "output 'obstacle' is of [0, 2], expected weights in [0, 1]"),
        ('  "if distance is far and soon is later then obstacle is low",\n', "", "output 'obstacle' has no default"),
    ],
)  # fmt: skip
def test_invalid_arbiter_files_are_rejected_by_name(own, old, new, words):
    text = RULES.replace(old, new)
    if "deep" in new:
        text = text.replace('name = "depth"', 'name = "deep"')
    if '"none"' in new:
        text = text.replace('name = "obstacle"\nuniverse = [0, 1]', 'name = "obstacle"\nuniverse = [0, 2]')
    (own.parent / "mine.toml").write_text(text)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(own)
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_binary_or_oversized_arbiter_file_is_rejected(own):
    (own.parent / "mine.toml").write_bytes(b"\xff\x00")
    with pytest.raises(ScenarioError, match="is no UTF-8"):
        load_scenario(own)
    (own.parent / "mine.toml").write_text("#" * 200_001)
    with pytest.raises(ScenarioError, match="file too large, expected at most 200000 characters"):
        load_scenario(own)


def test_terms_are_those_of_the_arbiter():
    reasons = load_scenario(FOUR).criteria[3].reasons
    assert [(reason.quantity, reason.term) for reason in reasons] == [("clearance", falling(-0.4, 0.1))]
