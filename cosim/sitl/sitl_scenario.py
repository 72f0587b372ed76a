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
    """Load a scenario for an autopilot to fly; frame_rate [Hz]."""
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
