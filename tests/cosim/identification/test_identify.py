"""The command: from a run of another plant than the start's to a file that builds, and its page."""

import json
import math
import re

import pytest

from cosim import import_log
from cosim.command_line.cli import main
from plant_fmu import Plant, load_vehicle
from tests.cosim.logs.conftest import LOGS

TRUTH = {"quadratic_damping[1]": 100.0, "buoyancy": 130.5}
SCENARIO = """
vehicle = "bluerov2_heavy"
time = { duration = 26.0, step = 0.01, control = 0.05 }
initial = { position = [0.0, 0.0, 3.0] }
goal = { type = "sphere", center = [0.0, 0.0, 3.0], radius = 5.0 }
law = { name = "pd" }
actuation = { through = "thrusters" }
commands = { enabled = true }
plant = { parameters = { "quadratic_damping[1]" = 100.0, "buoyancy" = 130.5 } }
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    (folder / "pool.toml").write_text(SCENARIO)
    lines = [{"step": 0, "command": {"command": "set_mode", "mode": "depth_hold"}}]
    for k in range(0, 2600, 10):
        sticks = [0.6 * math.sin(0.02 * k), 0.0, 0.8 * math.sin(0.007 * k), 0.0, 0.0, 0.1 * math.sin(0.01 * k)]
        lines.append({"step": k, "command": {"command": "manual_control", "wrench": sticks}})
    (folder / "sticks.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    arguments = ["--replay-commands", str(folder / "sticks.jsonl"), "--no-report", "--out", str(folder / "run"), "-q"]
    assert main(["run", str(folder / "pool.toml"), *arguments]) == 0
    return folder / "run"


@pytest.mark.slow
def test_identified_vehicle_file_builds(run, tmp_path, capsys):
    out = tmp_path / "mine.toml"
    free = ["hydrodynamics.quadratic_damping.1", "hydrostatics.buoyancy", "hydrodynamics.added_mass.4.4"]
    arguments = ["--vehicle", "bluerov2_heavy", "--nuisance", "current", "--out", str(out)]
    assert main(["identify", str(run), *arguments, "--free", *free]) == 0
    assert "chi² is" in capsys.readouterr().out
    found = load_vehicle(out)
    assert found.name == "mine"
    assert found.quadratic_damping[0] == pytest.approx(100.0, rel=0.02)
    assert found.buoyancy == pytest.approx(130.5, abs=0.02)
    assert found.linear_damping == pytest.approx(load_vehicle("bluerov2_heavy").linear_damping)
    text = out.read_text()
    assert text.startswith("# Identified by cosim identify from run") and " ± " in text
    page = out.with_suffix(".html").read_text()
    assert not re.search(r'(src|href)="https?:', page) and "Hold the start velocity" in page
    with Plant(found) as plant:
        plant.initialize()
        plant.step(0.1)


def test_invalid_vehicle_name_is_rejected_before_the_fit(run, tmp_path, capsys):
    assert main(["identify", str(run), "--vehicle", "odin", "--out", str(tmp_path / "1.toml")]) == 2
    assert "no vehicle's file" in capsys.readouterr().err


@pytest.mark.medium
def test_slow_servo_data_are_named_where_no_window_is_left(tmp_path, capsys):
    """A telemetry log of ArduSub at the surface, with servo outputs at 2 Hz."""
    log = import_log(LOGS / "small.tlog", "bluerov2_heavy", tmp_path / "small", report=False)
    assert main(["identify", str(log.folder), "--vehicle", "bluerov2_heavy", "--out", str(tmp_path / "a.toml")]) == 2
    said = capsys.readouterr().err
    assert "the hull is at the surface" in said and "Servo outputs of small are logged at 2 Hz" in said
    assert "not added mass, lag or delays" in said
    assert not (tmp_path / "a.toml").exists()


def test_unknown_nuisance_is_rejected_by_name(run, tmp_path, capsys):
    arguments = ["--vehicle", "bluerov2_heavy", "--nuisance", "wind", "--out", str(tmp_path / "a.toml")]
    assert main(["identify", str(run), *arguments]) == 2
    assert "--nuisance wind: is unknown" in capsys.readouterr().err
