"""Keys by their former names: read, with one line each."""

import pytest

from controller.errors import RegionError
from controller.regions import Box, Ellipsoid, Sphere
from cosim import load_scenario
from cosim.errors import ScenarioError

FORMER = """base = "docking"
[goal]
centre = [7.0, 0.0, 4.0]
[[criteria]]
name = "obstacle"
[[criteria]]
name = "shape"
colour = "#112233"
"""


def test_former_keys_are_read_and_named(tmp_path, caplog):
    file = tmp_path / "former.toml"
    file.write_text(FORMER)
    scenario = load_scenario(file, ["goal.centre.2=3.5", 'criteria.shape.colour="#445566"'])
    assert scenario.goal.center == (7.0, 0.0, 3.5) and scenario.criteria[1].color == "#445566"
    assert [record.getMessage() for record in caplog.records] == ["key centre is now center", "key colour is now color"]
    file.write_text(FORMER.replace("centre", "center = [0.0, 0.0, 0.0]\ncentre"))
    with pytest.raises(ScenarioError, match="pass either center or centre"):
        load_scenario(file)


@pytest.mark.parametrize(
    ("shape", "size"),
    [(Sphere, {"radius": 1.0}), (Box, {"size": (1.0, 1.0, 1.0)}), (Ellipsoid, {"semi_axes": (1.0, 1.0, 1.0)})],
)
def test_shapes_accept_the_former_argument(shape, size):
    with pytest.warns(DeprecationWarning, match="centre is now center"):
        former = shape(centre=(1.0, 2.0, 3.0), **size)
    assert former == shape((1.0, 2.0, 3.0), **size) and former.centre == former.center
    with pytest.raises(RegionError, match="centre"):
        shape(center=(0.0, 0.0, 0.0), centre=(0.0, 0.0, 0.0), **size)
