"""What was there of what orders can bring about: obstacles that came, and the target in the end."""

from __future__ import annotations

import dataclasses

import numpy as np

from controller.regions import Sphere
from cosim.record import Record
from cosim.scenario import Scenario
from cosim.scenario_tables import FAR_AWAY, SecondaryRegion
from cosim.surroundings import middle_of


def as_it_came(scenario: Scenario, record: Record) -> Scenario:
    """Return the scenario with those obstacles that came in, at their size, and with the target as it was in the end.

    Parameters
    ----------
    scenario : Scenario
        What was run.
    record : Record
        What it left.

    Returns
    -------
    Scenario
        The same one, where nothing could be ordered.
    """
    if not scenario.commands.enabled:
        return scenario
    regions = tuple(region for region in (_came(region, record) for region in scenario.regions) if region is not None)
    goal, radius = scenario.goal, float(record["target.radius"][-1])
    if radius > 0.0:
        goal = Sphere(middle_of(goal), radius)
    return dataclasses.replace(scenario, regions=regions, goal=goal)


def _came(secondary: SecondaryRegion, record: Record) -> SecondaryRegion | None:
    """Return a region at its size, None for an obstacle that never came, or of which no row tells the size."""
    if not secondary.seen:
        return secondary
    name = secondary.region.name
    shifts = record.stack([f"{name}.shift.{axis}" for axis in "xyz"])
    there = np.flatnonzero(shifts.any(axis=1))
    positions = record.stack([f"position.{axis}" for axis in "xyz"])[there]
    radii = np.linalg.norm(positions - shifts[there] - FAR_AWAY, axis=1) - record[f"{name}.clearance"][there]
    known = radii[np.isfinite(radii)]  # not where the pose is none
    if not known.size:
        return None
    radius = float(known[-1])
    return dataclasses.replace(secondary, region=dataclasses.replace(secondary.region, shape=Sphere(FAR_AWAY, radius)))
