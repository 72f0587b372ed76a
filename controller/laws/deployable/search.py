"""The way out of pockets: a tree of free straight lines that grows from the end of the way towards the vehicle.

Changing one corner at a time finds no way that needs several at once. So while the way is blocked, a tree in the manner
of LaValle's RRT (Planning Algorithms, 2006, ch. 5) grows by one node a period at most, from the goal outwards, so that
it stays good while the vehicle moves. Each node holds on to the farthest of its ancestors that it sees, which saves
corners. When the vehicle sees a new node, the chain of its ancestors is a way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.jit.jit import inlined, part
from controller.jit.stack_array import zeros
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.linear_algebra import copy
from controller.regions import Sphere
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, clearance_of_place, clearance_of_sphere

Array = NDArray[np.float64]

_SPHERE = Sphere.kind
_ATTITUDE = FIRST_OF_ATTITUDE  # shapes from it on close no place
_NODES = 256  # after which the tree is grown anew
_REACH = 1.5  # m, that a node is from the one it grows from at most
_ROOM = 3.0  # m beyond start and end in which nodes are looked for
_STRIDE = 0.05  # m, least distance between two looks along a line
_LOOKS = 32  # along a line at most
_ANCESTORS = 2  # that a new node looks at beyond its own
_SLACK = 0.005  # m
_MOVED = 0.3  # m, that the end may move before the tree is grown anew


class Tree(NamedTuple):
    """Nodes, each with the one it leads to; the first is the end of the way."""

    nodes: Array  # (_NODES, 3) m, NED
    parents: NDArray[np.int64]  # (_NODES,)
    size: NDArray[np.int64]  # (1,) nodes that there are


def tree_of_nothing() -> Tree:
    """Return a tree that has not begun."""
    return Tree(np.zeros((_NODES, 3)), np.zeros(_NODES, dtype=np.int64), np.zeros(1, dtype=np.int64))


@inlined
def _room_at(point: Array, regions: PackedRegions, room: Array) -> float:
    least = np.inf
    for i in range(regions.kinds.size):
        if regions.hard[i] and regions.kinds[i] < _ATTITUDE:
            if regions.kinds[i] == _SPHERE:
                clearance = clearance_of_sphere(regions, i, point)
            else:
                clearance = clearance_of_place(regions, i, point, room)
            least = min(least, clearance)
    return least


@part
def is_free(begin: Array, end: Array, regions: PackedRegions, wanted: float) -> bool:
    """Return whether a straight line keeps a clearance [m] of all hard regions, where they are now.

    Parameters
    ----------
    begin, end : ndarray, shape (3,)
        Ends of the line [m, NED].
    regions : PackedRegions
        The hard ones among them count.
    wanted : float
        Clearance [m].

    Returns
    -------
    bool
        False too if the line is too long to be looked at.
    """
    point, room = zeros(3), zeros(3)
    length = np.sqrt((end[0] - begin[0]) ** 2 + (end[1] - begin[1]) ** 2 + (end[2] - begin[2]) ** 2)
    s = 0.0
    for _ in range(_LOOKS):
        for axis in range(3):
            point[axis] = begin[axis] + (end[axis] - begin[axis]) * (s / length if length > 0.0 else 0.0)
        least = _room_at(point, regions, room)
        if not least >= wanted:
            return False
        if s >= length:
            return True
        s = min(length, s + max(least - wanted, _STRIDE))
    return False


@part
def grow(
    tree: Tree, start: Array, end: Array, draws: Array, regions: PackedRegions, gains: DeployableGains, way: Array
) -> int:
    """Grow the tree by one node at most, and return how many points a way has that it found, 0 for none.

    Parameters
    ----------
    tree : Tree
        Grown in place.
    start, end : ndarray, shape (3,)
        Where the vehicle is, and the end of the way [m, NED].
    draws : ndarray, shape (4,)
        Random numbers in [0, 1).
    regions : PackedRegions
        The regions.
    gains : DeployableGains
        Clearance and margin.
    way : ndarray, shape (k, 3)
        Receives corners and end, if they are no more than k.

    Returns
    -------
    int
        Points of the way.
    """
    nodes, parents = tree.nodes, tree.parents
    moved = 0.0
    for axis in range(3):
        moved += (nodes[0, axis] - end[axis]) ** 2
    if tree.size[0] == 0 or tree.size[0] == _NODES or moved > _MOVED**2:
        copy(end, nodes[0])
        parents[0] = -1
        tree.size[0] = 1
    wanted = gains.margin + 0.4 * gains.clearance

    # towards a point anywhere about, or the vehicle; from the nearest node
    target, new = zeros(3), zeros(3)
    for axis in range(3):
        low, high = min(start[axis], end[axis]) - _ROOM, max(start[axis], end[axis]) + _ROOM
        target[axis] = start[axis] if draws[3] < 0.2 else low + draws[axis] * (high - low)
    nearest, least = 0, np.inf
    for i in range(tree.size[0]):
        square = 0.0
        for axis in range(3):
            square += (nodes[i, axis] - target[axis]) ** 2
        if square < least:
            nearest, least = i, square
    distance = np.sqrt(least)
    if distance < _STRIDE:
        return 0
    for axis in range(3):
        part = min(1.0, _REACH / distance)
        new[axis] = nodes[nearest, axis] + part * (target[axis] - nodes[nearest, axis])
    if not is_free(new, nodes[nearest], regions, wanted):
        return 0

    # hold on to the farthest ancestor in sight
    parent = nearest
    for _ in range(_ANCESTORS):
        before = parents[parent]
        if before < 0 or not is_free(new, nodes[before], regions, wanted):
            break
        parent = before
    at = tree.size[0]
    copy(new, nodes[at])
    parents[at] = parent
    tree.size[0] += 1

    # the way, if the vehicle sees the node; it may be closer to a region itself, but no closer on the way
    if not is_free(new, start, regions, min(0.5 * wanted, _room_at(start, regions, target) - _SLACK)):
        return 0
    count, node = 0, at
    while node >= 0:
        if count == way.shape[0]:
            return 0
        copy(nodes[node], way[count])
        count += 1
        node = parents[node]
    return count
