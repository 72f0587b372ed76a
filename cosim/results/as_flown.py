"""The scenario as flown: with the obstacles that commands added, and with the last target."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from controller.regions import Sphere
from controller.regions.region_set import shape_center
from cosim.results.record import Rows
from cosim.scenario.region_tables import PARKED_POSITION, SecondaryRegion
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array


def scenario_as_flown(scenario: Scenario, record: Rows) -> Scenario:
    """Return the scenario with the obstacles that were added, at their last size, and with the last target."""
    if not scenario.commands.enabled:
        return scenario
    regions = tuple(
        region for region in (_region_as_flown(region, record) for region in scenario.regions) if region is not None
    )
    goal, radius = scenario.goal, record.value("target.radius", -1)
    if radius > 0.0:
        goal = Sphere(shape_center(goal), radius)
    return dataclasses.replace(scenario, regions=regions, goal=goal)


def radii_of(record: Rows, name: str) -> Iterator[tuple[Array, Array]]:
    """Yield times [s] and radii [m] of an obstacle by blocks, from the vehicle's position and the clearance."""
    position, shift = ([f"{of}.{axis}" for axis in "xyz"] for of in ("position", f"{name}.shift"))
    for block in record.blocks(["time", *position, *shift, f"{name}.clearance"]):
        shifts = block.stack(shift)
        radii = np.linalg.norm(block.stack(position) - shifts - PARKED_POSITION, axis=1) - block[f"{name}.clearance"]
        known = shifts.any(axis=1) & np.isfinite(radii)
        yield block["time"][known], radii[known]


def _region_as_flown(secondary: SecondaryRegion, record: Rows) -> SecondaryRegion | None:
    """Return a region at its last size; None for an obstacle that was never added, or whose radius is not known."""
    if not secondary.is_dynamic:
        return secondary
    radius = None
    for _, radii in radii_of(record, secondary.region.name):
        radius = float(radii[-1]) if radii.size else radius
    if radius is None:
        return None
    return dataclasses.replace(
        secondary, region=dataclasses.replace(secondary.region, shape=Sphere(PARKED_POSITION, radius))
    )
