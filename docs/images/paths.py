"""Runs the scenarios whose paths are in the README, and puts those figures of their reports where it is run."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from cosim.run.run_folder import report_again
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

PATHS = {"path-plane.png": "paper", "path-deployable.png": "paper-deployable"}


def main() -> None:
    """Draw both."""
    with tempfile.TemporaryDirectory() as scratch:
        for picture, name in PATHS.items():
            scenario = load_scenario(name, ["arbiter.engine=closed"])
            folder = run_scenario(scenario, Path(scratch) / name, report=False).folder
            report_again(folder, ("png",))
            shutil.copyfile(folder / "figures" / "path-plane.png", picture)
