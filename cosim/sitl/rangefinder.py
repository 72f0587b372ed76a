"""A rangefinder that looks down the body's vertical axis, on the plant's bottom or on the scenario's hard regions."""

from __future__ import annotations

import math

import numpy as np

from controller.compiling.function import CompiledFunction
from controller.quaternion import rotation_matrix
from controller.regions import pack
from controller.regions.rays import ray_distances
from controller.regions.region_set import of_attitude
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

MAX_RANGE = 100.0  # m, also the output when the beam meets nothing
_LEVEL = 0.1  # cosine of the tilt, below which the beam does not meet a flat bottom


class Rangefinder:
    """Measure the distance to the bottom, or to the nearest hard region, along the body's vertical axis."""

    def __init__(self, scenario: Scenario) -> None:
        self._has_bottom = "bottom_depth" in scenario.plant.parameters
        hard = [
            secondary.region for secondary in scenario.regions if secondary.region.hard and not secondary.is_dynamic
        ]
        met = [] if self._has_bottom else [region for region in hard if not of_attitude(region.shape)]
        self.is_fitted = self._has_bottom or bool(met)
        self._regions = pack(met)
        self._distances, self._beam = np.zeros(1), np.zeros((1, 3))
        self._ray_distances = CompiledFunction(ray_distances)

    def measure(self, position_ned: Array, quaternion: Array, altitude: float) -> float:
        """Return the distance along the body's vertical axis [m], `MAX_RANGE` at the most; 0 inside a region."""
        # Units of arguments: position_ned [m, NED]
        self._beam[0] = rotation_matrix(quaternion)[:, 2]
        if self._has_bottom:
            down = float(self._beam[0, 2])
            return min(altitude / down, MAX_RANGE) if down > _LEVEL or math.isnan(down) else MAX_RANGE
        self._ray_distances(self._regions, position_ned, self._beam, MAX_RANGE, self._distances)
        return min(float(self._distances[0]), MAX_RANGE)
