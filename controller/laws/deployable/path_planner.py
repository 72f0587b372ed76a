"""The way round: a polyline from the vehicle into the goal region that keeps clear of the hard regions.

A potential alone leads into pockets between obstacles. So the law keeps a way of up to a few corners, and each period
tries one change to it: a corner moved, added or dropped, the end put elsewhere in the goal region. The cheaper way
stays. The cost is the length, and more where the way passes closer to a hard region than it should, each region taken
to where it will be when the vehicle comes by. One way a period makes the cost of a step bounded; the random numbers
are the law's own, so that a run repeats bit for bit. The way only says where to go: what keeps the vehicle out of the
regions are the barriers, whatever the way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import part
from controller.jit.stack_array import zeros
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy, norm
from controller.laws.deployable.search import Tree, grow, tree_of_nothing
from controller.regions import Sphere
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import (
    PackedRegions,
    clearance_at,
    clearance_of_place,
    clearance_of_sphere,
    evaluate_packed,
)

Array = NDArray[np.float64]

CORNERS = 8  # at most
_SAMPLES = 64  # evaluations of the regions a way at most
_STRIDE = (0.08, 0.6)  # m, least and greatest distance between two
_TRUST = 0.7  # of the clearance beyond the wanted one, that is gone before looking again
_INSIDE = 200.0  # m of way that a metre within a hard region costs
_NEAR = 3.0  # m of way that a metre on the surface costs
_BETTER = 0.03  # m, and
_BETTER_PART = 0.01  # of its cost, that a new way must save to be taken
_BLOCKED = 1.3  # of its length, cost of a way from which on the tree looks for another
_PASSED = 0.25  # m from a corner, within which it counts as passed
_SPHERE = Sphere.kind
_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on close no place
_CLIMBS = 12  # towards the inside of the goal region
_PAYS = 0.05  # m deeper for each metre that a climb must bring; straight up it brings 1
_DEEP_ENOUGH = 1e-3  # m, by which an end may lie less deep than asked for
_ROOM = 2.5  # m beyond start and end in which corners are looked for


class Guide(NamedTuple):
    """The way, and room for another one."""

    way: Array  # (CORNERS + 1, 3) m, NED: corners, then the end; the end moves with the goal
    other: Array  # (CORNERS + 1, 3)
    points: NDArray[np.int64]  # (2,) how many way and other have, the end included; 0: none yet
    cost: Array  # (1,) of the way
    far_until: Array  # (n,) room for `cost_of`
    tree: Tree
    draws: Array  # (5,) room for random numbers
    tried: NDArray[np.int64]  # (1,) whose turn it is: 0 of the way itself, 1 of a changed one
    random: NDArray[np.uint64]  # (1,) state of the generator


def guide_of_nothing(n_regions: int, seed: int) -> Guide:
    """Return a guide without a way among `n_regions`, whose random numbers follow from a seed."""
    n = CORNERS + 1
    state = np.array([seed * 2 + 0x9E3779B97F4A7C15], dtype=np.uint64)
    return Guide(
        way=np.zeros((n, 3)),
        other=np.zeros((n, 3)),
        points=np.zeros(2, dtype=np.int64),
        cost=np.zeros(1),
        far_until=np.zeros(n_regions),
        tree=tree_of_nothing(),
        draws=np.zeros(5),
        tried=np.zeros(1, dtype=np.int64),
        random=state,
    )


@part
def uniform(random: NDArray[np.uint64]) -> float:
    """Return the next random number in [0, 1): xorshift64*, Vigna 2016."""
    x = random[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    random[0] = x
    return float((x * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(11)) / 9007199254740992.0


@part
def _spread(random: NDArray[np.uint64]) -> float:
    """Return a random number about 0 with deviation 1, bell-shaped."""
    return (uniform(random) + uniform(random) + uniform(random) + uniform(random) - 2.0) * 1.7320508075688772


@part
def cost_of(
    way: Array, count: int, start: Array, regions: PackedRegions, far_until: Array, gains: DeployableGains
) -> float:
    """Return what a way costs, in metres.

    A clearance changes by no more than the way between: a region found far away is not looked at before it could have
    come near.

    Parameters
    ----------
    way : ndarray, shape (CORNERS + 1, 3)
        Points [m, NED].
    count : int
        How many of them count.
    start : ndarray, shape (3,)
        Where the way begins [m, NED].
    regions : PackedRegions
        The n regions.
    far_until : ndarray, shape (n,)
        Room for the length of way until which each region is far.
    gains : DeployableGains
        Clearance wanted, margin, speed.

    Returns
    -------
    float
        [m].
    """
    enough = gains.clearance + _STRIDE[1] / _TRUST  # m, of clearance: more makes no difference
    far_until[:] = 0.0
    total, travelled, samples = 0.0, 0.0, 0
    here, point, room = zeros(3), zeros(3), zeros(3)
    for leg in range(count):
        begin = start if leg == 0 else way[leg - 1]
        length = np.sqrt((way[leg, 0] - begin[0]) ** 2 + (way[leg, 1] - begin[1]) ** 2 + (way[leg, 2] - begin[2]) ** 2)
        total += length
        s = 0.0
        while s < length:
            if samples == _SAMPLES:
                for rest in range(leg + 1, count):
                    total += (1.0 + _INSIDE) * _distance(way[rest - 1], way[rest])
                return float(total + _INSIDE * (length - s))  # what was not looked at is not trusted
            samples += 1
            gone, free = travelled + s, enough
            later = gone / gains.speed  # s
            for axis in range(3):
                here[axis] = begin[axis] + (way[leg, axis] - begin[axis]) * (s / length)
            for i in range(regions.kinds.size):
                if gone >= far_until[i] and regions.hard[i]:
                    own = 0.0  # m/s, of the region
                    for axis in range(3):
                        point[axis] = here[axis] - regions.velocities[i, axis] * later
                        own += abs(regions.velocities[i, axis])
                    if regions.kinds[i] == _SPHERE:
                        clearance = clearance_of_sphere(regions, i, point)
                    elif regions.kinds[i] < _ATTITUDE:
                        clearance = clearance_of_place(regions, i, point, room)
                    else:
                        clearance = enough
                    if clearance >= enough:
                        far_until[i] = gone + (clearance - enough) / (1.0 + own / gains.speed)
                    free = min(free, clearance)
            stride = min(max(_TRUST * (free - gains.clearance), _STRIDE[0]), _STRIDE[1], length - s + 1e-9)
            lack = gains.clearance - free
            if lack > 0.0:
                total += stride * _NEAR * (lack / gains.clearance) ** 2
                if free < gains.margin:
                    total += stride * _INSIDE * (1.0 + gains.margin - free)
            s += stride
        travelled += length
    return total


@part
def nearest_end(goal: PackedRegions, position: Array, depth: float, end: Array) -> None:
    """Write the point of the goal region nearest to a position, `depth` [m] inside where the region is that deep.

    It goes up the slope of the clearance, half as far wherever that leads little deeper: in a region that is less deep,
    to about its middle.
    """
    copy(position, end)
    value, gradient, turning, clearance = zeros(1), zeros(1, 3), zeros(1, 3), zeros(1)
    level = zeros(4)  # a goal is a place: no attitude matters
    level[0] = 1.0
    other, other_gradient, other_clearance = zeros(3), zeros(1, 3), zeros(1)
    evaluate_packed(goal, end, level, value, gradient, turning, clearance)
    part = 1.0
    for _ in range(_CLIMBS):
        slope, lack = norm(gradient[0]), depth - clearance[0]
        if not (lack > _DEEP_ENOUGH and slope > 0.0):
            return
        for axis in range(3):
            other[axis] = end[axis] - gradient[0, axis] / slope * lack * part
        evaluate_packed(goal, other, level, value, other_gradient, turning, other_clearance)
        if other_clearance[0] > clearance[0] + _PAYS * lack * part:
            copy(other, end)
            copy(other_gradient[0], gradient[0])
            clearance[0] = other_clearance[0]
            part = min(2.0 * part, 1.0)
        else:
            part *= 0.5


@part
def improve(
    guide: Guide, start: Array, goal: PackedRegions, regions: PackedRegions, gains: DeployableGains, period: float
) -> None:
    """Keep the way up with vehicle and regions, and try one change to it; once a period [s]."""
    way, other = guide.way, guide.other
    if guide.points[0] == 0:
        guide.points[0] = 1
        nearest_end(goal, start, gains.depth, way[0])
    else:
        end = guide.points[0] - 1
        for axis in range(3):  # the end moves with the goal, and is put back wherever the goal may have gone
            way[end, axis] += goal.velocities[0, axis] * period
        if not clearance_at(goal, 0, way[end]) > 0.0:
            nearest_end(goal, way[end], gains.depth, way[end])
    while guide.points[0] > 1 and _distance(way[0], start) < _PASSED:
        for i in range(guide.points[0] - 1):
            copy(way[i + 1], way[i])
        guide.points[0] -= 1
    # one way a period: the present one and a changed one by turns
    if guide.tried[0] == 0:
        guide.tried[0] = 1
        guide.cost[0] = cost_of(way, guide.points[0], start, regions, guide.far_until, gains)
        return
    guide.tried[0] = 0
    draws = guide.draws
    for i in range(draws.size):
        draws[i] = uniform(guide.random)
    if guide.cost[0] > _BLOCKED * _length(way, guide.points[0], start) and draws[4] < 0.7:
        guide.points[1] = grow(guide.tree, start, way[guide.points[0] - 1], draws, regions, gains, other)
        if guide.points[1] == 0:
            return
    else:
        _change(guide, start, goal, gains)
    cost = cost_of(other, guide.points[1], start, regions, guide.far_until, gains)
    if cost < guide.cost[0] - _BETTER - _BETTER_PART * guide.cost[0]:
        _copy_way(other, way)
        guide.points[0] = guide.points[1]
        guide.cost[0] = cost


@part
def _copy_way(way: Array, out: Array) -> None:
    for i in range(CORNERS + 1):
        copy(way[i], out[i])


@part
def _length(way: Array, count: int, start: Array) -> float:
    length = _distance(way[0], start)
    for i in range(1, count):
        length += _distance(way[i], way[i - 1])
    return float(length)


@part
def _distance(a: Array, b: Array) -> float:
    return float(np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2))


@part
def _change(guide: Guide, start: Array, goal: PackedRegions, gains: DeployableGains) -> None:
    """Write a changed way into `other`."""
    way, other, random = guide.way, guide.other, guide.random
    _copy_way(way, other)
    count = guide.points[0]
    last = count - 1
    choice = uniform(random)
    if choice < 0.1:  # straight to the nearest end
        nearest_end(goal, start if count == 1 else way[count - 2], gains.depth, other[last])
        if uniform(random) < 0.5:
            copy(other[last], other[0])
            count = 1
    elif choice < 0.2:  # another end
        reach = 0.05 + uniform(random) * 0.5
        for axis in range(3):
            other[last, axis] += reach * _spread(random)
        nearest_end(goal, other[last], gains.depth, other[last])
    elif choice < 0.3 and count > 1:  # a corner less
        drop = int(uniform(random) * last)
        for i in range(drop, last):
            copy(other[i + 1], other[i])
        count -= 1
    elif choice < 0.65 and count > 1:  # a corner moved
        moved = int(uniform(random) * last)
        reach = 0.03 * 30.0 ** uniform(random)
        for axis in range(3):
            other[moved, axis] += reach * _spread(random)
    elif choice < 0.9 and count <= CORNERS:  # a corner more, anywhere about
        at = int(uniform(random) * count)
        for i in range(count, at, -1):
            copy(other[i - 1], other[i])
        for axis in range(3):
            low = min(start[axis], way[last, axis]) - _ROOM
            high = max(start[axis], way[last, axis]) + _ROOM
            other[at, axis] = low + uniform(random) * (high - low)
        count += 1
    else:  # one corner alone, anywhere about
        copy(way[last], other[1])
        for axis in range(3):
            low = min(start[axis], way[last, axis]) - _ROOM
            high = max(start[axis], way[last, axis]) + _ROOM
            other[0, axis] = low + uniform(random) * (high - low)
        count = 2
    guide.points[1] = count
