"""Runs of every kind of record, made once."""

import json

import pytest

from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

COMMANDS_LOG = (
    {"command": "add_obstacle", "number": 7, "position": [4, 4, 4], "radius": 0.5, "velocity": [0.1, 0, 0]},
    {"command": "set_target", "position": [7, 0, 4], "radius": 2.0},
    {"command": "change_setting", "key": "regions.SR1.gain", "value": 900},
    {"command": "change_setting", "key": "regions.SR1.shape.radius", "value": 1.5},
    {"command": "shift_region", "region": "SR2", "by": [0, 1, 0]},
    {
        "command": "set_mission",
        "items": [{"position": [7, 1, 4], "commands": [{"command": "set_heading", "heading": 1.0}]}],
    },
    {"command": "set_mode", "mode": "mission"},
    {"command": "manual_control", "wrench": [0.1, 0, 0, 0, 0, 0]},
    {"command": "remove_obstacle", "number": 7},
)


@pytest.fixture(scope="session")
def ordered_run(tmp_path_factory):
    """Return the folder of a run that has taken commands of most kinds."""
    folder = tmp_path_factory.mktemp("commanded")
    lines = [json.dumps({"step": 3 * i, "command": command}) + "\n" for i, command in enumerate(COMMANDS_LOG)]
    (folder / "commands.jsonl").write_text("".join(lines))
    scenario = load_scenario("paper", ["time.duration=0.1", "commands.enabled=true", "commands.obstacles=2"])
    return run_scenario(scenario, folder / "run", commands_log=folder / "commands.jsonl", report=False).folder
