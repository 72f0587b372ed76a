"""Labels of scenario keys with the units of the documents."""

import re
from pathlib import Path

import pytest

from cosim.batch.outcome import FIELDS
from cosim.campaigns.pages.sections import LABELS
from cosim.scenario.changes import value_at
from cosim.scenario.key_names import key_name
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios

DOCUMENT = Path(__file__).parents[3] / "docs" / "scenarios.md"


def label(key, name="paper-limited", overrides=()):
    scenario = load_scenario(name, overrides)
    value_at(scenario.table, key, scenario.vehicle)  # there is such a key
    return key_name(key, scenario.table, scenario.vehicle).label


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("initial.position.1", "start position y [m]"), ("initial.position", "start position [m]"),
        ("initial.velocity.1", "start velocity v [m/s]"), ("initial.velocity.5", "start velocity r [rad/s]"),
        ("initial.quaternion.0", "start attitude, quaternion w"), ("plant.current.2", "current z [m/s]"),
        ("limit.force", "force limit [N]"), ("law.gains.k_p1", "gain k_p1 [N/m3]"),
        ("regions.SR1.gain", "gain of SR1"), ("regions.0.velocity.2", "velocity z of SR1 [m/s]"),
        ("regions.SR1.shape.center.0", "center x of SR1 [m]"), ("regions.SR3.shape.tolerance", "tolerance of SR3 [m]"),
        ("criteria.depth.order", "order of depth"), ("goal.radius", "radius of the goal [m]"),
        ("goal.center.2", "center z of the goal [m]"), ("plant.parameters.weight", "weight of the plant [N]"),
        ("plant.parameters.inertia.xz", "inertia.xz of the plant [kg m2]"), ("time.duration", "duration [s]"),
        ("arbiter.engine", "arbiter engine"), ("regions", "regions"),
    ],
)  # fmt: skip
def test_keys_have_readable_labels(key, words):
    assert label(key) == words


def test_keys_of_other_shapes_have_readable_labels():
    assert label("regions.heading.shape.tolerance", "docking") == "tolerance of heading [rad]"
    assert label("regions.port wall.shape.size.1", "docking") == "size y of port wall [m]"
    assert label("failures.0.time", "dense-field") == "time of failure 0 [s]"
    prism = ['goal={type="prism",corners=[[0,0],[9,0],[9,9]],top=1.0,bottom=2.0}']
    assert label("goal.corners.1.0", overrides=prism) == "corner 1 x of the goal [m]"


@pytest.mark.parametrize("name", list_scenarios())
def test_every_scenario_key_has_a_label(name):
    scenario = load_scenario(name)
    for key in keys_of(scenario.table):
        words = key_name(key, scenario.table, scenario.vehicle).words
        assert words and ("_" not in words or key.startswith(("law.gains.", "plant.parameters."))), key


def keys_of(value, path=""):
    """Yield the key of each number, text and list of these."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    for key, item in items:
        yield from keys_of(item, f"{path}.{key}" if path else key)
    if path:
        yield path


def test_units_are_those_of_the_document():
    docking, mission = load_scenario("docking", ["commands.enabled=true"]), load_scenario("pile-inspection")
    asked = 0
    for keys, unit in re.findall(r"^\| (`[^|]*) \| ([^|]*) \|", DOCUMENT.read_text(), re.M):
        for key in re.findall(r"`([a-z_.\[\]]+)`", keys):
            scenario = mission if key.startswith("goal.then[]") else docking
            key = key.replace("then[]", "then.0").replace("[]", ".heading")
            if "." in key and unit.strip() and not key.endswith("streamed"):
                assert key_name(key, scenario.table, scenario.vehicle).unit == unit.strip(), key
                asked += 1
    assert asked > 20


def test_outcome_labels_match_column_units():
    for name, (_, unit, _) in FIELDS.items():
        told = LABELS[name].partition(" [")[2].removesuffix("]")
        assert told == unit.replace(".", " ")
