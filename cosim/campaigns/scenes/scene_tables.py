"""Tables that generated scenes with a scenario of their own share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from plant_fmu.vehicle import Vehicle

Generator = np.random.Generator
Table = dict[str, Any]


def scenario_table(
    title: str,
    seed: int,
    vehicle: Vehicle,
    duration: float,  # s
    current: list[float],  # m/s, NED
    parameters: dict[str, float],
    start: list[float],
    goal: Table,
    regions: list[Table],
) -> Table:
    """Make the scenario of a scene; `goal` has the table of the goal, and perhaps further tables."""
    return {
        "title": title,
        "vehicle": vehicle.name,
        "time": {"duration": duration, "step": 0.01, "control": 0.02, "arbiter": 0.02},
        "plant": {"current": current, "substep": 0.01, "parameters": parameters},
        "initial": {"position": start},
        **goal,
        "actuation": {"through": "thrusters"},
        "sensing": {"position_noise": 0.02, "velocity_noise": 0.01, "seed": seed},
        "regions": regions,
    }


def horizontal(heading: float, speed: float) -> list[float]:
    """Return a horizontal velocity [m/s, NED]."""
    return [float(speed * np.cos(heading)), float(speed * np.sin(heading)), 0.0]


def each_thruster(vehicle: Vehicle, name: str, values: object) -> dict[str, float]:
    """Return a parameter of each thruster, with one value for all or with one each."""
    spread = np.broadcast_to(values, vehicle.n_thrusters)  # type: ignore[call-overload]
    return {f"{name}[{j + 1}]": float(x) for j, x in enumerate(spread)}


def thruster_lags(vehicle: Vehicle, lags: object) -> dict[str, float]:
    """Return the parameters for lags of the thrusters [s]."""
    return each_thruster(vehicle, "thrust_time_constant", lags)


def sphere_table(center: Iterable[float], radius: float) -> Table:
    """Return the table of a sphere [m]."""
    return {"type": "sphere", "center": [float(x) for x in center], "radius": float(radius)}
