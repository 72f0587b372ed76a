"""Check that a target is below the surface and in the regions that the vehicle must stay in."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from controller.regions import pack
from controller.regions.region_set import of_attitude
from controller.regions.shape import Shape
from cosim.mavlink.vehicle.view import View
from cosim.scenario.region_tables import Vector3
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.settings import LiveSettings

_LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


class KeepInRegions:
    """The regions in space that a vehicle must stay in."""

    # The constructor loads the library that evaluates them, which may take seconds: call it before the simulation.

    def __init__(self, scenario: Scenario) -> None:
        every = [secondary.region for secondary in scenario.regions if not secondary.is_dynamic]
        self._regions = [region for region in every if region.keep == "in" and not of_attitude(region.shape)]
        self._clearances_at((0.0, 0.0, 0.0), {}, [])

    def objections(self, position_ned: Vector3, view: View, settings: LiveSettings) -> list[str]:
        """Return a text for each violated region of a target, and for one above the surface; position_ned [m]."""
        shifts = [view.shift(region.name) for region in self._regions]
        clearances = self._clearances_at(position_ned, settings.shapes, shifts)
        pairs = zip(self._regions, clearances, strict=True)
        words = [f"{-clearance:.2g} m outside {region.name}" for region, clearance in pairs if clearance < 0.0]
        if position_ned[2] < 0.0:
            words.append(f"{-position_ned[2]:.2g} m above the surface")
        return words

    def _clearances_at(self, position: Vector3, shapes: Mapping[str, Shape], shifts: list[Vector3]) -> list[float]:
        n = len(self._regions)
        if not n:
            return []
        packed = pack([dataclasses.replace(r, shape=shapes.get(r.name, r.shape)) for r in self._regions])
        if shifts:
            packed.shifts[:] = shifts
        values, gradients, rotation_gradients, clearances = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n)
        packed.evaluate(np.array(position), _LEVEL, values, gradients, rotation_gradients, clearances)
        result: list[float] = clearances.tolist()
        return result
