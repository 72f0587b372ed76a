"""Parts of a scenario above the water surface, z = 0, where a vehicle is out of its model; z points down."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cosim.scenario.scenario import Scenario
from cosim.scenario.validation import known_parameters


def is_submerged_model(scenario: Scenario) -> bool:
    """Return True if the plant has water everywhere: its buoyancy does not fade above the surface."""
    known = known_parameters(scenario.vehicle)
    return not scenario.plant.parameters.get("free_surface", known["free_surface"])


def hull_radius(scenario: Scenario) -> float:
    """Return the radius [m] of the hull; further above the surface the vehicle is in the air alone."""
    return float(scenario.plant.parameters.get("hull_radius", known_parameters(scenario.vehicle)["hull_radius"]))


def heights_above_surface(scenario: Scenario) -> Iterator[tuple[str, float]]:
    """Yield name and least height [m] of what the vehicle is to be in, and which is wholly above the surface."""
    # That is the start, the goal with its next places, and the regions to stay within, at time 0.
    yield from ((name, height) for name, height in _heights(scenario) if height > 0.0)


def _heights(scenario: Scenario) -> Iterator[tuple[str, float]]:
    yield "the start", -scenario.initial.position[2]
    if scenario.has_goal:
        top, bottom = (corner[2] for corner in scenario.goal.bounds())
        yield "the goal", -bottom
        if math.isfinite(bottom - top):
            half = (bottom - top) / 2.0
            yield from ((f"the goal's place {i}", -(z + half)) for i, (_, _, z) in enumerate(scenario.goal_then, 2))
    for region in (secondary.region for secondary in scenario.regions):
        if region.keep == "in":
            yield region.name, -region.shape.bounds()[1][2]
