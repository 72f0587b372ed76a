"""Proximity sensing: present positions of the regions that are obstacles, and a level scan of them."""

from __future__ import annotations

import math

import numpy as np

from controller.compiling.function import CompiledFunction
from controller.regions import pack
from controller.regions.rays import ray_distances
from controller.regions.region_set import RegionEvaluator, of_attitude
from controller.regions.shape import Shape
from cosim.mavlink.vehicle.view import View
from cosim.scenario.region_tables import PARKED_POSITION, SecondaryRegion, Vector3
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.settings import LiveSettings

SECTORS = 72  # number of sectors of a scan
MAX_RANGE = 20.0  # m, range of a scan
_RAYS = 3  # number of rays in a sector: at full range the scan detects anything wider than 0.6 m
_NO_SHIFT, _LEVEL = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)


class Proximity:
    """Obstacles, packed once; an update writes only changes."""

    # The constructor loads libraries, which may take seconds: call it before the simulation.

    def __init__(self, scenario: Scenario) -> None:
        obstacles = [(i, secondary) for i, secondary in enumerate(scenario.regions, 1) if _is_obstacle(secondary)]
        self.ids = tuple(i for i, _ in obstacles)
        self._dynamic = tuple(secondary.is_dynamic for _, secondary in obstacles)
        self._names = tuple(secondary.region.name for _, secondary in obstacles)
        self._shapes: list[Shape] = [secondary.region.shape for _, secondary in obstacles]
        self._shifts: list[Vector3] = [_NO_SHIFT] * len(obstacles)
        self._regions = pack([secondary.region for _, secondary in obstacles])
        self._evaluator = RegionEvaluator(self._regions)
        self._angles = (np.arange(SECTORS * _RAYS) - _RAYS // 2) * (2.0 * math.pi / (SECTORS * _RAYS))
        self._directions, self._distances = np.zeros((SECTORS * _RAYS, 3)), np.zeros(SECTORS * _RAYS)
        self._position = np.zeros(3)
        self._ray_distances = CompiledFunction(ray_distances)
        self.inward_directions(_NO_SHIFT)
        self.scan(_NO_SHIFT, 0.0)

    def update(self, view: View, settings: LiveSettings) -> None:
        """Update positions of the obstacles from a snapshot, and their shapes from the settings."""
        regions, clearances = self._regions, view.clearances
        for k, name in enumerate(self._names):
            shift, first = view.shift(name), regions.offsets[k]
            if shift != self._shifts[k]:
                self._shifts[k] = shift
                regions.shifts[k] = shift
            if self._dynamic[k]:
                if shift != _NO_SHIFT:  # present: its radius follows from its clearance
                    center = [a + b for a, b in zip(PARKED_POSITION, shift, strict=True)]
                    regions.numbers[first + 3] = math.dist(center, view.position_ned) - clearances[self.ids[k]]
            elif (shape := settings.shapes[name]) is not self._shapes[k]:
                self._shapes[k] = shape
                regions.numbers[first : regions.offsets[k + 1]] = shape.packed()

    def inward_directions(self, position_ned: Vector3) -> list[list[float]]:
        """Return the direction in which the clearance of each obstacle decreases; position_ned [m]."""
        _, gradients, _, _ = self._evaluator.evaluate(position_ned, _LEVEL)
        directions: list[list[float]] = gradients.tolist()
        return directions

    def scan(self, position_ned: Vector3, heading: float) -> list[float]:
        """Scan the horizontal plane of the vehicle; position_ned [m], heading [rad]."""
        self._position[:] = position_ned
        np.cos(self._angles + heading, out=self._directions[:, 0])
        np.sin(self._angles + heading, out=self._directions[:, 1])
        self._ray_distances(self._regions, self._position, self._directions, MAX_RANGE, self._distances)
        nearest: list[float] = self._distances.reshape(SECTORS, _RAYS).min(axis=1).tolist()
        return nearest


def _is_obstacle(secondary: SecondaryRegion) -> bool:
    region = secondary.region
    return region.keep == "out" and secondary.criterion == "obstacle" and not of_attitude(region.shape)
