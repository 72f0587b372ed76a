"""Logs that others wrote, and their import."""

import copy
import functools
import tomllib
from pathlib import Path

import pytest
import tomli_w

import cosim
import plant_fmu
from cosim.errors import CosimError
from cosim.logs.spool import LogContents
from cosim.results.log_facts import load_log_facts

LOGS = Path(__file__).parents[2] / "data" / "logs"


@pytest.fixture
def contents(tmp_path):
    (tmp_path / "samples").mkdir()
    return LogContents(tmp_path / "samples")


@pytest.fixture
def imported(tmp_path):
    """Import a log as the run ``run`` of a test."""

    def imported(path, vehicle="bluerov2_heavy", **options):
        return cosim.import_log(path, vehicle, tmp_path / "run", **{"report": False, "overwrite": True} | options)

    return imported


@pytest.fixture
def refused(imported, tmp_path):
    """Check that a log is refused by one line, and that no run is left."""

    def refused(what, path, *arguments, **options):
        with pytest.raises(CosimError, match=what) as caught:
            imported(path, *arguments, **options)
        assert "\n" not in str(caught.value) and Path(path).name in str(caught.value)
        assert not (tmp_path / "run").exists()

    return refused


def changed(table, key, value):
    """Return a column map's text with a value at a dotted key, or without the key for None."""
    table = copy.deepcopy(table)
    *path, last = key.split(".")
    inner = functools.reduce(dict.__getitem__, path, table)
    inner |= {last: value}
    if value is None:
        del inner[last]
    return tomli_w.dumps(table)


def facts_by_quantity(run):
    return {topic.quantity: topic for topic in load_log_facts(run.folder).topics}


def has_remark(run, text):
    return any(text in remark for remark in load_log_facts(run.folder).remarks)


@pytest.fixture(scope="session")
def six_thrusters(tmp_path_factory):
    """The file of a vehicle of ArduSub's frame ``vectored``: the heavy one with two vertical thrusters less."""
    table = tomllib.loads((Path(plant_fmu.__file__).parent / "vehicles" / "bluerov2_heavy.toml").read_text())
    table["name"], table["autopilot"]["frame"] = "bluerov2", "vectored"
    table["thrusters"]["matrix"] = [row[:6] for row in table["thrusters"]["matrix"]]
    path = tmp_path_factory.mktemp("vehicle") / "bluerov2.toml"
    path.write_text(tomli_w.dumps(table))
    return path
