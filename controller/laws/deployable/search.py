"""Tree search out of pockets: a tree of free straight lines that grows from the end of the path towards the vehicle.

Changing one corner at a time finds no path that needs several changes at once. So while the path is blocked, a tree
(RRT: LaValle, Planning Algorithms, 2006, ch. 5) grows by at most one node a period. Its root is the goal, so that it
stays valid while the vehicle moves. Each node connects to the farthest visible one of its ancestors, which saves
corners. When the vehicle sees a new node, the chain of its ancestors is a path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import length3, square
from controller.laws.deployable.gains import SPREADS
from controller.laws.deployable.linear_algebra import copy
from controller.regions import Sphere
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, clearance_of_place, clearance_of_sphere
from controller.stack_array import zeros

Array = NDArray[np.float64]

_SPHERE = Sphere.kind
_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on do not depend on position alone
_NODES = 512  # after which the tree starts anew
_REACH = (1.5, 0.1)  # m, longest edge; or as part of the distance from start to end, where that is more
ROOM = (3.0, 16.0)  # m beyond start and end, in which nodes are drawn: at first, and at most
_GROWS = 1.006  # that room, with each look for a node
_STRIDE = 0.05  # m, least distance between two evaluations along a line
_LOOKS = 32  # evaluations along a line at most
_ANCESTORS = 2  # tested beside its parent
_SLACK = 0.005  # m
_MOVED = 0.3  # m, by which the end may move before the tree starts anew


class PathLimits(NamedTuple):
    """What a path shall keep."""

    clearance: float  # m, of hard regions where there is room, beside the margin
    margin: float  # m, at least
    speed: float  # m/s, of the vehicle
    depth: float  # m, in the goal region at which it ends


class Tree(NamedTuple):
    """Nodes, each with its parent; the root is the end of the path."""

    nodes: Array  # (_NODES, 3) m, NED
    parents: NDArray[np.int64]  # (_NODES,)
    size: NDArray[np.int64]  # (1,) number of nodes
    room: Array  # (1,) m beyond start and end, in which nodes are drawn


def empty_tree() -> Tree:
    """Return a tree without nodes."""
    size, room = np.zeros(1, dtype=np.int64), np.array([ROOM[0]])
    return Tree(np.zeros((_NODES, 3)), np.zeros(_NODES, dtype=np.int64), size, room)


def _clearance_at(point: Array, regions: PackedRegions, gradient: Array) -> float:
    least = np.inf
    for i in range(regions.kinds.size):
        if regions.hard[i] and regions.kinds[i] < _ATTITUDE:
            if regions.kinds[i] == _SPHERE:
                clearance = clearance_of_sphere(regions, i, point)
            else:
                clearance = clearance_of_place(regions, i, point, gradient)
            least = min(least, clearance - SPREADS * regions.deviations[i])
    return least


def is_line_free(start: Array, end: Array, regions: PackedRegions, margin: float) -> bool:
    """Return whether a straight line keeps a clearance [m] of all hard regions at their present places.

    Parameters
    ----------
    start, end : ndarray, shape (3,)
        Ends of the line [m, NED].
    regions : PackedRegions
        The hard ones among them count.
    margin : float
        Clearance [m].

    Returns
    -------
    bool
        Also False if the line needs more than `_LOOKS` evaluations.
    """
    point, gradient = zeros(3), zeros(3)
    length = length3(end[0] - start[0], end[1] - start[1], end[2] - start[2])
    s = 0.0
    for _ in range(_LOOKS):
        for axis in range(3):
            point[axis] = start[axis] + (end[axis] - start[axis]) * (s / length if length > 0.0 else 0.0)
        least = _clearance_at(point, regions, gradient)
        if not least >= margin:
            return False
        if s >= length:
            return True
        s = min(length, s + max(least - margin, _STRIDE))
    return False


def limits_along(axis: int, start: Array, end: Array, room: float) -> tuple[float, float]:
    """Return within what places are drawn along an axis [m, NED]: `room` beyond both ends, but not out of the water."""
    low, high = min(start[axis], end[axis]), max(start[axis], end[axis])
    if axis == 2:
        return max(low - room, min(low, 0.0)), high + room
    return low - room, high + room


def grow_tree(
    tree: Tree,
    start: Array,
    end: Array,
    random_numbers: Array,
    regions: PackedRegions,
    limits: PathLimits,
    path: Array,
) -> int:
    """Grow the tree by at most one node, and return the number of points of a path that it found, 0 for none.

    Parameters
    ----------
    tree : Tree
        Grown in place.
    start, end : ndarray, shape (3,)
        Positions of the vehicle and of the end of the path [m, NED].
    random_numbers : ndarray, shape (4,)
        Random numbers in [0, 1).
    regions : PackedRegions
        At their present places.
    limits : PathLimits
        Clearance and margin.
    path : ndarray, shape (k, 3)
        Receives corners and end, if there are at most k.

    Returns
    -------
    int
        Points of the path.
    """
    nodes, parents = tree.nodes, tree.parents
    moved, far = 0.0, 0.0
    for axis in range(3):
        moved += square(nodes[0, axis] - end[axis])
        far += square(start[axis] - end[axis])
    tree.room[0] = min(_GROWS * tree.room[0], ROOM[1])
    if tree.size[0] == 0 or tree.size[0] == _NODES or moved > square(_MOVED):
        copy(end, nodes[0])
        parents[0] = -1
        tree.size[0] = 1
    margin = limits.margin + 0.4 * limits.clearance

    # from the nearest node towards a random point, or the vehicle
    target, new = zeros(3), zeros(3)
    for axis in range(3):
        low, high = limits_along(axis, start, end, tree.room[0])
        target[axis] = start[axis] if random_numbers[3] < 0.2 else low + random_numbers[axis] * (high - low)
    nearest, least = 0, np.inf
    for i in range(tree.size[0]):
        squared = 0.0
        for axis in range(3):
            squared += square(nodes[i, axis] - target[axis])
        if squared < least:
            nearest, least = i, squared
    distance = np.sqrt(least)
    if distance < _STRIDE:
        return 0
    for axis in range(3):
        part = min(1.0, max(_REACH[0], _REACH[1] * np.sqrt(far)) / distance)
        new[axis] = nodes[nearest, axis] + part * (target[axis] - nodes[nearest, axis])
    if not is_line_free(new, nodes[nearest], regions, margin):
        return 0

    # connect to the farthest visible ancestor
    parent = nearest
    for _ in range(_ANCESTORS):
        before = parents[parent]
        if before < 0 or not is_line_free(new, nodes[before], regions, margin):
            break
        parent = before
    at = tree.size[0]
    copy(new, nodes[at])
    parents[at] = parent
    tree.size[0] += 1

    # a path, if the vehicle sees the node; it may start closer to a region, but must not come closer
    if not is_line_free(new, start, regions, min(0.5 * margin, _clearance_at(start, regions, target) - _SLACK)):
        return 0
    count, node = 0, at
    while node >= 0:
        if count == path.shape[0]:
            return 0
        copy(nodes[node], path[count])
        count += 1
        node = parents[node]
    return count
