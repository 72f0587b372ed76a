"""Compiling ahead of runs what the first of them would wait for: laws, regions, the fused loop; building the FMU."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.errors import RunError
from cosim.run.run import run_scenario
from cosim.scenario.scenario import load_scenario

_STEPS = 2


def compile_ahead(scenario: str, overrides: Sequence[str] = ()) -> None:
    """Compile what a scenario's runs need, and keep it on disk.

    Parameters
    ----------
    scenario : str
        A shipped name, or a TOML file.
    overrides : sequence of str
        As ``KEY=VALUE``.

    Raises
    ------
    ScenarioError
        If there is no such scenario, or a key is wrong.
    BuildError, PlantError
        If there is no FMU of the vehicle.
    """
    whole = load_scenario(scenario, overrides)
    duration = _STEPS * max(whole.time.step, whole.time.control, whole.time.arbiter)
    short = load_scenario(scenario, [*overrides, "arbiter.engine=closed", f"time.duration={duration}"])
    with tempfile.TemporaryDirectory() as folder:
        run_scenario(short, Path(folder, "run"), report=False)
    with contextlib.suppress(RunError):  # what the loop cannot fly needs none
        variation = Variation(short, ())
        with FusedFlyer(variation) as flyer:
            flyer.fly_one(variation.scenario([], 0))
