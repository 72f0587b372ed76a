"""Position of the vehicle in the scene before it is steered: a wrong sign or digit of the scene's origin shows here."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from controller.quaternion import rotation_matrix
from controller.regions.region_set import of_attitude
from cosim.scenario.scenario import Scenario
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.signals import Array

_BEAMS = {  # words for, and body directions of, a distance sensor by its MAV_SENSOR_ROTATION
    0: ("ahead", (1.0, 0.0, 0.0)), 2: ("right", (0.0, 1.0, 0.0)), 4: ("behind", (-1.0, 0.0, 0.0)),
    6: ("left", (0.0, -1.0, 0.0)), 24: ("above", (0.0, 0.0, -1.0)), 25: ("below", (0.0, 0.0, 1.0)),
}  # fmt: skip
_RANGE_TOLERANCE = 0.5  # m, by which a sensor's range may differ from the scene's
_INSET = 0.6  # m, maximum distance of regions, which are for the vehicle's center, from what a sensor sees
_MIN_STRIDE = 0.05  # m, along a beam
_MAX_RANGE, _ROUNDING = 50.0, 1e-3  # m
MAX_DISTANCE = 50.0  # m, horizontal distance from everything in the scene, beyond which nothing is steered


class Placement:
    """Distances between a vehicle and the scene."""

    def __init__(self, scenario: Scenario) -> None:
        self._environment = RegionEnvironment(scenario)
        regions = [secondary.region for secondary in scenario.regions]
        self._names = ["goal", *(region.name for region in regions)]
        self._has_goal = scenario.has_goal and not of_attitude(scenario.goal)
        hard = [i for i, region in enumerate(regions, 1) if region.hard and not of_attitude(region.shape)]
        self.hard = np.array(hard, dtype=int)
        shapes = [region.shape for region in (*([scenario.goal_region] if scenario.has_goal else []), *regions)]
        corners = np.array([shape.bounds() for shape in shapes]).reshape(-1, 2, 3)[:, :, :2]
        bounded = corners[np.isfinite(corners).all(axis=(1, 2))]
        start = np.tile(scenario.initial.position[:2], (1, 2, 1))
        self._corners: Array = np.concatenate([bounded, start])  # (n, 2, 2) m, north and east, low and high

    def distance(self, position: Array) -> float:
        """Return the minimum horizontal distance [m] of a position [m, NED] from start, goal and bounded regions."""
        outside = np.maximum(self._corners[:, 0] - position[:2], position[:2] - self._corners[:, 1])
        return float(np.min(np.linalg.norm(np.maximum(outside, 0.0), axis=1)))

    def clearance(self, position: Array, quaternion: Array) -> float:
        """Return the minimum clearance of hard regions [m] at a pose; infinite if there are none."""
        return float(np.min(self._environment.evaluate(position, quaternion)[1][self.hard], initial=math.inf))

    def contradictions(self, position: Array, quaternion: Array, ranges: Mapping[int, float]) -> dict[int, str]:
        """Describe ranges [m], by MAV_SENSOR_ROTATION, that differ from those to the hard regions of the scene."""
        differing = dict[int, str]()
        for rotation, excess in self._excesses(position, quaternion, ranges).items():
            if not -_RANGE_TOLERANCE <= excess <= _RANGE_TOLERANCE + _INSET:
                word, measured = _BEAMS[rotation][0], ranges[rotation]
                free = f"{word} {measured - excess:.2f} m are free"
                differing[rotation] = f"{free}, but {measured:.2f} m by the distance sensor"
        return differing

    def is_nearer(self, position: Array, quaternion: Array, ranges: Mapping[int, float]) -> bool:
        """Return True if a range, as for `contradictions`, is shorter than the way to the hard regions of the scene."""
        return min(self._excesses(position, quaternion, ranges).values(), default=0.0) < -_RANGE_TOLERANCE

    def _excesses(self, position: Array, quaternion: Array, ranges: Mapping[int, float]) -> dict[int, float]:
        """Return by how much ranges exceed the scene's [m], where that has a hard region within 50 m."""
        R, excesses = rotation_matrix(quaternion), dict[int, float]()
        for rotation in ranges.keys() & _BEAMS:
            expected = self._range(position, quaternion, R @ _BEAMS[rotation][1])
            if expected < _MAX_RANGE:
                excesses[rotation] = ranges[rotation] - expected
        return excesses

    def _range(self, position: Array, quaternion: Array, direction: Array) -> float:
        """Return the distance [m] to the first hard region in a direction, a unit vector; at least 50 m for none."""
        distance, free = 0.0, math.inf
        while (
            distance < _MAX_RANGE and (free := self.clearance(position + distance * direction, quaternion)) > _ROUNDING
        ):
            distance += max(free, _MIN_STRIDE)
        return max(0.0, distance + min(free, 0.0))  # not beyond the surface by part of a stride

    def describe(self, position: Array, quaternion: Array) -> str:
        """Describe a pose by its position [m, NED], and its distances to the goal and the nearest hard region."""
        north, east, down = position.tolist()
        _, clearances = self._environment.evaluate(position, quaternion)
        parts = [f"in the scene: {north:.2f} m north, {east:.2f} m east, {down:.2f} m down"]
        if self._has_goal:
            parts.append("inside the goal" if clearances[0] >= 0.0 else f"goal {format_distance(-clearances[0])} away")
        if self.hard.size:
            nearest = self.hard[np.argmin(clearances[self.hard])]
            clearance, distance = clearances[nearest], format_distance(abs(clearances[nearest]))
            margin = f"{distance} left" if clearance >= 0.0 else f"violated by {distance}"
            parts.append(f"nearest hard region {self._names[nearest]!r}, {margin}")
        return ", ".join(parts)


def format_distance(distance: float) -> str:
    """Format a distance [m] with its unit, in km from one on."""
    return f"{distance:.2f} m" if distance < 1e3 else f"{distance / 1e3:.0f} km"
