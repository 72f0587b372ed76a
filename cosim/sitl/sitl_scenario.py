"""The scenario that an autopilot flies: any scenario, with the autopilot's step, and the autopilot as its law."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from cosim.errors import RunError
from cosim.scenario.scenario import Scenario, load_scenario
from cosim.scenario.validation import MAX_STEPS

SCENARIO = "sitl"  # default scenario
MIN_RATE, MAX_RATE = 11, 65535  # Hz: an autopilot's frame is shorter than 0.1 s, and a packet holds 16 bits


def scenario_to_fly(
    name_or_file: str | Path, overrides: Sequence[str], vehicle: str | None, frame_rate: int, autopilot: str
) -> Scenario:
    """Load a scenario for an autopilot to fly.

    Parameters
    ----------
    name_or_file : str or Path
        Name of a shipped scenario, or a TOML file.
    overrides : sequence of str
        Changes such as ``plant.current.0=0.2``, as for `load_scenario`.
    vehicle : str or None
        Name of a shipped vehicle, or a TOML file; None for the scenario's.
    frame_rate : int
        Frame rate of the autopilot [Hz], `MIN_RATE` to `MAX_RATE`.
    autopilot : str
        Name of the autopilot, used as the law's name in summary and report, such as ``ardupilot``.

    Returns
    -------
    Scenario
        Scenario with thrusters, whose step and control period are the autopilot's frame. Duration and the arbiter's
        period are rounded to multiples of it; the number of steps is limited to `MAX_STEPS`.

    Raises
    ------
    ScenarioError
        If the scenario is invalid, as for `load_scenario`.
    RunError
        If the scenario accepts commands or records V, which needs a law of this package.
    """
    changes = [*overrides, "actuation.through=thrusters"]
    if vehicle is not None:
        changes.append(f"vehicle='{vehicle}'")
    base = load_scenario(name_or_file, changes)
    for key, value in (("commands.enabled", base.commands.enabled), ("record.lyapunov", base.record.lyapunov)):
        if value:
            raise RunError(f"{name_or_file}: {key} is true, expected false: the autopilot steers")
    step = 1.0 / frame_rate
    for key, period in (("duration", base.time.duration), ("arbiter", base.time.arbiter), ("control", step)):
        changes.append(f"time.{key}={min(max(1, round(period * frame_rate)), MAX_STEPS) * step!r}")
    scenario = load_scenario(name_or_file, [*changes, f"time.step={step!r}"])
    table = scenario.table | {"changed": base.table["changed"]}  # its steps are the autopilot's, which the title names
    return dataclasses.replace(scenario, law=dataclasses.replace(scenario.law, name=autopilot), table=table)
