"""Former names of keys: read wherever a user gives keys, with one line."""

import dataclasses
import json

import pytest

from controller.errors import RegionError
from controller.regions import Box, Ellipsoid, Sphere
from cosim import load_scenario
from cosim.batch.variation import Variation
from cosim.errors import ScenarioError
from cosim.scenario import toml_file
from cosim.scenario.key_names import key_name
from cosim.scenario.scenario import validate_scenario
from cosim.simulation.commands.settings import LiveSettings

FORMER = """base = "docking"
[goal]
centre = [7.0, 0.0, 4.0]
[[criteria]]
name = "obstacle"
[[criteria]]
name = "shape"
colour = "#112233"
"""


@pytest.fixture(autouse=True)
def _unlogged():
    toml_file._log_former_name.cache_clear()


def logged(caplog):
    return [record.getMessage() for record in caplog.records]


def former(table):
    """Return a scenario's table as earlier versions wrote it."""
    return json.loads(json.dumps(table).replace('"center"', '"centre"').replace('"color"', '"colour"'))


def test_former_keys_of_files_and_changes_are_read_with_one_line_each(tmp_path, caplog):
    file = tmp_path / "former.toml"
    file.write_text(FORMER)
    scenario = load_scenario(
        file, ["goal.centre.2=3.5", 'criteria.shape.colour="#445566"', "regions.floor.shape.centre.2=5.0"]
    )
    assert scenario.goal.center == (7.0, 0.0, 3.5) and scenario.criteria[1].color == "#445566"
    assert scenario.title.count("goal.center = (7, 0, 3.5) m") == 1
    assert sorted(logged(caplog)) == ["key centre is now center", "key colour is now color"]


def test_tables_of_earlier_versions_are_read_whole(caplog):
    scenario = load_scenario("dense-field", ["goal.center.1=0.5"])
    table = former(scenario.table) | {"changed": ["goal.centre.1"]}
    before = json.dumps(table)
    again = validate_scenario(table, scenario.name, scenario.vehicle)
    assert again.table == scenario.table and again.title == scenario.title
    assert json.dumps(table) == before  # the caller's
    assert logged(caplog) == ["key centre is now center", "key colour is now color"]


def test_varied_keys_and_settings_are_known_by_their_former_names():
    scenario = load_scenario("harbour")
    variation = Variation(scenario, ["goal.centre.1"])
    assert "goal.center.1 = 0.5 m" in variation.scenario([0.5], 0).title
    assert key_name("goal.centre.1", scenario.table, scenario.vehicle).unit == "m"
    with pytest.raises(ScenarioError, match=r"'goal\.center\.1' comes twice"):
        Variation(scenario, ["goal.centre.1", "goal.center.1"])
    settings = LiveSettings(scenario)
    settings.change("goal.centre.0", 9.0)
    assert settings.shapes["goal"].center[0] == 9.0 and settings.region_of("goal.centre.0") == "goal"


def test_both_names_at_once_are_refused_where_they_are(tmp_path):
    file = tmp_path / "both.toml"
    file.write_text(FORMER.replace("centre", "center = [0.0, 0.0, 0.0]\ncentre"))
    with pytest.raises(ScenarioError, match="goal: pass either center or centre"):
        load_scenario(file)


SHAPES = [(Sphere, {"radius": 1.0}), (Box, {"size": (1.0, 1.0, 1.0)}), (Ellipsoid, {"semi_axes": (1.0, 1.0, 1.0)})]


@pytest.mark.parametrize(("shape", "size"), SHAPES)
def test_shapes_accept_the_former_argument(shape, size):
    with pytest.warns(DeprecationWarning, match="centre is now center"):
        made = shape(centre=(1.0, 2.0, 3.0), **size)
    assert made == shape((1.0, 2.0, 3.0), **size) and made.centre == made.center
    with pytest.raises(RegionError, match="pass either center or centre"):
        dataclasses.replace(made, centre=(0.0, 0.0, 0.0))
