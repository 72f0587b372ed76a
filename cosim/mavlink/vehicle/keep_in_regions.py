"""Check that a target is below the surface and in the regions that the vehicle must stay in."""

from __future__ import annotations

import dataclasses

from controller.regions import pack
from controller.regions.region_set import RegionEvaluator, of_attitude
from cosim.mavlink.vehicle.view import View
from cosim.scenario.region_tables import Vector3
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.settings import LiveSettings

_LEVEL = (1.0, 0.0, 0.0, 0.0)


class KeepInRegions:
    """The regions in space that a vehicle must stay in."""

    # The constructor loads the library that evaluates them, which may take seconds: call it before the simulation.

    def __init__(self, scenario: Scenario) -> None:
        every = [secondary.region for secondary in scenario.regions if not secondary.is_dynamic]
        self._regions = [region for region in every if region.keep == "in" and not of_attitude(region.shape)]
        RegionEvaluator(pack(self._regions)).evaluate((0.0, 0.0, 0.0), _LEVEL)

    def objections(self, position_ned: Vector3, view: View, settings: LiveSettings) -> list[str]:
        """Return a text for each violated region of a target, and for one above the surface; position_ned [m]."""
        packed = pack([dataclasses.replace(region, shape=settings.shapes[region.name]) for region in self._regions])
        for k, region in enumerate(self._regions):
            packed.shifts[k] = view.shift(region.name)
        *_, clearances = RegionEvaluator(packed).evaluate(position_ned, _LEVEL)
        pairs = zip(self._regions, clearances.tolist(), strict=True)
        words = [f"{-clearance:.2g} m outside {region.name}" for region, clearance in pairs if clearance < 0.0]
        if position_ned[2] < 0.0:
            words.append(f"{-position_ned[2]:.2g} m above the surface")
        return words
