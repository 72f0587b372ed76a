"""Column indices of the quantities in a row of the run, and the initial row."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cosim.scenario.region_tables import Vector3
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import MODES
from cosim.simulation.environment import shape_center
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
        starts = {v.name: v.start for v in variables(scenario.vehicle)}
        row = np.array([starts.get(name, 0.0) for name in self.index])
        initial, commands = scenario.initial, scenario.commands
        euler = quaternion_to_euler(initial.quaternion)
        depth = initial.position[2]
        values: dict[str, Sequence[float]] = {  # by the first of their columns
            "position.x": initial.position,
            "quaternion.e0": initial.quaternion,
            "velocity.u": initial.velocity,
            "attitude.roll": euler,
            "measured.depth": (depth,),
            "measured.heading": (euler[2],),
            "measured.acceleration.z": (-9.81,),
            "altitude": (_bottom(scenario) - depth,),
            "measured.altitude": (_bottom(scenario) - depth,),
            "commands.armed": (float(not commands.await_arm),),
            "commands.mode": (float(MODES.index("reach")),),
            "commands.item": (-1.0,),
            "target.x": self.goal_center,
        }
        for first, numbers in values.items():
            if first in self.index:
                row[self.index[first] : self.index[first] + len(numbers)] = numbers
        return row


def quaternion_to_euler(quaternion: Sequence[float]) -> Vector3:
    """Return roll, pitch and yaw [rad] of a unit quaternion from body to world, scalar first."""
    w, x, y, z = quaternion
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, math.asin(sine), yaw


def _bottom(scenario: Scenario) -> float:
    return float(scenario.plant.parameters.get("bottom_depth", math.inf))
