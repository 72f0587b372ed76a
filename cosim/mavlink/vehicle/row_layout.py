"""Column indices of the quantities in a row of the run, and the initial row."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from controller.regions.region_set import shape_center
from cosim.scenario.region_tables import Vector3
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import start_values
from cosim.simulation.commands.commands import MODES
from cosim.simulation.signals import Array, Column
from plant_fmu.variables import variables


class RowLayout:
    """Column indices of the quantities in a row."""

    def __init__(self, scenario: Scenario, columns: Sequence[Column]) -> None:
        self.index = {column.name: i for i, column in enumerate(columns)}
        self.length = len(columns)
        self.thrusters = scenario.vehicle.n_thrusters
        self.criteria = scenario.criterion_names
        self.regions = tuple(region.region.name for region in scenario.regions)
        self.reports = tuple(column.name for column in columns if column.name.startswith("law."))
        self.goal_center = shape_center(scenario.goal)
        self.saturations = tuple(
            i for name, i in self.index.items() if name.endswith("saturated") or name.startswith("thrust_saturated[")
        )

    def make_first_row(self, scenario: Scenario) -> Array:
        """Return the row before the first step: start values of the plant's variables, 0 elsewhere; returns (n,)."""
        starts = {v.name: v.start for v in variables(scenario.vehicle)} | start_values(scenario)
        euler, depth = quaternion_to_euler(scenario.initial.quaternion), scenario.initial.position[2]
        altitude = float(scenario.plant.parameters.get("bottom_depth", math.inf)) - depth
        starts |= {
            **dict(zip(("attitude.roll", "attitude.pitch", "attitude.yaw"), euler, strict=True)),
            "measured.depth": depth, "measured.heading": euler[2], "measured.acceleration.z": -9.81,
            "altitude": altitude, "measured.altitude": altitude,
            "commands.armed": float(not scenario.commands.await_arm), "commands.mode": float(MODES.index("reach")),
            "commands.item": -1.0,
            **dict(zip(("target.x", "target.y", "target.z"), self.goal_center, strict=True)),
        }  # fmt: skip
        return np.array([starts.get(name, 0.0) for name in self.index])


def quaternion_to_euler(quaternion: Sequence[float]) -> Vector3:
    """Return roll, pitch and yaw [rad] of a unit quaternion from body to world, scalar first."""
    w, x, y, z = quaternion
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, math.asin(sine), yaw
