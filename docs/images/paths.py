"""Runs the scenarios whose paths are in the README, and puts those figures of their reports where it is run."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from cosim.run import run_scenario
from cosim.scenario import load_scenario

PATHS = {"path-plane.png": "paper", "path-deployable.png": "paper-deployable"}


def main() -> None:
    """Draw both."""
    with tempfile.TemporaryDirectory() as scratch:
        for picture, name in PATHS.items():
            folder = run_scenario(load_scenario(name, ["arbiter.engine=closed"]), Path(scratch) / name).folder
            shutil.copyfile(folder / "figures" / "path-plane.png", picture)
