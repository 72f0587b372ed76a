"""Runs the scenario that the tutorial lets its reader write, and puts the path in space where it is run."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

from cosim.run.run_folder import report_again
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

PAGE = Path(__file__).parents[1] / "tutorial.md"


def main() -> None:
    """Draw it."""
    (written,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "mine.toml"
        file.write_text(written, encoding="utf-8")
        folder = run_scenario(load_scenario(file), Path(scratch) / "run", report=False).folder
        report_again(folder, ("png",))
        shutil.copyfile(folder / "figures" / "path-3d.png", "tutorial-pillar.png")
