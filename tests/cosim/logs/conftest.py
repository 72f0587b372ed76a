"""Logs that others wrote, and what reads them here."""

from pathlib import Path

import pytest

from cosim.logs.spool import LogContents
from plant_fmu import load_vehicle

LOGS = Path(__file__).parents[2] / "data" / "logs"


@pytest.fixture
def contents(tmp_path):
    folder = tmp_path / "samples"
    folder.mkdir()
    return LogContents(folder)


@pytest.fixture(scope="session")
def six_thrusters(tmp_path_factory):
    """The file of a vehicle of ArduSub's frame ``vectored``: the heavy one with two vertical thrusters less."""
    import tomllib

    import tomli_w

    import plant_fmu

    table = tomllib.loads((Path(plant_fmu.__file__).parent / "vehicles" / "bluerov2_heavy.toml").read_text())
    table["name"], table["autopilot"]["frame"] = "bluerov2", "vectored"
    table["thrusters"]["matrix"] = [row[:6] for row in table["thrusters"]["matrix"]]
    path = tmp_path_factory.mktemp("vehicle") / "bluerov2.toml"
    path.write_text(tomli_w.dumps(table))
    assert load_vehicle(path).n_thrusters == 6
    return path
