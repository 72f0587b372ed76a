"""Search of a path from the start into the goal, by the path planner of the deployable law."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from controller.compiling.function import BoundCall
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planning.planner import empty_plan, search_path
from controller.laws.deployable.path_planning.search import PathLimits
from controller.regions import Region, pack
from cosim.precheck.region_intersection import Vector3, common_depth
from cosim.simulation.signals import Array

SEARCH_TIME = 120.0  # s of flight time, maximum duration of the search
PERIOD = 0.02  # s, control period of the law, in which the search takes a step
_SEED = 1  # seed of the search
_SAMPLE = 0.02  # m, between the points of a path at which its clearance is evaluated


@dataclass(frozen=True)
class SearchedPath:
    """Result of a search: a path, or none."""

    corners: tuple[Vector3, ...]  # m, NED: start, corners, and an end in the goal; empty if no path was found
    clearance: float  # m, minimum clearance of all regions along the path; 0 or negative if none was found
    searched: float  # s of flight time that the search took

    @property
    def found(self) -> bool:
        """Whether a path was found."""
        return len(self.corners) > 0

    @property
    def length(self) -> float:
        """Length of the path [m], infinite if there is none."""
        return float(np.linalg.norm(np.diff(self.corners, axis=0), axis=1).sum()) if self.found else math.inf


def path_limits(gains: DeployableGains) -> PathLimits:
    """Return the limits of paths around regions that are known exactly."""
    return PathLimits(gains.clearance, gains.margin, gains.speed, gains.depth)


def find_path(
    regions: Sequence[Region], goal: Region, start: Vector3, gains: DeployableGains, duration: float
) -> SearchedPath:
    """Search a path from a start into the goal that satisfies regions throughout, at their positions at time 0."""
    # Units of arguments: start [m, NED]; duration [s]
    at_rest = [dataclasses.replace(region, hard=True, velocity=(0.0, 0.0, 0.0)) for region in regions]
    plan, position = empty_plan(len(at_rest), _SEED), np.array(start, dtype=float)
    limits = path_limits(gains)
    left, used = math.ceil(min(duration, SEARCH_TIME) / PERIOD), 0
    periods = np.zeros(2, dtype=np.int64)
    goal_at_rest = dataclasses.replace(goal, velocity=(0.0, 0.0, 0.0))
    search = BoundCall(search_path, (plan, position, pack([goal_at_rest]), pack(at_rest), limits, PERIOD, periods)).call
    clearance = -math.inf
    while left > 0:
        periods[0] = left
        search()
        left, used = left - int(periods[1]), used + int(periods[1])
        points = np.array([position, *plan.path[: plan.points]])
        clearance = float(common_depth(_samples(points), at_rest).min()) if at_rest else math.inf
        if clearance >= 0.0:
            corners = tuple((float(x), float(y), float(z)) for x, y, z in points)
            return SearchedPath(corners, clearance, used * PERIOD)
    return SearchedPath((), min(clearance, 0.0), used * PERIOD)


def _samples(points: Array) -> Array:
    """Return points along a polyline, its corners included, shape (m, 3) [m, NED]."""
    legs = [
        a + (b - a) * np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / _SAMPLE))[:, None]
        for a, b in zip(points[:-1], points[1:], strict=True)
    ]
    return np.concatenate(legs)
