"""Path planner: a polyline from the vehicle into the goal region that keeps clear of the hard regions.

A potential alone leads into pockets between obstacles. So the law keeps a path of a few corners, and each period tries
one change of it: a corner moved, added or dropped, or another end in the goal region. The cheaper path stays. The cost
is the length, plus a penalty where the path passes too close to a hard region, taken at the place to which the region
will have moved by then. One candidate a period bounds the cost of a step; the random numbers are the law's own, so that
a run repeats bit for bit. The path only sets the direction: the barriers keep the vehicle out of regions, whatever the
path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import exponential, length3, square
from controller.laws.deployable.gains import SPREADS
from controller.laws.deployable.linear_algebra import copy, norm
from controller.laws.deployable.search import ROOM, PathLimits, Tree, empty_tree, grow_tree, limits_along
from controller.regions import Sphere
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import (
    PackedRegions,
    clearance_at,
    clearance_of_place,
    clearance_of_sphere,
    evaluate_packed,
)
from controller.stack_array import zeros

Array = NDArray[np.float64]

_LN_30 = 3.4011973816621555
CORNERS = 8  # at most
_SAMPLES = 64  # evaluations of the regions along a path at most
_STRIDE = (0.08, 3.0)  # m, least and greatest distance between two
_TRUST = 0.7  # of the clearance beyond the desired one, travelled before the next evaluation
_INSIDE = 200.0  # m of path, cost of a metre within a hard region
_NEAR = 3.0  # m of path, cost of a metre on the surface
_BETTER = 0.03  # m, and
_BETTER_PART = 0.01  # of its cost, that a candidate must save to be taken
_BLOCKED = 1.3  # of its length, cost of a path above which the tree searches for another
_PASSED = 0.25  # m from a corner, within which it counts as passed
_SPHERE = Sphere.kind
_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on do not depend on position alone
_CLIMBS = 12  # towards the inside of the goal region
_PAYS = 0.05  # m deeper for each metre that a climb must bring; straight up it brings 1
_DEEP_ENOUGH = 1e-3  # m, tolerance of the depth of an end
_LESS = 0.5  # m, by which corners are drawn nearer to start and end than nodes of the tree


class PathPlan(NamedTuple):
    """State of the planner: the path, and a candidate."""

    path: Array  # (CORNERS + 1, 3) m, NED: corners, then the end; the end moves with the goal
    candidate: Array  # (CORNERS + 1, 3)
    counts: NDArray[np.int64]  # (2,) points of path and candidate, the end included; 0: none yet
    cost: Array  # (1,) of the path
    clear_until: Array  # (n,) m of path until which each region is far
    tree: Tree
    random_numbers: Array  # (5,) in [0, 1)
    phase: NDArray[np.int64]  # (1,) 0: evaluate the path, 1: a candidate
    random: NDArray[np.uint64]  # (1,) state of the generator


def empty_plan(n_regions: int, seed: int) -> PathPlan:
    """Return a planner without a path, for `n_regions`, whose random numbers follow from a seed."""
    n = CORNERS + 1
    state = np.array([seed * 2 + 0x9E3779B97F4A7C15], dtype=np.uint64)
    return PathPlan(
        path=np.zeros((n, 3)),
        candidate=np.zeros((n, 3)),
        counts=np.zeros(2, dtype=np.int64),
        cost=np.zeros(1),
        clear_until=np.zeros(n_regions),
        tree=empty_tree(),
        random_numbers=np.zeros(5),
        phase=np.zeros(1, dtype=np.int64),
        random=state,
    )


def uniform(random: NDArray[np.uint64]) -> float:
    """Return the next random number in [0, 1): xorshift64*, Vigna 2016."""
    x = random[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    random[0] = x
    return float((x * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(11)) / 9007199254740992.0


def _bell_shaped(random: NDArray[np.uint64]) -> float:
    """Return a bell-shaped random number with mean 0 and standard deviation 1."""
    return (uniform(random) + uniform(random) + uniform(random) + uniform(random) - 2.0) * 1.7320508075688772


def path_cost(
    path: Array, count: int, start: Array, regions: PackedRegions, clear_until: Array, limits: PathLimits
) -> float:
    """Return the cost of a path [m].

    A clearance changes by at most the distance travelled: a region that is far is not evaluated before it could be
    near.

    Parameters
    ----------
    path : ndarray, shape (CORNERS + 1, 3)
        Points [m, NED].
    count : int
        Number of points in use.
    start : ndarray, shape (3,)
        Start of the path [m, NED].
    regions : PackedRegions
        The n regions.
    clear_until : ndarray, shape (n,)
        Written: the length of path until which each region is far.
    limits : PathLimits
        Clearance, margin, speed.

    Returns
    -------
    float
        [m].
    """
    enough = limits.clearance + _STRIDE[1] / _TRUST  # m, of clearance, beyond which it does not matter
    clear_until[:] = 0.0
    total, travelled, samples = 0.0, 0.0, 0
    place, point, room = zeros(3), zeros(3), zeros(3)
    for leg in range(count):
        begin = start if leg == 0 else path[leg - 1]
        length = length3(path[leg, 0] - begin[0], path[leg, 1] - begin[1], path[leg, 2] - begin[2])
        total += length
        s = 0.0
        while s < length:
            if samples == _SAMPLES:
                for rest in range(leg + 1, count):
                    total += (1.0 + _INSIDE) * _distance(path[rest - 1], path[rest])
                return float(total + _INSIDE * (length - s))  # what is not evaluated counts as blocked
            samples += 1
            path_length, free = travelled + s, enough
            later = path_length / limits.speed  # s
            for axis in range(3):
                place[axis] = begin[axis] + (path[leg, axis] - begin[axis]) * (s / length)
            for i in range(regions.kinds.size):
                if path_length >= clear_until[i] and regions.hard[i]:
                    own = 0.0  # m/s, of the region
                    for axis in range(3):
                        point[axis] = place[axis] - regions.velocities[i, axis] * later
                        own += abs(regions.velocities[i, axis])
                    if regions.kinds[i] == _SPHERE:
                        clearance = clearance_of_sphere(regions, i, point)
                    elif regions.kinds[i] < _ATTITUDE:
                        clearance = clearance_of_place(regions, i, point, room)
                    else:
                        clearance = enough
                    clearance -= SPREADS * regions.deviations[i]
                    if clearance >= enough:
                        clear_until[i] = path_length + (clearance - enough) / (1.0 + own / limits.speed)
                    free = min(free, clearance)
            stride = min(max(_TRUST * (free - limits.clearance), _STRIDE[0]), _STRIDE[1], length - s + 1e-9)
            lack = limits.clearance - free
            if lack > 0.0:
                total += stride * _NEAR * square(lack / limits.clearance)
                if free < limits.margin:
                    total += stride * _INSIDE * (1.0 + limits.margin - free)
            s += stride
        travelled += length
    return total


def nearest_goal_point(goal: PackedRegions, position: Array, depth: float, end: Array) -> None:
    """Write the point of the goal region nearest to a position, `depth` [m] inside where the region is that deep.

    Ascends the gradient of the clearance, and halves the step wherever that gains little: in a shallower region, to
    about its middle.
    """
    copy(position, end)
    value, gradient, turning, clearance = zeros(1), zeros(1, 3), zeros(1, 3), zeros(1)
    level = zeros(4)  # a goal is a region of position: any attitude will do
    level[0] = 1.0
    candidate, other_gradient, other_clearance = zeros(3), zeros(1, 3), zeros(1)
    evaluate_packed(goal, end, level, value, gradient, turning, clearance)
    part = 1.0
    for _ in range(_CLIMBS):
        slope, lack = norm(gradient[0]), depth - clearance[0]
        if not (lack > _DEEP_ENOUGH and slope > 0.0):
            return
        for axis in range(3):
            candidate[axis] = end[axis] - gradient[0, axis] / slope * lack * part
        evaluate_packed(goal, candidate, level, value, other_gradient, turning, other_clearance)
        if other_clearance[0] > clearance[0] + _PAYS * lack * part:
            copy(candidate, end)
            copy(other_gradient[0], gradient[0])
            clearance[0] = other_clearance[0]
            part = min(2.0 * part, 1.0)
        else:
            part *= 0.5


def improve_path(
    plan: PathPlan, start: Array, goal: PackedRegions, regions: PackedRegions, limits: PathLimits, period: float
) -> None:
    """Update the path to vehicle and regions, and try one candidate; to be called once a period [s]."""
    path, candidate = plan.path, plan.candidate
    if plan.counts[0] == 0:
        plan.counts[0] = 1
        nearest_goal_point(goal, start, limits.depth, path[0])
    else:
        end = plan.counts[0] - 1
        for axis in range(3):  # the end moves with the goal, and is corrected where the goal moved otherwise
            path[end, axis] += goal.velocities[0, axis] * period
        if not clearance_at(goal, 0, path[end]) > 0.0:
            nearest_goal_point(goal, path[end], limits.depth, path[end])
    while plan.counts[0] > 1 and _distance(path[0], start) < _PASSED:
        for i in range(plan.counts[0] - 1):
            copy(path[i + 1], path[i])
        plan.counts[0] -= 1
    # one evaluation a period: path and candidate in turn
    if plan.phase[0] == 0:
        plan.phase[0] = 1
        plan.cost[0] = path_cost(path, plan.counts[0], start, regions, plan.clear_until, limits)
        return
    plan.phase[0] = 0
    random_numbers = plan.random_numbers
    for i in range(random_numbers.size):
        random_numbers[i] = uniform(plan.random)
    blocked = plan.cost[0] > _BLOCKED * _length(path, plan.counts[0], start)
    if not blocked:
        plan.tree.room[0] = ROOM[0]
    if blocked and random_numbers[4] < 0.7:
        plan.counts[1] = grow_tree(
            plan.tree, start, path[plan.counts[0] - 1], random_numbers, regions, limits, candidate
        )
        if plan.counts[1] == 0:
            return
    else:
        _mutate_path(plan, start, goal, limits)
    cost = path_cost(candidate, plan.counts[1], start, regions, plan.clear_until, limits)
    if cost < plan.cost[0] - _BETTER - _BETTER_PART * plan.cost[0]:
        _copy_path(candidate, path)
        plan.counts[0] = plan.counts[1]
        plan.cost[0] = cost


def _copy_path(path: Array, out: Array) -> None:
    for i in range(CORNERS + 1):
        copy(path[i], out[i])


def _length(path: Array, count: int, start: Array) -> float:
    length = _distance(path[0], start)
    for i in range(1, count):
        length += _distance(path[i], path[i - 1])
    return float(length)


def _distance(a: Array, b: Array) -> float:
    return float(length3(a[0] - b[0], a[1] - b[1], a[2] - b[2]))


def _mutate_path(plan: PathPlan, start: Array, goal: PackedRegions, limits: PathLimits) -> None:
    """Write a mutation of the path into `candidate`."""
    path, candidate, random, room = plan.path, plan.candidate, plan.random, plan.tree.room[0] - _LESS
    _copy_path(path, candidate)
    count = plan.counts[0]
    last = count - 1
    choice = uniform(random)
    if choice < 0.1:  # straight to the nearest end
        nearest_goal_point(goal, start if count == 1 else path[count - 2], limits.depth, candidate[last])
        if uniform(random) < 0.5:
            copy(candidate[last], candidate[0])
            count = 1
    elif choice < 0.2:  # another end
        reach = 0.05 + uniform(random) * 0.5
        for axis in range(3):
            candidate[last, axis] += reach * _bell_shaped(random)
        nearest_goal_point(goal, candidate[last], limits.depth, candidate[last])
    elif choice < 0.3 and count > 1:  # a corner less
        drop = int(uniform(random) * last)
        for i in range(drop, last):
            copy(candidate[i + 1], candidate[i])
        count -= 1
    elif choice < 0.65 and count > 1:  # a corner moved
        moved = int(uniform(random) * last)
        reach = 0.03 * exponential(_LN_30 * uniform(random))
        for axis in range(3):
            candidate[moved, axis] += reach * _bell_shaped(random)
    elif choice < 0.9 and count <= CORNERS:  # a corner more, anywhere about
        at = int(uniform(random) * count)
        for i in range(count, at, -1):
            copy(candidate[i - 1], candidate[i])
        for axis in range(3):
            low, high = limits_along(axis, start, path[last], room)
            candidate[at, axis] = low + uniform(random) * (high - low)
        count += 1
    else:  # one corner alone, anywhere about
        copy(path[last], candidate[1])
        for axis in range(3):
            low, high = limits_along(axis, start, path[last], room)
            candidate[0, axis] = low + uniform(random) * (high - low)
        count = 2
    plan.counts[1] = count
