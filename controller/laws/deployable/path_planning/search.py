"""Tree search out of pockets: two trees of free straight lines, one from the goal and one from the vehicle."""

# Changing one corner at a time finds no path that needs several changes at once. So while the path is blocked, two
# trees (RRT-Connect: Kuffner and LaValle, ICRA 2000) grow in turn, by at most one node per call. A new node connects to
# the farthest visible one of its ancestors, which saves corners. When it sees the nearest node of the other tree, the
# two chains are a path. The tree of the vehicle gets a new root as the vehicle moves.

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.laws.deployable.gains import SPREADS
from controller.linear_algebra import norm
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import PackedRegions, clearance_at
from controller.stack_array import Array, Rows3, Shape, Vector3
from controller.state import State

_ATTITUDE = FIRST_OF_ATTITUDE  # first kind of region that depends on attitude
_NODES = 512  # number of nodes at which a tree restarts
_CHAIN = 64  # maximum number of points of a path before it is shortened
_REACH = (1.5, 0.1)  # longest edge: length [m]; fraction of the distance from start to end, if that is longer
SAMPLING_MARGIN = (3.0, 32.0)  # m beyond start and end within which random nodes lie: at first; greatest
_GROWS = 1.003  # factor by which that distance grows with each call
_STRIDE = 0.05  # m, minimum distance between two evaluations along a line
_LINE_SAMPLES = 32  # maximum number of evaluations along a line
_ANCESTORS = 2  # number of ancestors tested as parents of a new node, besides the nearest node
_SLACK = 0.005  # m by which edges from a root may be closer to hard regions than the root
_MOVED = 0.3  # m, motion of start or end above which its tree gets a new root; also the shortest edge before a wall
_TO_OTHER = 0.2  # probability that a tree grows towards the root of the other one
_NEAR_A_NODE = 0.4  # probability that it grows towards a point near one of its nodes, for narrow passages
_ALL = 1.0 - 1e-9  # fraction of a line that counts as all of it, to allow for rounding
_BEFORE_A_WALL = 0.8  # fraction of the free length of a blocked line at which a node is placed


Nodes = Annotated[Array, Shape(_NODES, 3)]
Numbers5 = Annotated[Array, Shape(5)]
Chain = Annotated[Array, Shape(_CHAIN, 3)]
Parents = Annotated[NDArray[np.int64], Shape(_NODES)]


class PathLimits(NamedTuple):
    """Requirements of a path."""

    clearance: float  # m, desired clearance of hard regions
    margin: float  # m, minimum clearance of hard regions
    speed: float  # m/s, speed of the vehicle
    depth: float  # m, depth in the goal region at which the path ends


def line_margin(limits: PathLimits) -> float:
    """Return the clearance [m] of the trees' edges; a greater one would close narrow passages."""
    return limits.margin + 0.4 * limits.clearance


class Tree(State):
    """Nodes, each with its parent."""

    nodes: Nodes  # m, NED
    parents: Parents  # index of each node's parent; -1 for the root
    size: int  # number of nodes
    root: int  # index of the root


class Search(State):
    """State of the search."""

    of_goal: Tree  # root at the end of the path
    of_vehicle: Tree  # root at the vehicle
    turn: int  # 0: the tree of the goal grows next, 1: that of the vehicle
    sampling_margin: float = SAMPLING_MARGIN[0]  # m beyond start and end within which random nodes lie
    chain: Chain  # m, NED: the last path found, before it is shortened


def uncertainty(regions: PackedRegions, i: int) -> float:
    """Return the uncertainty [m] of region `i`'s position, `SPREADS` times its greatest standard deviation."""
    deviations = regions.deviations
    return float(SPREADS * max(deviations[i, 0], deviations[i, 1], deviations[i, 2]))


def clearance_of_all(point: Vector3, regions: PackedRegions) -> float:
    """Return the minimum clearance [m] of the hard regions of position at a point."""
    min_clearance = np.inf
    for i in range(regions.kinds.size):
        if regions.hard[i] and regions.kinds[i] < _ATTITUDE:
            min_clearance = min(min_clearance, clearance_at(regions, i, point) - uncertainty(regions, i))
    return min_clearance


def free_length(start: Vector3, end: Vector3, regions: PackedRegions, margin: float) -> float:
    """Return the length to which a line keeps a clearance of all hard regions at their present positions."""
    # Units of arguments and result: start, end [m, NED]; margin [m]; result [m]
    length, s, free = norm(end - start), 0.0, -1.0
    for _ in range(_LINE_SAMPLES):
        point = start + (end - start) * (s / length if length > 0.0 else 0.0)
        clearance = clearance_of_all(point, regions)
        if not clearance >= margin:
            return float(free)
        if s >= length:
            return float(length)
        free = min(length, s + clearance - margin)
        s = min(length, s + max(clearance - margin, _STRIDE))
    return float(min(free, s))


def is_line_free(start: Vector3, end: Vector3, regions: PackedRegions, margin: float) -> bool:
    """Return True if a straight line keeps a clearance over its whole length, by `free_length`."""
    return free_length(start, end, regions, margin) >= norm(end - start)


def sample_point(start: Vector3, end: Vector3, margin: float, fractions: Vector3) -> Vector3:
    """Return a point [m, NED] of the box about start and end: `margin` beyond both, but below the surface."""
    low, high = np.minimum(start, end) - margin, np.maximum(start, end) + margin
    low[2] = max(low[2], min(start[2], end[2], 0.0))
    return low + fractions * (high - low)


def look_for_path(
    search: Search,
    start: Vector3,
    end: Vector3,
    random_numbers: Numbers5,
    regions: PackedRegions,
    limits: PathLimits,
    path: Rows3,
) -> int:
    """Grow one of the trees by at most one node; return the number of points of a path if one is found, else 0."""
    # Units of arguments: start, end [m, NED]
    margin, of_goal, of_vehicle = line_margin(limits), search.of_goal, search.of_vehicle
    if clearance_of_all(end, regions) < 0.0:  # no path leads there
        return 0
    move_root(of_goal, end, regions, margin)
    move_root(of_vehicle, start, regions, margin)
    search.sampling_margin = min(_GROWS * search.sampling_margin, SAMPLING_MARGIN[1])
    reach = max(_REACH[0], _REACH[1] * norm(start - end))
    from_goal = search.turn == 0
    search.turn = 1 - search.turn
    tree, other = (of_goal, of_vehicle) if from_goal else (of_vehicle, of_goal)
    target = _draw_target(tree, start, end, from_goal, search.sampling_margin, reach, random_numbers)
    grown = extend_tree(tree, target, reach, regions, margin)
    if grown < 0:
        return 0
    met = nearest_node(other, tree.nodes[grown])
    if not _sees(other, met, tree.nodes[grown], regions, margin):
        return 0
    node_of_goal, node_of_vehicle = (grown, met) if from_goal else (met, grown)
    return _write_path(search, node_of_goal, node_of_vehicle, start, regions, margin, path)


def _draw_target(
    tree: Tree,
    start: Vector3,
    end: Vector3,
    from_goal: bool,
    sampling_margin: float,
    reach: float,
    random_numbers: Numbers5,
) -> Vector3:
    """Return the point towards which a tree grows: the other tree's root, a point near a node, or any point."""
    if random_numbers[3] < _TO_OTHER:
        return start.copy() if from_goal else end.copy()
    if random_numbers[3] < _TO_OTHER + _NEAR_A_NODE:
        node = int(random_numbers[4] * tree.size)
        near: Vector3 = tree.nodes[node] + reach * (2.0 * random_numbers[:3] - 1.0)
        return near
    return sample_point(start, end, sampling_margin, random_numbers[:3])


def move_root(tree: Tree, point: Vector3, regions: PackedRegions, margin: float) -> None:
    """Set the root of a tree to a point: add it if its line to the old root is free, else restart the tree."""
    nodes, parents, root = tree.nodes, tree.parents, tree.root
    if tree.size > 0:
        distance = norm(nodes[root] - point)
        if tree.size < _NODES and distance <= _MOVED:
            return
        root_margin = min(_margin_at(tree, root, regions, margin), clearance_of_all(point, regions) - _SLACK)
        if tree.size < _NODES and is_line_free(nodes[root], point, regions, root_margin):
            new = tree.size
            nodes[new], parents[new], parents[root], tree.root = point, -1, new, new
            tree.size += 1
            return
    nodes[0], parents[0], tree.size, tree.root = point, -1, 1, 0


def _sees(tree: Tree, node: int, place: Vector3, regions: PackedRegions, margin: float) -> bool:
    """Return True if the line from a node to a point keeps the clearance `_margin_at` of the node."""
    return is_line_free(tree.nodes[node], place, regions, _margin_at(tree, node, regions, margin))


def _margin_at(tree: Tree, node: int, regions: PackedRegions, margin: float) -> float:
    """Return the clearance [m] required of lines from a node: a root may be closer, its lines not closer than it."""
    if node != tree.root:
        return margin
    return min(margin, clearance_of_all(tree.nodes[node], regions) - _SLACK)


def nearest_node(tree: Tree, place: Vector3) -> int:
    """Return the index of a tree's node nearest to a point [m, NED]."""
    nearest, least = 0, np.inf
    for i in range(tree.size):
        squared = np.sum((tree.nodes[i] - place) ** 2)
        if squared < least:
            nearest, least = i, squared
    return nearest


def extend_tree(tree: Tree, target: Vector3, reach: float, regions: PackedRegions, margin: float) -> int:
    """Add a node on the line from the nearest node to a target, and return its index; -1 if the line is blocked."""
    # `reach` is the longest edge, and `margin` the clearance of edges, both in m.
    nodes, parents = tree.nodes, tree.parents
    nearest = nearest_node(tree, target)
    before = nodes[nearest]
    distance = norm(target - before)
    if distance < _STRIDE:
        return -1
    length = min(reach, distance)
    new = before + length / distance * (target - before)
    free = free_length(before, new, regions, _margin_at(tree, nearest, regions, margin))
    if free < _ALL * length:
        free *= _BEFORE_A_WALL
        if free < _MOVED:
            return -1
        new[:] = before + free / distance * (target - before)
    parent = nearest
    for _ in range(_ANCESTORS):
        ancestor = parents[parent]
        if ancestor < 0 or not _sees(tree, ancestor, new, regions, margin):
            break
        parent = ancestor
    index = tree.size
    nodes[index] = new
    parents[index] = parent
    tree.size += 1
    return int(index)


def _write_path(
    search: Search, of_goal: int, of_vehicle: int, start: Vector3, regions: PackedRegions, margin: float, path: Rows3
) -> int:
    """Write the path through two nodes with a free line between them, without redundant corners."""
    # A corner is redundant if the line from the one before it, or from the `start`, to the one after it is free. Return
    # the number of points, 0 if there are too many.
    chain, tree = search.chain, search.of_vehicle
    count, node = 0, of_vehicle
    while node != tree.root:
        count, node = count + 1, tree.parents[node]
    length = count
    if length >= _CHAIN:
        return 0
    node = of_vehicle
    while count > 0:
        count -= 1
        chain[count] = tree.nodes[node]
        node = tree.parents[node]
    node = of_goal
    while node >= 0:
        if length == _CHAIN:
            return 0
        chain[length] = search.of_goal.nodes[node]
        length, node = length + 1, search.of_goal.parents[node]
    leg_margin = min(margin, clearance_of_all(start, regions) - _SLACK)
    before, count = start, 0
    for i in range(length):
        if i + 1 < length and is_line_free(before, chain[i + 1], regions, leg_margin):
            continue
        if count == path.shape[0]:
            return 0
        path[count] = chain[i]
        before, leg_margin, count = path[count], margin, count + 1
    return count
