"""Whether the regions of a scenario can be satisfied: at the start, together, with the goal, and on the way."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planning.search import line_margin
from controller.regions import Mesh, Points, Region
from controller.regions.region_set import evaluate_at_pose, of_attitude
from cosim.precheck.finding import Finding, status
from cosim.precheck.mission_check import mission_findings
from cosim.precheck.path_search import SearchedPath, find_path, path_limits
from cosim.precheck.region_intersection import Overlap, box_about, box_within, search
from cosim.results.water_surface import heights_above_surface, is_submerged_model
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_MARGIN = 3.0  # m, margin around start and regions of the box that is searched
_MAX_MARGIN = 1e5  # m, maximum margin that is tried


def region_findings(scenario: Scenario) -> Iterator[Finding]:
    """Yield the findings on whether start, goal and regions are in the water, and can be satisfied, at time 0."""
    goal, start = scenario.goal_region, scenario.initial.position
    regions = [secondary.region for secondary in scenario.regions]
    placed = [region for region in regions if not of_attitude(region.shape)]  # attitude limits exclude no position
    low, high = _box(goal, placed, start)
    moving = " Some move: this is how they are at time 0." if scenario.moving else ""
    violated = [region for region in regions if _clearance(region, scenario) < 0.0]
    yield from _surface(scenario)
    yield from _grids([goal, *regions])
    yield from (_start(region, scenario) for region in violated)
    yield from _common(goal, placed, low, high, moving)
    yield from _between(placed, low, high)
    yield _path(scenario, [r for r in placed if r not in violated], [r.name for r in violated])
    yield from mission_findings(scenario, placed)


def _grids(regions: Sequence[Region]) -> Iterator[Finding]:
    """Yield a note on each region from a file, by how much the spacing of its grid enlarges or shrinks it."""
    for region in regions:
        if isinstance(shape := region.shape, Mesh | Points):
            error, spacing = shape.error(), shape.grid.spacing
            which = "larger" if region.keep == "out" else "smaller"
            text = f"{region.name}: up to {error:.2g} m {which} than its file says, by a grid of {spacing:.2g} m."
            yield Finding("regions", "grid", "note", text, numbers={"error": error, "spacing": spacing})


def _surface(scenario: Scenario) -> Iterator[Finding]:
    """Yield a finding on what is above the water surface; a note if that is a start from which the vehicle falls."""
    heights = dict(heights_above_surface(scenario))
    if not heights:
        return
    text = (
        f"Above the water surface (z < 0; z points down): {', '.join(f'{k} by {h:.2f} m' for k, h in heights.items())}."
    )
    if is_submerged_model(scenario):
        text += " The plant has water everywhere: the vehicle would fly."
    elif list(heights) == ["the start"]:
        text += " Buoyancy fades there, and the vehicle falls."
        yield Finding("regions", "water surface", "note", text, numbers=heights)
        return
    else:
        text += " Buoyancy fades there: the vehicle cannot stay."
    advice = "Give depths as positive z: 1.5, not -1.5, is 1.5 m deep."
    yield Finding("regions", "water surface", "fails", text, advice, heights)


def _box(goal: Region, regions: Sequence[Region], start: tuple[float, float, float]) -> tuple[Array, Array]:
    """Return the corners of a box with the start, all bounded regions, and a point of each region to stay within."""
    margin = _MARGIN
    while True:
        low, high = box_about([goal, *regions], [start], margin)
        wanted = [goal, *(region for region in regions if region.keep == "in")]
        if margin > _MAX_MARGIN or all(search([region], low, high, tolerance=margin).found for region in wanted):
            return low, high
        margin *= 2.0


def _clearance(region: Region, scenario: Scenario) -> float:
    return float(evaluate_at_pose([region], scenario.initial.position, scenario.initial.quaternion)[2][0])


def _start(region: Region, scenario: Scenario) -> Finding:
    start = scenario.initial.position
    _, (gradient,), (clearance,) = evaluate_at_pose([region], start, scenario.initial.quaternion)
    turned = of_attitude(region.shape)
    text = f"The start violates {region.name} by {-clearance:.3f} {'rad' if turned else 'm'}."
    name, numbers = f"start, {region.name}", {"clearance": float(clearance)}
    if not region.hard:
        text += " It is soft: it pushes, and may be violated."
        return Finding("regions", name, "note", text, numbers=numbers)
    slope = float(np.linalg.norm(gradient))
    if turned:
        advice = f"Turn initial.quaternion, and law.desired_quaternion with it, by at least {-clearance:.3f} rad."
    elif slope > 0.0:
        to = np.array(start) + clearance / slope * gradient
        advice = f"Move initial.position to about {_point(to)}, or {region.name} away from it."
    else:
        advice = f"Move initial.position by {-clearance:.3f} m, to any side, or {region.name} away from it."
    return Finding("regions", name, "fails", text, advice, numbers)


def _common(goal: Region, regions: Sequence[Region], low: Array, high: Array, moving: str) -> Iterator[Finding]:
    """Yield findings on a common point of goal and regions, and on regions that exclude the whole goal."""
    if not regions:
        return
    box = box_within(goal, low, high)
    overlap = search([goal, *regions], *box)
    yield Finding(
        "regions", "goal and regions", status(overlap.found), _in_words(overlap, "the goal and every region") + moving,
        "" if overlap.found else _mend(goal, regions, box), _numbers(overlap),
    )  # fmt: skip
    if not overlap.found:
        together = search(regions, low, high)
        yield Finding(
            "regions", "regions together", status(together.found), _in_words(together, "every region"),
            "" if together.found else f"Relax each of them by {-together.depth:.3f} m, or draw them together.",
            _numbers(together),
        )  # fmt: skip


def _mend(goal: Region, regions: Sequence[Region], box: tuple[Array, Array]) -> str:
    advice = []
    for region in regions:
        alone = search([goal, region], *box)
        if not alone.found:
            # half of it reaches the goal, the other half satisfies the region, which was violated by as much
            enough = -2.0 * alone.depth
            advice.append(
                f"{region.name} alone leaves nothing of the goal: move one of them, or relax {region.name} by "
                f"{enough:.3f} m."
            )
    return " ".join(advice) or "Each region alone leaves some of the goal, all together none: move the goal."


def _between(regions: Sequence[Region], low: Array, high: Array) -> Iterator[Finding]:
    """Yield a note on overlaps of the shapes to keep out of, where the arbiter has to choose."""
    inside = [Region(r.name, r.shape, "in") for r in regions if r.keep == "out"]
    pairs, numbers = [], {}
    for one, other in itertools.combinations(inside, 2):
        box = box_within(other, *box_within(one, low, high))
        if np.any(box[0] > box[1]):
            continue
        overlap = search([one, other], *box)
        if overlap.found:
            pairs.append(f"{one.name} and {other.name} ({overlap.depth:.3f} m deep at {_point(overlap.point)})")
            numbers[f"{one.name}, {other.name}"] = overlap.depth
    if pairs:
        text = f"Kept out of, and overlapping, where the arbiter has to choose: {'; '.join(pairs)}."
        yield Finding("regions", "overlaps", "note", text, numbers=numbers)


def _path(scenario: Scenario, kept: Sequence[Region], left_out: Sequence[str]) -> Finding:
    """Search a path by the deployable law's planner that satisfies all regions, or else the hard ones."""
    but = f", {', '.join(left_out)} left aside (violated at the start)" if left_out else ""
    soft = [region.name for region in kept if not region.hard]
    path = _search(scenario, kept)
    if path.found:
        text = f"The deployable law's search finds a way that satisfies the regions all along{but}: {_measures(path)}."
        return Finding("regions", "way", "holds", text, numbers=_path_numbers(path))
    if soft and (path := _search(scenario, [region for region in kept if region.hard])).found:
        text = (
            f"The deployable law's search finds a way that satisfies the hard regions all along{but}, but none that "
            f"satisfies {', '.join(soft)} too: {_measures(path)}."
        )
        return Finding("regions", "way", "note", text, numbers=_path_numbers(path))
    text = f"The deployable law's search finds no way from the start into the goal{but}, within {path.searched:g} s."
    width = 2.0 * line_margin(path_limits(_gains(scenario)))
    advice = f"Open a passage of at least {width:.2f} m between the regions."
    return Finding("regions", "way", "fails", text, advice, _path_numbers(path))


def _search(scenario: Scenario, regions: Sequence[Region]) -> SearchedPath:
    start = scenario.initial.position
    return find_path(regions, scenario.goal_region, start, _gains(scenario), scenario.time.duration)


def _gains(scenario: Scenario) -> DeployableGains:
    gains = scenario.law.gains
    return gains if isinstance(gains, DeployableGains) else DeployableGains()


def _measures(path: SearchedPath) -> str:
    corners = len(path.corners) - 2
    turns = "straight" if corners == 0 else f"{corners} corner{'s' if corners > 1 else ''}"
    return f"{path.length:.1f} m, {turns}"


def _path_numbers(path: SearchedPath) -> dict[str, float | bool]:
    return {"found": path.found, "length": path.length, "clearance": path.clearance, "searched": path.searched}


def _in_words(overlap: Overlap, what: str) -> str:
    if overlap.found:
        return f"Found a common point of {what} at {_point(overlap.point)}, {overlap.depth:.3f} m within all of them."
    if overlap.excluded:
        text = f"There is certainly no common point of {what}"
    else:
        text = f"No common point of {what} was found, nor is one excluded"
    bound = max(0.0, -overlap.at_most)
    best = f"the best, {_point(overlap.point)}, violates one by {-overlap.depth:.3f} m, none less than {bound:.3f} m"
    return f"{text}: {best}."


def _numbers(overlap: Overlap) -> dict[str, float | bool]:
    x, y, z = overlap.point
    return {"x": x, "y": y, "z": z, "depth": overlap.depth, "at_most": overlap.at_most, "found": overlap.found}


def _point(point: Sequence[float] | Array) -> str:
    return f"({', '.join(f'{x + 0.0:.2f}' for x in point)}) m"
