"""What was there of what commands can bring about: obstacles that came, and the target in the end."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from controller.regions import Sphere
from cosim.results.record import Rows
from cosim.scenario.scenario import Scenario
from cosim.scenario.tables import PARKED_POSITION, SecondaryRegion
from cosim.simulation.environment import shape_center
from cosim.simulation.signals import Array


def scenario_as_flown(scenario: Scenario, record: Rows) -> Scenario:
    """Return the scenario with those obstacles that came in, at their size, and with the target as it was in the end.

    Parameters
    ----------
    scenario : Scenario
        What was run.
    record : Rows
        What it left.

    Returns
    -------
    Scenario
        The same one, where nothing could be commanded.
    """
    if not scenario.commands.enabled:
        return scenario
    regions = tuple(region for region in (_came(region, record) for region in scenario.regions) if region is not None)
    goal, radius = scenario.goal, record.value("target.radius", -1)
    if radius > 0.0:
        goal = Sphere(shape_center(goal), radius)
    return dataclasses.replace(scenario, regions=regions, goal=goal)


def radii_of(record: Rows, name: str) -> Iterator[tuple[Array, Array]]:
    """Yield times [s] and radii [m] of an obstacle at the rows that tell its size, block by block.

    Parameters
    ----------
    record : Rows
        Of the run.
    name : str
        Of a region that can come.

    Yields
    ------
    (ndarray, ndarray)
        Of the same shape; none of where it has not come, or the pose is none.
    """
    place, shift = ([f"{of}.{axis}" for axis in "xyz"] for of in ("position", f"{name}.shift"))
    for block in record.blocks(["time", *place, *shift, f"{name}.clearance"]):
        shifts = block.stack(shift)
        radii = np.linalg.norm(block.stack(place) - shifts - PARKED_POSITION, axis=1) - block[f"{name}.clearance"]
        known = shifts.any(axis=1) & np.isfinite(radii)
        yield block["time"][known], radii[known]


def _came(secondary: SecondaryRegion, record: Rows) -> SecondaryRegion | None:
    """Return a region at its size, None for an obstacle that never came, or of which no row tells the size."""
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
