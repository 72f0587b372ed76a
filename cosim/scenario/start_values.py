"""Parameters and start values of the FMU in a scenario."""

from __future__ import annotations

import numpy as np

from cosim.scenario.scenario import Scenario
from cosim.scenario.sensor_suite import scenario_sensors


def start_values(scenario: Scenario) -> dict[str, float]:
    """Return the parameters and start values that the FMU gets before initialization."""
    initial, plant, limit = scenario.initial, scenario.plant, scenario.limit
    values = {"substep": plant.substep, "wrench_time_constant": limit.time_constant}
    if limit.force < np.inf:
        values["wrench_force_limit"] = limit.force
    for prefix, names, numbers in (
        ("current", "xyz", plant.current),
        ("position", "xyz", initial.position),
        ("quaternion", ("e0", "e1", "e2", "e3"), initial.quaternion),
        ("velocity", "uvwpqr", initial.velocity),
    ):
        values |= {f"{prefix}.{name}": number for name, number in zip(names, numbers, strict=True)}
    return values | scenario_sensors(scenario) | plant.parameters
