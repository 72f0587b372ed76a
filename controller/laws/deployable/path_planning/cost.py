"""Cost of a path: its length, and penalties for passing close to hard regions, or through soft ones."""

# Regions are evaluated along the path, each at its predicted position. A clearance changes by at most the distance
# traveled: so strides are long where clearances are large, and a far region is not evaluated before it could be near.
# An evaluation may take several periods, each with a bounded number of strides.

from __future__ import annotations

import numpy as np

from controller.arithmetic import square
from controller.laws.deployable.path_planning.search import PathLimits, uncertainty
from controller.linear_algebra import norm
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, clearance_at
from controller.stack_array import Rows3, Vector3, Vector4, VectorN
from controller.state import State

# maximum number of evaluations of the regions along a path: in one call; in total, after which the rest is blocked
_SAMPLES = (64, 512)
_STRIDE = (0.08, 3.0)  # m, minimum and maximum distance between two evaluations
_TRUST = 0.7  # ratio of a stride to the clearance beyond the desired one
_INSIDE = 200.0  # penalty per meter of path closer to a hard region than the margin; added once more per meter closer
_EDGE = 0.1  # m closer than the margin at which it is full; proportional before, so that no stride's end decides
_NEAR = 3.0  # penalty per meter of path on the surface of a hard region; 0 at the desired clearance
_ENTERED = 0.5  # m, added to the depth in a soft region as the penalty for being inside at all
_SHALLOW = 0.2  # m, depth from which that is added in full; proportional at less depth
_STAY = 3.0  # m, length of path that the stay at its end counts for
_STAY_SAMPLES = 4  # number of evaluations of a stay that moves with the goal, the first for the present time
_FIRST_LATER = 1.0  # s from now, time of the second evaluation
_LATER_RATIO = 3.0  # ratio of the time of each further evaluation to the one before
_FAST = 0.25  # fraction of the vehicle's speed above which a hard region may run into a vehicle at rest
_HORIZON = 8.0  # s from now, to which such regions are predicted there
_PREDICTIONS = 16  # maximum number of predictions of one of them
_WAIT = 0.5  # m, cost of a wait
_AWAY = 0.05  # m, distance from a soft region within which a stay counts as inside: keeps the end off its surface
_COARSE = 0.25  # m, minimum distance between two evaluations near the surface of a soft region
_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude
# indices in `PathCost.cost`: all; by hard regions and soft ones on the way; by fast ones at rest
TOTAL, BY_HARD, BY_SOFT, AT_REST = range(4)


class PathCost(State):
    """The cost of a path, complete or not yet."""

    start: Vector3  # m, NED: start of the path when the evaluation began
    drift: Vector3  # m/s, NED: velocity of the path's end, which moves with the goal
    leg: int  # index of the next leg to evaluate
    evaluations: int  # number so far
    waits: bool  # True if the vehicle waits at the first corner until fast regions have passed
    traveled: float  # m, length of the evaluated legs
    on_leg: float  # m, evaluated length of the present leg
    cost: Vector4  # m: cost so far, and its parts, in the order of `TOTAL` to `AT_REST`
    clear_until: VectorN  # m: length of path before which each region needs no evaluation


def begin_cost(cost: PathCost, start: Vector3, drift: Vector3, waits: bool) -> None:
    """Begin the evaluation of a path from a start [m, NED] to an end that drifts [m/s, NED]."""
    cost.start, cost.drift, cost.waits = start, drift, waits
    cost.leg, cost.evaluations, cost.traveled, cost.on_leg = 0, 0, 0.0, 0.0
    cost.cost[:] = cost.clear_until[:] = 0.0


def add_cost(
    cost: PathCost, path: Rows3, count: int, regions: PackedRegions, limits: PathLimits, cost_limit: float
) -> bool:
    """Continue to evaluate a path [m, NED]; return True once it is complete, or the cost exceeds `cost_limit` [m]."""
    for _ in range(_SAMPLES[0]):
        leg, s = cost.leg, cost.on_leg
        if cost.cost[TOTAL] > cost_limit:
            return True
        if leg == count:
            cost.cost[TOTAL] += _STAY * _stay_cost(path[count - 1], cost.drift, regions, limits)
            if not (cost.waits or _drifts(cost.drift)):
                _add_rest_cost(cost, path[count - 1], regions, limits)
            return True
        begin = cost.start if leg == 0 else path[leg - 1]
        length = norm(path[leg] - begin)
        if s >= length:
            cost.leg += 1
            cost.traveled += length
            cost.on_leg = 0.0
            if leg == 0 and cost.waits:
                cost.cost[TOTAL] += _WAIT
                _add_rest_cost(cost, path[0], regions, limits)
            continue
        if cost.evaluations == _SAMPLES[1]:
            _add_stride(cost, length - s, 0.0, _INSIDE)
            continue
        cost.evaluations += 1
        point = begin + (path[leg] - begin) * (s / length)
        free, soft, reach = _evaluate_point(cost, point, regions, limits)
        spare = max(_TRUST * (free - limits.clearance), 0.5 * (free - limits.margin))  # m, no surface in between
        stride = min(max(spare, _STRIDE[0]), reach)
        _add_stride(cost, min(stride, length - s + 1e-9), soft, _near_cost(free, limits))
    return False


def _add_stride(cost: PathCost, stride: float, soft: float, penalty: float) -> None:
    """Add a stride [m] with the extra cost per meter of `soft` regions and `penalty` of hard ones."""
    cost.on_leg += stride
    cost.cost[TOTAL] += stride * (1.0 + soft + penalty)
    cost.cost[BY_HARD] += stride * penalty
    cost.cost[BY_SOFT] += stride * soft


def _evaluate_point(
    cost: PathCost, place: Vector3, regions: PackedRegions, limits: PathLimits
) -> tuple[float, float, float]:
    """Return the minimum clearance of hard regions [m], the penalty of soft ones per meter, the stride limit [m]."""
    traveled = cost.traveled + cost.on_leg
    later = traveled / limits.speed  # s
    effect_distance = limits.clearance + _STRIDE[1] / _TRUST  # m, clearance beyond which a hard region has no effect
    free, soft, reach = effect_distance, 0.0, _STRIDE[1]
    for i in range(regions.kinds.size):
        if traveled < cost.clear_until[i] or regions.kinds[i] >= _ATTITUDE:
            continue
        if cost.waits and cost.leg > 0 and is_fast(regions, i, limits):
            continue  # it has passed by then
        clearance = clearance_at(regions, i, place - regions.velocities[i] * later)
        region_speed = np.sum(abs(regions.velocities[i]))  # m/s, summed over the axes
        excess = clearance - _STRIDE[1]
        if regions.hard[i]:
            clearance -= uncertainty(regions, i)
            excess = clearance - effect_distance
            free = min(free, clearance)
        else:
            soft += regions.crossing_costs[i] * _depth_cost(-clearance, 0.0)
            reach = min(reach, max(abs(clearance), _COARSE))
        if excess >= 0.0:
            cost.clear_until[i] = traveled + excess / (1.0 + region_speed / limits.speed)
    return free, soft, reach


def _depth_cost(depth: float, away: float) -> float:
    """Return the factor of a soft region's crossing cost at a depth [m] in it, negative outside."""
    # The part `_ENTERED` starts at a distance `away` [m] outside, and is full `_SHALLOW` deeper.
    return _ENTERED * min((depth + away) / _SHALLOW, 1.0) + max(depth, 0.0) if depth > -away else 0.0


def _near_cost(free: float, limits: PathLimits) -> float:
    """Return the cost per meter at a clearance of hard regions [m]."""
    lack = limits.clearance - free
    if lack <= 0.0:
        return 0.0
    cost = _NEAR * square(lack / limits.clearance)
    if free < limits.margin:
        deep = limits.margin - free
        cost += _INSIDE * (min(deep / _EDGE, 1.0) + deep)
    return cost


def _drifts(drift: Vector3) -> bool:
    return bool(np.any(drift != 0.0))


def is_fast(regions: PackedRegions, i: int, limits: PathLimits) -> bool:
    """Return True if region `i` is hard, has a position, and moves so fast that barriers alone may not avoid it."""
    speed = norm(regions.velocities[i])
    return bool(regions.hard[i] and regions.kinds[i] < _ATTITUDE and speed > _FAST * limits.speed)


def _add_rest_cost(cost: PathCost, place: Vector3, regions: PackedRegions, limits: PathLimits) -> None:
    """Add the cost of fast regions that meet a vehicle at rest after the evaluated legs, at a position [m, NED]."""
    free = limits.clearance
    for i in range(regions.kinds.size):
        if not is_fast(regions, i, limits):
            continue
        v, later = regions.velocities[i], cost.traveled / limits.speed
        speed = norm(v)
        while later < _HORIZON:
            clearance = clearance_at(regions, i, place - v * later) - uncertainty(regions, i)
            free = min(free, clearance)
            later += max((clearance - limits.clearance) / speed, _HORIZON / _PREDICTIONS)
    price = _STAY * _near_cost(free, limits)
    cost.cost[TOTAL] += price
    cost.cost[AT_REST] += price


def _stay_cost(end: Vector3, drift: Vector3, regions: PackedRegions, limits: PathLimits) -> float:
    """Return the cost per meter of a stay at the end of a path [m, NED]."""
    # An end that drifts [m/s, NED] with the goal is also evaluated at later positions, and against hard regions, which
    # it may meet there. The cost is the mean over these times.
    drifts = _drifts(drift)
    samples, later, total = _STAY_SAMPLES if drifts else 1, 0.0, 0.0
    for _ in range(samples):
        free = limits.clearance
        for i in range(regions.kinds.size):
            if regions.kinds[i] >= _ATTITUDE or (regions.hard[i] and not drifts):
                continue
            clearance = clearance_at(regions, i, end + (drift - regions.velocities[i]) * later)
            if regions.hard[i]:
                free = min(free, clearance - uncertainty(regions, i))
            else:
                total += regions.crossing_costs[i] * _depth_cost(-clearance, _AWAY)
        total += _near_cost(free, limits)
        later = max(_FIRST_LATER, _LATER_RATIO * later)
    return total / samples
