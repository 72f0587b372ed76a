"""Path planner: a polyline from the vehicle into the goal region that keeps clear of the hard regions."""

# A potential alone leads into pockets between obstacles. So the law keeps a path of a few corners, and tries random
# changes: a corner moved, added or dropped, or another end in the goal region. While the path is blocked, or soft
# regions make it costly, paths found by `search.py` are candidates, too; where a fast region comes, so are waits aside.
# The path of lower cost by `cost.py` stays.
# Each period does a bounded part of the work. The law has its own random numbers, so that a run repeats bit for bit.
# The path only sets the direction: the barriers keep the vehicle out of hard regions for any path.

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import exponential
from controller.laws.deployable.path_planning.cost import (
    AT_REST,
    BY_HARD,
    BY_SOFT,
    TOTAL,
    PathCost,
    add_cost,
    begin_cost,
    is_fast,
)
from controller.laws.deployable.path_planning.search import (
    SAMPLING_MARGIN,
    Numbers5,
    PathLimits,
    Search,
    look_for_path,
    sample_point,
)
from controller.linear_algebra import norm
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, clearance_at, evaluate_packed
from controller.stack_array import Array, Rows3, Shape, Vector3, Vector4, array, zeros
from controller.state import State

_LN_30 = 3.4011973816621555
CORNERS = 8  # maximum number of corners of a path
_BETTER = 0.03  # m, constant part of the cost that a candidate must save to replace the path
_BETTER_PART = 0.01  # proportional part of that, as a fraction of the path's cost
_BLOCKED = 0.3  # cost by regions, as a fraction of the path's length, above which the trees search for another path
_HARD, _ALL, _COSTLY = 0, 1, 2  # regions closed to the search: hard ones; all; hard ones and the costlier soft ones
_SEARCH_CALLS = (100, 800)  # calls of the search with one choice of closed regions: at first; maximum number
_BLOCKED_LONG = 1.0  # s, time for which the path has been blocked, after which the trees grow by more nodes a period
_MORE_CALLS = 8  # calls of the search a period from then on: the vehicle goes astray meanwhile
_SECOND_LOOK = 2.0  # s, time for which new trees then look for other paths, since the first one found may be a detour
_PASSED = 0.25  # m, distance from a corner within which it counts as passed
_CLIMBS = 12  # maximum number of steps from a point into the goal region
_PAYS = 0.05  # least gain in depth per meter of such a step; it gains 1 where the gradient does not turn
_DEEP_ENOUGH = 1e-3  # m, tolerance of the depth of an end
_BEGIN, _PATH, _CANDIDATE = 0, 1, 2  # phases: no evaluation under way; the path is evaluated; the candidate is
_WAIT_THRESHOLD = 1.0  # m, cost by hard regions above which candidates may wait until fast ones have passed
_WAIT_FRACTION = 0.4  # fraction of the candidates that then wait
_USED = -1  # value of `found_points` while the found path is the candidate
_LESS = 0.5  # m by which random corners stay closer to start and end than random nodes of the trees


Points = Annotated[Array, Shape(CORNERS + 1, 3)]
Closed = Annotated[NDArray[np.bool_], Shape("n")]
Generator = Annotated[NDArray[np.uint64], Shape(1)]


class PathPlan(State):
    """State of the planner: the path, and a candidate."""

    path: Points  # m, NED: corners, then the end; the end moves with the goal
    candidate: Points  # m, NED: path that may replace it
    found: Points  # m, NED: path found by the search
    points: int  # number of points of the path, the end included; 0: none yet
    candidate_points: int  # the same of the candidate
    found_points: int  # the same of the found path
    cost: Vector4  # m: cost of the path and its parts, as in `PathCost`
    waits: bool  # True if the path waits at its first corner for fast regions to pass
    candidate_waits: bool  # the same of the candidate
    new_cost: PathCost  # evaluation under way, of path or candidate
    search: Search
    closed: Closed  # True for regions that the search keeps out of
    closed_kinds: int  # closed regions: `_HARD`, `_ALL` or `_COSTLY`
    calls_left: int  # number of calls of the search left with them
    calls: int  # number of calls for each choice
    random_numbers: Numbers5  # numbers in [0, 1) for one call of the search
    phase: int  # `_BEGIN`, `_PATH` or `_CANDIDATE`
    blocked: int  # number of periods for which the path has been blocked
    second_look: int  # number of periods left of a second look
    random: Generator  # state of the generator


def empty_plan(n_regions: int, seed: int) -> PathPlan:
    """Return a planner without a path, for `n_regions`, with random numbers from a seed."""
    return PathPlan(n=n_regions, random=np.array([seed * 2 + 0x9E3779B97F4A7C15], dtype=np.uint64))


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


def _random_offset(random: NDArray[np.uint64], shortest: float) -> Vector3:
    """Return an offset in any direction, of a typical length from `shortest` to 30 times that [m]."""
    reach = shortest * exponential(_LN_30 * uniform(random))
    return reach * array(_bell_shaped(random), _bell_shaped(random), _bell_shaped(random))


def _random_corner(plan: PathPlan, start: Vector3) -> Vector3:
    """Return a random point about the start and the end of the path [m, NED]."""
    fractions = array(uniform(plan.random), uniform(plan.random), uniform(plan.random))
    return sample_point(start, plan.path[plan.points - 1], plan.search.sampling_margin - _LESS, fractions)


def nearest_goal_point(goal: PackedRegions, position: Vector3, depth: float, end: Vector3) -> None:
    """Write the point of the goal region nearest to a position, `depth` [m] inside where the region is that deep."""
    # Ascends the gradient of the clearance, and halves the step wherever that gains little. In a shallower region it
    # ends near the center.
    end[:] = position
    value, gradient, turning, clearance = zeros(1), zeros(1, 3), zeros(1, 3), zeros(1)
    level = zeros(4)  # a goal is a region of position: the attitude has no effect
    level[0] = 1.0
    candidate, other_gradient, other_clearance = zeros(3), zeros(1, 3), zeros(1)
    evaluate_packed(goal, end, level, value, gradient, turning, clearance)
    part = 1.0
    for _ in range(_CLIMBS):
        slope, lack = norm(gradient[0]), depth - clearance[0]
        if not (lack > _DEEP_ENOUGH and slope > 0.0):
            return
        candidate[:] = end - gradient[0] / slope * lack * part
        evaluate_packed(goal, candidate, level, value, other_gradient, turning, other_clearance)
        if other_clearance[0] > clearance[0] + _PAYS * lack * part:
            end[:] = candidate
            gradient[0] = other_gradient[0]
            clearance[0] = other_clearance[0]
            part = min(2.0 * part, 1.0)
        else:
            part *= 0.5


def improve_path(
    plan: PathPlan, start: Vector3, goal: PackedRegions, regions: PackedRegions, limits: PathLimits, period: float
) -> None:
    """Update the path for vehicle and regions, and try a candidate; call it once a period [s]."""
    _follow(plan, start, goal, limits, period)
    _evaluate(plan, start, goal, regions, limits)
    blocked = is_blocked(plan, start)
    looks_again = _count_blocked(plan, blocked, period)
    if not (blocked or looks_again) and plan.cost[BY_SOFT] <= _BLOCKED * _length(plan.path, plan.points, start):
        plan.search.sampling_margin, plan.closed_kinds = SAMPLING_MARGIN[0], _HARD
    elif plan.found_points == 0:
        end, random_numbers = plan.path[plan.points - 1], plan.random_numbers
        _choose_closed(plan, blocked or looks_again, start, end, regions, limits.margin)
        closed = regions._replace(hard=plan.closed)
        for _ in range(_MORE_CALLS if looks_again or plan.blocked * period > _BLOCKED_LONG else 1):
            for i in range(random_numbers.size):
                random_numbers[i] = uniform(plan.random)
            plan.found_points = look_for_path(plan.search, start, end, random_numbers, closed, limits, plan.found)
            if plan.found_points > 0:
                if looks_again:
                    _restart_trees(plan.search)
                break


def _count_blocked(plan: PathPlan, blocked: bool, period: float) -> bool:
    """Count the periods for which the path has been blocked; return True during a second look for other paths."""
    if blocked:
        plan.blocked += 1
        plan.second_look = 0
    elif plan.blocked * period > _BLOCKED_LONG:
        plan.blocked, plan.second_look = 0, int(_SECOND_LOOK / period)
        _restart_trees(plan.search)
    else:
        plan.blocked, plan.second_look = 0, max(plan.second_look - 1, 0)
    return bool(plan.second_look > 0)


def _restart_trees(search: Search) -> None:
    search.of_goal.size = search.of_vehicle.size = 0
    search.sampling_margin = SAMPLING_MARGIN[0]


def go_straight(plan: PathPlan, start: Vector3, goal: PackedRegions, limits: PathLimits) -> None:
    """Set the path to a straight line to the nearest end in the goal region, without regard to regions."""
    plan.points = 1
    nearest_goal_point(goal, start, limits.depth, plan.path[0])


def _choose_closed(
    plan: PathPlan, blocked: bool, start: Vector3, end: Vector3, regions: PackedRegions, margin: float
) -> None:
    """Choose the regions that the trees keep out of; a change of the choice restarts the trees."""
    # While hard regions block the path, only these are closed. Otherwise the costlier soft ones, or all, are closed
    # too, in turns that grow longer. A soft region near or around start or end of the path stays open.
    turn = plan.closed_kinds
    if blocked:
        turn = _HARD
    elif turn == _HARD:
        turn, plan.calls = _COSTLY, _SEARCH_CALLS[0]
    elif plan.calls_left == 0:
        turn = _ALL if turn == _COSTLY else _COSTLY
        if turn == _COSTLY:
            plan.calls = min(2 * plan.calls, _SEARCH_CALLS[1])
    if turn != plan.closed_kinds:
        plan.closed_kinds, plan.calls_left = turn, plan.calls
        _restart_trees(plan.search)
    plan.calls_left -= 1
    soft, mean = 0, 0.0
    for i in range(regions.kinds.size):
        plan.closed[i] = regions.hard[i]
        if not regions.hard[i]:
            mean = (soft * mean + regions.crossing_costs[i]) / (soft + 1)
            soft += 1
    if turn == _HARD:
        return
    for i in range(regions.kinds.size):
        if regions.hard[i] or regions.kinds[i] >= FIRST_OF_ATTITUDE:
            continue
        is_near = clearance_at(regions, i, start) < margin or clearance_at(regions, i, end) < margin
        plan.closed[i] = not is_near and (turn == _ALL or regions.crossing_costs[i] > mean)


def _follow(plan: PathPlan, start: Vector3, goal: PackedRegions, limits: PathLimits, period: float) -> None:
    """Begin a path, or move its end with the goal and drop corners that the vehicle has passed."""
    path = plan.path
    if plan.points == 0:
        plan.points = 1
        nearest_goal_point(goal, start, limits.depth, path[0])
    else:
        end = plan.points - 1
        path[end] += goal.velocities[0] * period  # the end moves with the goal; corrected if the goal moved otherwise
        if not clearance_at(goal, 0, path[end]) > 0.0:
            nearest_goal_point(goal, path[end], limits.depth, path[end])
    while plan.points > 1 and not plan.waits and norm(path[0] - start) < _PASSED:
        for i in range(plan.points - 1):
            path[i] = path[i + 1]
        plan.points -= 1
        if plan.phase == _PATH:
            plan.phase = _BEGIN


def _evaluate(plan: PathPlan, start: Vector3, goal: PackedRegions, regions: PackedRegions, limits: PathLimits) -> None:
    """Continue the evaluation of path or candidate, in turn; the candidate becomes the path if it costs less."""
    cost = plan.new_cost
    if plan.phase == _BEGIN:
        begin_cost(cost, start, goal.velocities[0], plan.waits)
        plan.phase = _PATH
    if plan.phase == _PATH:
        if add_cost(cost, plan.path, plan.points, regions, limits, np.inf):
            plan.cost = cost.cost
            _choose_candidate(plan, start, goal, regions, limits)
            begin_cost(cost, cost.start, goal.velocities[0], plan.candidate_waits)
            plan.phase = _CANDIDATE
        return
    most = plan.cost[TOTAL] - _BETTER - _BETTER_PART * plan.cost[TOTAL]
    if add_cost(cost, plan.candidate, plan.candidate_points, regions, limits, most):
        plan.phase = _BEGIN
        if cost.cost[TOTAL] < most:
            plan.path = plan.candidate
            plan.points, plan.waits = plan.candidate_points, plan.candidate_waits
            plan.cost = cost.cost


def is_blocked(plan: PathPlan, start: Vector3) -> bool:
    """Return True if the cost by hard regions is above `_BLOCKED` of the path's length."""
    return bool(plan.cost[BY_HARD] > _BLOCKED * _length(plan.path, plan.points, start))


def search_path(
    plan: PathPlan,
    start: Vector3,
    goal: PackedRegions,
    regions: PackedRegions,
    limits: PathLimits,
    period: float,
    periods: NDArray[np.int64],
) -> None:
    """Improve a path for some periods, or until it is not blocked, while vehicle and regions rest; start [m, NED]."""
    # Units of arguments: period [s]
    periods[1] = 0
    while periods[1] < periods[0]:
        improve_path(plan, start, goal, regions, limits, period)
        periods[1] += 1
        if plan.phase == _CANDIDATE and not is_blocked(plan, start):
            return


def _choose_candidate(
    plan: PathPlan, start: Vector3, goal: PackedRegions, regions: PackedRegions, limits: PathLimits
) -> None:
    """Choose the next candidate: the path that the search found, once, or else a mutation of the path."""
    plan.candidate_waits = False
    if plan.found_points > 0:
        plan.candidate = plan.found
        plan.candidate_points = plan.found_points
        plan.found_points = _USED
        return
    plan.found_points = 0
    has_fast = False
    if plan.cost[BY_HARD] + plan.cost[AT_REST] > _WAIT_THRESHOLD:
        for i in range(regions.kinds.size):
            has_fast = has_fast or is_fast(regions, i, limits)
    if (plan.waits or has_fast) and uniform(plan.random) < _WAIT_FRACTION:
        _choose_wait(plan, start)
    else:
        _mutate_path(plan, start, goal, limits)


def _choose_wait(plan: PathPlan, start: Vector3) -> None:
    """Write the path into `candidate`, with a wait at a random first corner."""
    added = 0 if plan.waits or plan.points > CORNERS else 1
    for i in range(CORNERS, added - 1, -1):
        plan.candidate[i] = plan.path[i - added]
    center = plan.path[0] if plan.waits else start
    plan.candidate[0] = center + _random_offset(plan.random, 0.2)
    plan.candidate[0, 2] = max(plan.candidate[0, 2], min(start[2], 0.0))
    plan.candidate_points, plan.candidate_waits = plan.points + added, True


def _length(path: Rows3, count: int, start: Vector3) -> float:
    length = norm(path[0] - start)
    for i in range(1, count):
        length += norm(path[i] - path[i - 1])
    return length


def _mutate_path(plan: PathPlan, start: Vector3, goal: PackedRegions, limits: PathLimits) -> None:
    """Write a mutation of the path into `candidate`."""
    path, candidate, random = plan.path, plan.candidate, plan.random
    candidate[:] = path
    count = plan.points
    last = count - 1
    choice = uniform(random)
    if choice < 0.1:  # straight to the nearest end
        nearest_goal_point(goal, start if count == 1 else path[count - 2], limits.depth, candidate[last])
        if uniform(random) < 0.5:
            candidate[0] = candidate[last]
            count = 1
    elif choice < 0.2:  # another end, a little off or far
        candidate[last] += _random_offset(random, 0.02)
        nearest_goal_point(goal, candidate[last], limits.depth, candidate[last])
    elif choice < 0.3 and count > 1:  # remove a corner
        drop = int(uniform(random) * last)
        for i in range(drop, last):
            candidate[i] = candidate[i + 1]
        count -= 1
    elif choice < 0.65 and count > 1:  # move a corner
        corner = int(uniform(random) * last)
        candidate[corner] += _random_offset(random, 0.03)
    elif choice < 0.9 and count <= CORNERS:  # add a corner
        inserted = int(uniform(random) * count)
        for i in range(count, inserted, -1):
            candidate[i] = candidate[i - 1]
        candidate[inserted] = _random_corner(plan, start)
        count += 1
    else:  # one corner alone, anywhere about
        candidate[1] = path[last]
        candidate[0] = _random_corner(plan, start)
        count = 2
    plan.candidate_points = count
