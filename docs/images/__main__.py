"""Draws all pictures of the documents anew: ``python docs/images``, or some: ``python docs/images arbiter fmu``."""

from __future__ import annotations

import contextlib
import runpy
import shutil
import sys
import tempfile
from pathlib import Path

import arbiter
import architecture
import criteria
import fmu
import pages
import paths
import pool
import tutorial

HERE = Path(__file__).parent


def reference() -> None:
    """Draw the FMU beside its reference, by the example that compares them."""
    example = HERE.parents[1] / "examples" / "fmu_reference.py"
    with tempfile.TemporaryDirectory() as scratch:
        with contextlib.chdir(scratch):
            runpy.run_path(str(example), run_name="__main__")
        shutil.copyfile(Path(scratch) / "fmu-reference.png", "fmu-reference.png")


MAKERS = {
    "arbiter": arbiter.main,
    "architecture": architecture.main,
    "criteria": criteria.main,
    "fmu": fmu.main,
    "pages": pages.main,
    "paths": paths.main,
    "pool": pool.main,
    "reference": reference,
    "tutorial": tutorial.main,
}

if __name__ == "__main__":
    with contextlib.chdir(HERE):
        for maker in sys.argv[1:] or MAKERS:
            MAKERS[maker]()
