"""Whether a mission can be flown: each place, the ways between them, and the time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from controller.laws.deployable.gains import DeployableGains
from controller.regions import Region, Sphere
from controller.regions.region_set import clearances_at, shape_center
from cosim.precheck.finding import Finding
from cosim.precheck.path_search import find_path
from cosim.precheck.region_intersection import box_within, search
from cosim.scenario.goal_mission import Leg
from cosim.scenario.scenario import Scenario

_SMALLEST = 0.01  # m, radius of a goal that has no inside about its center
_MARGIN = 1.0  # m, around a place, of the box in which a common point is searched


def mission_findings(scenario: Scenario, regions: Sequence[Region]) -> Iterator[Finding]:
    """Yield findings on the goal's next places and the ways between them, with regions as at time 0."""
    mission, hard = scenario.mission, [region for region in regions if region.hard]
    if len(mission.stops) == 1:
        return
    yield from _ways(scenario, hard)
    before = mission.legs[0]
    for i, leg in enumerate(mission.legs[1:], 1):
        if leg.pace == 0.0 and mission.legs[i - 1].pace == 0.0:  # no way leads there
            yield _place(scenario, hard, before, leg)
        before = leg
    yield from _time(scenario)


def _place(scenario: Scenario, hard: Sequence[Region], before: Leg, leg: Leg) -> Finding:
    """Find whether a place and the hard regions have a common point, and a path leads there from the place before."""
    name = scenario.mission.stops[leg.stop]
    radius = leg.radius if isinstance(scenario.goal, Sphere) else math.nan
    if not radius > 0.0:  # a sphere that fits into the goal about its center
        center = np.array([shape_center(scenario.goal)])
        radius = max(float(clearances_at(center, scenario.goal_region)[0]), _SMALLEST)
    goal = Region("goal", Sphere(leg.center, radius), "in")
    low, high = (np.array(leg.center) + side for side in (-_MARGIN, _MARGIN))
    overlap = search([goal, *hard], *box_within(goal, low, high))
    if not overlap.found:
        nearest = max(0.0, -overlap.depth)
        text = f"No common point of {name} and the hard regions was found: the best violates one by {nearest:.3f} m."
        return Finding("regions", name, "fails", text, f"Move it, or relax the regions by {nearest:.3f} m.")
    gains = scenario.law.gains if isinstance(scenario.law.gains, DeployableGains) else DeployableGains()
    path = find_path(hard, goal, before.center, gains, scenario.time.duration)
    numbers = {"found": path.found, "length": path.length, "clearance": path.clearance}
    if path.found:
        return Finding("regions", name, "holds", f"A way leads there: {path.length:.1f} m.", numbers=numbers)
    text = f"The deployable law's search finds no way there from the place before, within {path.searched:g} s."
    return Finding("regions", name, "fails", text, "Open a passage, or add places on the way.", numbers)


def _ways(scenario: Scenario, hard: Sequence[Region]) -> Iterator[Finding]:
    """Yield the hard regions that rings or polylines violate."""
    legs = scenario.mission.legs
    ways = [(a, b) for a, b in zip(legs, legs[1:], strict=False) if b.pace > 0.0]
    if not ways:
        return
    ends = np.array([[a.center, b.center] for a, b in ways])
    shares = np.linspace(0.0, 1.0, 11)[:, None, None]
    points = (ends[:, 0] + shares * (ends[:, 1] - ends[:, 0])).reshape(-1, 3)
    ok = True
    for region in hard:
        least = float(np.min(clearances_at(points, region)))
        if least < 0.0:
            ok = False
            advice = f"Keep the ways at least {-least:.3f} m farther from it."
            text = f"The goal's way violates {region.name} by {-least:.3f} m."
            yield Finding("regions", f"ways, {region.name}", "fails", text, advice, {"clearance": least})
    if ok:
        length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
        text = f"The goal's ways, {length:.1f} m, satisfy the hard regions."
        yield Finding("regions", "ways", "holds", text, numbers={"length": length})


def _time(scenario: Scenario) -> Iterator[Finding]:
    """Yield a finding if ways and stays take longer than the run."""
    mission, ways = scenario.mission, 0.0
    speed = getattr(scenario.law.gains, "speed", math.inf)
    for a, b in zip(mission.legs, mission.legs[1:], strict=False):
        ways += a.stay + math.dist(a.center, b.center) / (b.pace or min(b.speed, speed))
    least = ways + math.dist(scenario.initial.position, mission.legs[0].center) / min(mission.legs[0].speed, speed)
    if least > scenario.time.duration:
        text = f"Ways and stays take {least:.0f} s at least, the run {scenario.time.duration:g} s."
        yield Finding("regions", "time", "fails", text, f"Set time.duration to {1.2 * least:.0f} s or more.")
    else:
        yield Finding(
            "regions", "time", "holds", f"Ways and stays take {least:.0f} s at least.", numbers={"least": least}
        )
