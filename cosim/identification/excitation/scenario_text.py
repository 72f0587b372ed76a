"""The scenario in which a schedule of stick inputs is flown."""

from __future__ import annotations

import json
from pathlib import Path

from cosim.scenario.scenario import Scenario, load_scenario
from plant_fmu.archive import temporary_folder

ROW = 0.05  # s, period of the record's rows and of the law

_TEXT = """# Stick inputs made by cosim identify --excite; between segments the law brings the vehicle back.
title = "Excitation of {name}"
vehicle = {vehicle}

[time]
duration = {duration:g}      # s
step = {row:g}

[initial]
position = [0.0, 0.0, {depth:g}]  # m: the center of the box

[goal]
type = "sphere"
centre = [0.0, 0.0, {depth:g}]
radius = 0.3

[law]
name = "deployable"

[actuation]
through = "thrusters"

[commands]
enabled = true
pilot_gain = 1.0        # sticks are parts of the greatest wrench
"""


def scenario_text(vehicle: str, depth: float, duration: float, name: str) -> str:
    """Return the TOML text of the scenario; depth [m], duration [s]."""
    return _TEXT.format(name=name, vehicle=json.dumps(vehicle), duration=duration, depth=depth, row=ROW)


def load(text: str, vehicle: str) -> Scenario:
    """Load a scenario from its text, by a temporary file."""
    path = str(Path(vehicle).resolve()) if vehicle.endswith(".toml") else vehicle
    with temporary_folder("excite-") as folder:
        file = folder / "excite.toml"
        file.write_text(text.replace(json.dumps(vehicle), json.dumps(path), 1))
        return load_scenario(file)
