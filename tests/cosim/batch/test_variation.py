"""Variations by values equal those by file; invalid keys and values are rejected by name."""

import pickle

import pytest

from cosim.batch.variation import Variation
from cosim.errors import ScenarioError
from cosim.scenario.scenario import load_scenario

KEYS = (
    "initial.position.1", "regions.SR1.gain", "regions.0.shape.center.0", "goal.center.2", "law.gains.k_p1",
    "plant.parameters.weight", "plant.parameters.r_B.z", "limit.force", "time.duration",
)  # fmt: skip
VALUES = (0.1, 50.0, 2.1, 5.0, 10.0, 1230.0, 0.01, 200.0, 30.0)


@pytest.fixture(scope="module")
def paper():
    return load_scenario("paper-limited")


def test_varied_values_equal_overrides_of_the_file(paper, tmp_path):
    variation = pickle.loads(pickle.dumps(Variation(paper, KEYS)))
    made = variation.scenario(VALUES, 7)
    file = tmp_path / "base.toml"
    overrides = [f"{key}={value!r}" for key, value in zip(KEYS, VALUES, strict=True)]
    overrides += ["sensing.seed=7", "plant.parameters.seed=7"]
    file.write_text(paper.toml())
    assert made.table == load_scenario(file, overrides).table | {
        "changed": tuple(key for key in KEYS if key != "goal.center.2")  # which has that value already
    }
    assert made.initial.position[1] == 0.1 and made.plant.parameters["r_B.z"] == 0.01 and made.steps == 30_000
    assert made.sensing.seed == 7 and made.plant.parameters["seed"] == 7
    assert paper.initial.position[1] == 0.0, "the base stays as it is"


def test_varied_seed_overrides_the_row_seed(paper):
    made = Variation(paper, ["sensing.seed"]).scenario([5.0], 7)
    assert made.sensing.seed == 5 and isinstance(made.sensing.seed, int)
    assert made.plant.parameters["seed"] == 7


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("initial.posi.0", "unknown: 'posi'; did you mean 'position'"),
        ("initial.position.3", "unknown: '3'; expected one of 0, 1, 2"),
        ("regions.SR9.gain", "did you mean 'SR"),
        ("limit.force.x", "'x'"),
        ("title", "expected a number"),
        ("record.lyapunov", "False, expected a number"),
        ("initial.position", "expected a number"),
        ("plant.parameters.weigh", "did you mean 'weight'"),
        ("", "unknown"),
    ],
)
def test_non_numeric_key_is_rejected_by_name(paper, key, words):
    with pytest.raises(ScenarioError, match=words):
        Variation(paper, [key])


def test_duplicate_keys_are_rejected(paper):
    with pytest.raises(ScenarioError, match="twice"):
        Variation(paper, ["limit.force", "limit.force"])


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("limit.force", -1.0, "limit.force is -1.0, expected"),
        ("goal.radius", 0.0, "radius"),
        ("law.gains.gamma", 0.0, "gamma"),
        ("time.duration", 0.0105, "time.duration is 0.0105"),
        ("sensing.seed", 1.5, "sensing.seed is 1.5, expected a whole number"),
        ("initial.position.0", float("nan"), "initial.position"),
    ],
)
def test_invalid_value_is_rejected_by_name(paper, key, value, words):
    with pytest.raises(ScenarioError, match=words):
        Variation(paper, [key]).scenario([value], 0)


def test_integer_shape_parameters_accept_fractions(paper):
    whole = load_scenario("paper-limited", ["goal.radius=1", "regions.SR1.shape.center=[2, 0, 2]"])
    made = Variation(whole, ["goal.radius", "regions.SR1.shape.center.1"]).scenario([0.5, 0.25], 0)
    assert made.goal.radius == 0.5 and made.regions[0].region.shape.center == (2.0, 0.25, 2.0)
