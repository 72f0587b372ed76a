"""Runs of every kind of record, made once."""

import json

import pytest

from cosim.run.run import run_scenario
from cosim.scenario.scenario import load_scenario

ORDERS = (
    {"order": "obstacle", "number": 7, "position": [4, 4, 4], "radius": 0.5, "velocity": [0.1, 0, 0]},
    {"order": "aim", "position": [7, 0, 4], "radius": 2.0},
    {"order": "change", "key": "regions.SR1.gain", "value": 900},
    {"order": "change", "key": "regions.SR1.shape.radius", "value": 1.5},
    {"order": "move", "region": "SR2", "by": [0, 1, 0]},
    {"order": "mission", "items": [{"position": [7, 1, 4], "orders": [{"order": "face", "heading": 1.0}]}]},
    {"order": "steer", "mode": "mission"},
    {"order": "sticks", "wrench": [0.1, 0, 0, 0, 0, 0]},
    {"order": "forget", "number": 7},
)


@pytest.fixture(scope="session")
def ordered_run(tmp_path_factory):
    """Return the folder of a run that has taken orders of most kinds."""
    folder = tmp_path_factory.mktemp("ordered")
    lines = [json.dumps({"step": 3 * i, "order": order}) + "\n" for i, order in enumerate(ORDERS)]
    (folder / "orders.jsonl").write_text("".join(lines))
    scenario = load_scenario("paper", ["time.duration=0.1", "commands.enabled=true", "commands.obstacles=2"])
    return run_scenario(scenario, folder / "run", orders=folder / "orders.jsonl", report=False).folder
