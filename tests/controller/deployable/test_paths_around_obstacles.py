"""The way round against a plain transcription of its cost and of its search, step by step."""

import numpy as np
import pytest

from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planning import planner as way_round
from controller.laws.deployable.path_planning import search
from controller.laws.deployable.path_planning.cost import PathCost, add_cost, begin_cost
from controller.laws.deployable.path_planning.planner import (
    CORNERS,
    empty_plan,
    improve_path,
    is_blocked,
    nearest_goal_point,
    uniform,
)
from controller.regions import Box, DepthBand, HalfSpace, Orientation, Region, Sphere, pack
from controller.regions.region_set import clearance_at

# of the generator of random numbers, on purpose
pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")

GAINS = DeployableGains()
START = np.array([0.0, 0.2, 2.5])
REGIONS = [
    Region("ball", Sphere((3.0, 0.1, 2.4), 0.9), "out", (0.02, -0.05, 0.01)),
    Region("box", Box((5.0, -0.8, 2.6), (1.0, 1.5, 3.0)), "out", (-0.03, 0.0, 0.02)),
    Region("band", DepthBand(3.0, 2.5), "in"),
    Region("soft", Sphere((6.0, 1.0, 2.5), 0.8), "out", (0.0, 0.03, 0.0), hard=False),
    Region("face", Orientation((1.0, 0.0, 0.0, 0.0), 0.1), "in"),
]
GOAL = Region("goal", Sphere((8.0, 0.5, 2.5), 0.5), "in")
PLACES = [0, 1, 2]  # hard regions of place


def clearance(packed, point, later=0.0, regions=PLACES):
    """Return the least clearance of hard regions of place, each where it will be, less three deviations."""
    return min(
        (clearance_at(packed, i, point - packed.velocities[i] * later) - 3.0 * packed.deviations[i].max())
        for i in regions
    )


def soft_clearance(packed, point, later=0.0):
    return clearance_at(packed, 3, point - packed.velocities[3] * later)


def price(depth, away=0.0):
    """Return what a soft region costs beside its own price: by its depth, and half a meter for being entered."""
    return max(depth, 0.0) + 0.5 * np.clip((depth + away) / 0.2, 0.0, 1.0)


def near_price(free, gains=GAINS):
    """Return what a meter costs at a clearance of hard regions."""
    deep, lack = max(gains.margin - free, 0.0), max(gains.clearance - free, 0.0)
    return 3.0 * (lack / gains.clearance) ** 2 + 200.0 * (min(deep / 0.1, 1.0) + deep)


def expected_stay(end, packed, drift):
    """Look at the end now; if it drifts, also at hard regions, and a second, three and nine seconds later."""
    drifts, prices = np.any(drift), []
    for later in (0.0, 1.0, 3.0, 9.0) if drifts else (0.0,):
        place = end + np.asarray(drift) * later
        soft = packed.crossing_costs[3] * price(-soft_clearance(packed, place, later), 0.05)
        prices.append(soft + drifts * near_price(clearance(packed, place, later)))
    return 3.0 * np.mean(prices)


def is_fast(packed, i, gains):
    return np.linalg.norm(packed.velocities[i]) > 0.25 * gains.speed


def expected_rest(place, packed, arrival, gains):
    """Look at each fast region from the arrival to 8 s from now, at least each half second."""
    free = gains.clearance
    for i in (i for i in PLACES if is_fast(packed, i, gains)):
        later, speed = arrival, np.linalg.norm(packed.velocities[i])
        while later < 8.0:
            near = clearance(packed, place, later, [i])
            free, later = min(free, near), later + max((near - gains.clearance) / speed, 0.5)
    return 3.0 * near_price(free, gains)


def expected_cost(points, packed, gains=GAINS, drift=(0.0, 0.0, 0.0), waits=False):
    """Look at all regions at each stride. Return the cost; what hard regions add, soft ones, hard ones at a stay."""
    points = np.asarray(points)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    enough, total, penalty, through, samples = gains.clearance + 3.0 / 0.7, lengths.sum(), 0.0, 0.0, 0
    stay, met = expected_stay(points[-1], packed, drift), 0.0
    if waits or not np.any(drift):
        place, until = (points[1], lengths[0]) if waits else (points[-1], lengths.sum())
        met = expected_rest(place, packed, until / gains.speed, gains)
    stay += met + 0.5 * waits
    for leg, length in enumerate(lengths):
        s, ahead = 0.0, [i for i in PLACES if not (waits and leg and is_fast(packed, i, gains))]
        while s < length:
            if samples == 512:
                penalty += 200.0 * (length - s + lengths[leg + 1 :].sum())
                return total + penalty + through + stay, penalty, through, met
            samples += 1
            gone = lengths[:leg].sum() + s
            at = points[leg] + (points[leg + 1] - points[leg]) * s / length
            free = min(enough, clearance(packed, at, gone / gains.speed, ahead)) if ahead else enough
            soft = soft_clearance(packed, at, gone / gains.speed)
            room = min(3.0, max(0.25, abs(soft)))
            stride = max(0.7 * (free - gains.clearance), 0.5 * (free - gains.margin), 0.08)
            stride = min(stride, room, length - s + 1e-9)
            through += stride * packed.crossing_costs[3] * price(-soft)
            penalty += stride * near_price(free)
            s += stride
    return total + penalty + through + stay, penalty, through, met


def cost_of(way, count, packed, start=START, most=np.inf, drift=(0.0, 0.0, 0.0), waits=False):
    """Return what the planner makes of a way, and in how many calls."""
    cost, calls = PathCost(n=packed.kinds.size), 1
    begin_cost(cost, start, np.array(drift), waits)
    while not add_cost(cost, way, count, packed, GAINS, most):
        calls += 1
    return cost.cost, calls


def random_way(rng, reach=1.0):
    way, count = np.zeros((CORNERS + 1, 3)), int(rng.integers(1, 5))
    way[:count] = rng.normal([4.0, 0.0, 2.5], np.array([3.0, 1.5, 1.0]) * reach, size=(count, 3))
    return way, count


@pytest.mark.medium
def test_path_cost_matches_dense_evaluation():
    rng, packed, dear, long, soft, calls = np.random.default_rng(1), pack(REGIONS), 0, 0, 0, []
    for k in range(60):
        way, count = random_way(rng, 20.0 if k % 6 == 0 else 1.0)
        packed.move_to(0.1 * k)
        packed.velocities[:3] = rng.normal(size=(3, 3)) * rng.choice([0.05, 0.4])
        packed.deviations[:3] = rng.uniform(0.0, 0.05, size=(3, 3))
        packed.crossing_costs[3] = rng.uniform(0.2, 10.0)
        drift = rng.normal(0.0, 0.2, 3) * (k % 2)
        waits = k % 3 == 0
        expected, penalty, through, met = expected_cost([START, *way[:count]], packed, drift=drift, waits=waits)
        found, took = cost_of(way, count, packed, drift=drift, waits=waits)
        assert found == pytest.approx([expected, penalty, through, met], rel=1e-9)
        calls.append(took)
        length = np.linalg.norm(np.diff([START, *way[:count]], axis=0), axis=1).sum()
        dear, long = dear + (penalty > 0.2 * length), long + (penalty > 50.0 * length)
        soft += through > 0.1
    assert dear > 20 and long > 1 and soft > 3 and min(calls) == 1 and max(calls) > 1


def test_approaching_region_is_evaluated_before_the_path_meets_it():
    """Head-on, at half the vehicle's speed, from 23 m."""
    packed, start, way = pack(REGIONS), np.array([-20.0, 0.2, 2.4]), np.zeros((CORNERS + 1, 3))
    packed.velocities[:], way[0] = 0.0, (2.0, 0.2, 2.4)
    packed.velocities[0, 0] = -0.5 * GAINS.speed
    expected = expected_cost([start, way[0]], packed)
    assert expected[1] > 10.0
    assert cost_of(way, 1, packed, start)[0] == pytest.approx(expected, rel=1e-9)


def test_evaluation_of_a_too_costly_path_stops_early():
    wall = pack([Region("wall", Box((2.0, 0.0, 2.5), (1.0, 9.0, 9.0)), "out")])
    way = np.zeros((CORNERS + 1, 3))
    way[0], way[1] = (4.0, 0.2, 2.5), (-900.0, 0.2, 2.5)
    most = 50.0
    assert most < cost_of(way, 2, wall, most=most)[0][0] < 300.0 < cost_of(way, 2, wall)[0][0]


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(("begins", "inside"), [(4.8, 0.05), (5.18, 0.02), (5.3, -0.1)])
@pytest.mark.parametrize("cost", [0.4, 2.0, 10.0])
def test_path_end_keeps_a_margin_inside_a_soft_keep_in_region(begins, inside, cost):
    """Ends lie up to 1.2 m from the goal's middle; north of a plane lies a region to be kept in."""
    goal, plan = pack([Region("goal", Sphere((4.0, 0.0, 2.5), 1.5), "in")]), empty_plan(1, 1)
    beyond = HalfSpace((begins, 0.0, 0.0), (-1.0, 0.0, 0.0))
    packed = pack([Region("beyond", beyond, "in", hard=False, crossing_cost=cost)])
    for k in range(1500):
        improve_path(plan, np.array([min(0.02 * k, begins), 0.0, 2.5]), goal, packed, GAINS, 0.02)
    assert inside - 0.025 < clearance_at(packed, 0, plan.path[plan.points - 1]) < inside + 0.1


@pytest.mark.medium
def test_search_prefers_cheap_regions():
    """A wall has a door, and ends; a region lies in the door, another one beside the wall: the cheap one is passed."""
    start, goal = np.array([0.0, 0.0, 2.5]), pack([GOAL])
    scene = [
        Region("door", Box((4.0, 0.0, 2.5), (2.0, 2.0, 40.0)), "out", hard=False),
        Region("left", Box((4.0, -10.5, 2.5), (1.0, 19.0, 40.0)), "out"),
        Region("right", Box((4.0, 3.0, 2.5), (1.0, 4.0, 40.0)), "out"),
        Region("beside", Box((4.0, 15.0, 2.5), (2.0, 20.0, 40.0)), "out", hard=False),
    ]
    ends = {}
    for costs in ((20.0, 0.2), (0.2, 20.0)):
        packed, plan = pack(scene), empty_plan(len(scene), 1)
        packed.crossing_costs[[0, 3]] = costs
        for _ in range(1500):
            improve_path(plan, start, goal, packed, GAINS, 0.02)
        points = np.array([start, *plan.path[: plan.points]])
        (leg,) = (i for i in range(len(points) - 1) if points[i, 0] <= 4.0 < points[i + 1, 0])
        fraction = (4.0 - points[leg, 0]) / (points[leg + 1, 0] - points[leg, 0])
        ends[costs] = points[leg, 1] + fraction * (points[leg + 1, 1] - points[leg, 1])
    assert 5.0 < ends[20.0, 0.2] < 8.0 and -1.0 < ends[0.2, 20.0] < 1.0


def test_nearest_goal_point_follows_the_gradient():
    rng, end = np.random.default_rng(2), np.empty(3)
    for goal, depth in ((GOAL, 0.3), (Region("goal", Box((8.0, 0.5, 2.5), (2.0, 2.0, 2.0)), "in"), 0.3)):
        packed = pack([goal])
        for _ in range(20):
            at = np.array([4.0, *rng.uniform([0.0, 2.0], [1.0, 3.0])])
            nearest_goal_point(packed, at, depth, end)
            assert clearance_at(packed, 0, end) == pytest.approx(depth, abs=2e-3)
            from_center = end - [8.0, 0.5, 2.5]
            if goal is GOAL:
                assert from_center == pytest.approx(0.2 * (at - end + from_center) / np.linalg.norm(at - [8, 0.5, 2.5]))
            else:
                assert from_center == pytest.approx([-0.7, *(at[1:] - [0.5, 2.5])], abs=1e-9)


def test_line_check_matches_dense_sampling():
    rng, packed, said = np.random.default_rng(3), pack(REGIONS), []
    packed.deviations[:3] = 0.02 * np.eye(3)
    for _ in range(200):
        a, b = rng.normal([4.0, 0.0, 2.5], [1.5, 1.0, 0.7], size=(2, 3))
        least = min(clearance(packed, a + (b - a) * s) for s in np.linspace(0.0, 1.0, 60))
        if abs(least - 0.13) > 0.03:  # else a look may step over it
            said.append(search.is_line_free(a, b, packed, 0.13))
            assert said[-1] == (least > 0.13)
    assert 20 < sum(said) < len(said) - 20
    assert search.is_line_free(START, START, packed, 0.1)


def test_free_length_ends_before_a_wall():
    wall = pack([Region("wall", Box((5.0, 0.0, 2.5), (2.0, 9.0, 9.0)), "out")])
    begin, end = np.array([0.0, 0.0, 2.5]), np.array([8.0, 0.0, 2.5])
    assert 3.8 < search.free_length(begin, end, wall, 0.13) <= 4.0 - 0.13
    assert search.free_length(np.array([4.0, 0.0, 2.5]), end, wall, 0.13) == -1.0
    assert search.free_length(begin, np.array([3.0, 0.0, 2.5]), wall, 0.13) == 3.0


def looks(state, start, end, packed, number, rng, way):
    """Look for a path a number of times; return the points of those that were found."""
    return [search.look_for_path(state, start, end, rng.uniform(size=5), packed, GAINS, way) for _ in range(number)]


def test_search_starts_and_ends_closer_to_a_region_than_the_line_margin():
    balls = [Region("ball", Sphere((4.0, 0.2, 2.4), 0.7), "out"), Region("other", Sphere((-2.0, 0.9, 2.4), 0.6), "out")]
    start, end = np.array([3.26, 0.2, 2.4]), np.array([-2.0, 0.24, 2.4])  # 0.04 m and 0.06 m away
    way = np.zeros((9, 3))
    assert max(looks(search.Search(), start, end, pack(balls), 40, np.random.default_rng(0), way)) > 0


def limits(start, end, room):
    """Return the corners of the box in which places are drawn: not out of the water."""
    low, high = np.minimum(start, end), np.maximum(start, end)
    return np.r_[low[:2] - room, max(low[2] - room, min(low[2], 0.0))], high + room


class Tree:
    """`search.Tree`, and what is done with it."""

    def __init__(self, packed, place):
        self.packed, self.nodes, self.parents, self.root = packed, [place], [-1], 0

    def margin(self, node):
        """Return the clearance asked of lines from a node."""
        return min(MARGIN, clearance(self.packed, self.nodes[node]) - 0.005) if node == self.root else MARGIN

    def nearest(self, place):
        return int(np.linalg.norm(np.array(self.nodes) - place, axis=1).argmin())

    def sees(self, node, place):
        return search.is_line_free(self.nodes[node], place, self.packed, self.margin(node))

    def follow(self, place):
        """Return the tree with another root."""
        if np.linalg.norm(self.nodes[self.root] - place) <= 0.3:
            return self
        least = min(self.margin(self.root), clearance(self.packed, place) - 0.005)
        if not search.is_line_free(self.nodes[self.root], place, self.packed, least):
            return Tree(self.packed, place)
        self.nodes.append(place)
        self.parents[self.root], self.root = len(self.nodes) - 1, len(self.nodes) - 1
        self.parents.append(-1)
        return self

    def grow(self, target, reach):
        nearest = self.nearest(target)
        before = self.nodes[nearest]
        distance = np.linalg.norm(target - before)
        if distance < 0.05:
            return None
        length = min(reach, distance)
        new = before + (target - before) * length / distance
        free = search.free_length(before, new, self.packed, self.margin(nearest))
        if free < length - 1e-9:
            if 0.8 * free < 0.3:
                return None
            new = before + (target - before) * 0.8 * free / distance
        parent = nearest
        for _ in range(2):
            if self.parents[parent] < 0 or not self.sees(self.parents[parent], new):
                break
            parent = self.parents[parent]
        self.nodes.append(new)
        self.parents.append(parent)
        return len(self.nodes) - 1

    def chain(self, node):
        found = []
        while node >= 0:
            found.append(self.nodes[node])
            node = self.parents[node]
        return found

    def check(self, tree):
        """Compare it with the one that the search made."""
        assert tree.size == len(self.nodes) and tree.root == self.root
        np.testing.assert_allclose(tree.nodes[: len(self.nodes)], self.nodes, rtol=1e-12, atol=1e-12)
        assert tree.parents[: len(self.nodes)].tolist() == self.parents


MARGIN = 0.03 + 0.4 * 0.25  # m, of lines


def shortened(start, points, packed):
    """Return the points without those between two that see each other."""
    kept, before, least = [], start, min(MARGIN, clearance(packed, start) - 0.005)
    for i, point in enumerate(points):
        if i + 1 < len(points) and search.is_line_free(before, points[i + 1], packed, least):
            continue
        kept.append(point)
        before, least = point, MARGIN
    return kept


def walk(seed, packed, steps, end):
    """Search beside a transcription of it, and return the points of paths found."""
    rng, state, way, found = np.random.default_rng(seed), search.Search(), np.zeros((9, 3)), []
    start, end, room, trees = START.copy(), np.array(end), 3.0, []
    for k in range(steps):
        if k % 40 == 39:
            start = start + rng.normal(size=3) * [0.3, 0.3, 0.1]
            end = end + rng.normal(size=3) * [0.2, 0.2, 0.1]
        draws = rng.uniform(size=5)
        count = search.look_for_path(state, start, end, draws, packed, GAINS, way)
        trees = trees or [Tree(packed, end), Tree(packed, start)]
        trees = [tree.follow(place) for tree, place in zip(trees, (end, start), strict=True)]
        room = min(1.003 * room, 32.0)
        reach = max(1.5, 0.1 * np.linalg.norm(start - end))
        one, other = trees if k % 2 == 0 else trees[::-1]
        low, high = limits(start, end, room)
        target = low + draws[:3] * (high - low)
        if draws[3] < 0.2:
            target = (start, end)[k % 2]
        elif draws[3] < 0.6:
            target = one.nodes[int(draws[4] * len(one.nodes))] + reach * (2.0 * draws[:3] - 1.0)
        expected, new = [], one.grow(target, reach)
        if new is not None and other.sees(met := other.nearest(one.nodes[new]), one.nodes[new]):
            of_goal, of_vehicle = (new, met) if k % 2 == 0 else (met, new)
            points = trees[1].chain(of_vehicle)[-2::-1] + trees[0].chain(of_goal)
            expected = shortened(start, points, packed)
        trees[0].check(state.of_goal)
        trees[1].check(state.of_vehicle)
        assert count == (len(expected) if len(expected) <= 9 else 0)
        np.testing.assert_allclose(way[:count], np.reshape(expected[:count], (-1, 3)), rtol=1e-12, atol=1e-12)
        found.append(count)
    return found


@pytest.mark.medium
@pytest.mark.parametrize(
    ("steps", "end", "points", "misses"), [(240, (8.0, 0.5, 2.5), 3, 21), (60, (20.0, 9.0, 4.5), 1, 1)]
)  # with longer edges
def test_search_matches_the_reference_transcription(steps, end, points, misses):
    found = walk(4, pack(REGIONS), steps, end)
    assert max(found) >= points and found.count(0) >= misses


def test_root_closer_to_a_region_than_the_line_margin_keeps_its_tree():
    wall, tree = (
        pack([Region("wall", HalfSpace((4.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in")]),
        search.Search().of_goal,
    )
    for x in (0.0, 3.94):
        search.move_root(tree, np.array([x, 0.2, 2.5]), wall, MARGIN)
    assert (tree.size, tree.root) == (2, 1) and tree.parents[:2].tolist() == [1, -1]
    assert tree.nodes[:2, 0].tolist() == [0.0, 3.94]


def test_corner_is_dropped_even_where_the_path_starts_closer_than_the_line_margin():
    wall, state = pack([Region("wall", HalfSpace((4.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in")]), search.Search()
    start, way = np.array([3.94, 0.2, 2.5]), np.zeros((9, 3))
    for tree, places in ((state.of_vehicle, (3.94, 3.0)), (state.of_goal, (1.0,))):
        tree.size, tree.parents[: len(places)] = len(places), range(-1, len(places) - 1)
        tree.nodes[: len(places)] = [(x, 0.2, 2.5) for x in places]
    assert search._write_path(state, 0, 1, start, wall, MARGIN, way) == 1
    assert way[0].tolist() == [1.0, 0.2, 2.5]


def test_soft_regions_costlier_than_their_mean_are_closed_before_all_are():
    """Of costs 1, 6 and 2, the mean is 3; the hard region is closed at any time."""
    soft = [Region(f"soft {k}", Sphere((4.0, 3.0 * k, 2.5), 0.5), "out", hard=False) for k in range(3)]
    packed, plan = pack([*soft[:1], REGIONS[0], *soft[1:]]), empty_plan(4, 1)
    packed.crossing_costs[[0, 2, 3]] = 1.0, 6.0, 2.0
    seen = []
    for _ in range(201):
        way_round._choose_closed(plan, False, START, np.array([8.0, 0.5, 2.5]), packed, MARGIN)
        seen.append(plan.closed.tolist())
    assert seen == [[False, True, True, False]] * 100 + [[True] * 4] * 100 + [[False, True, True, False]]


@pytest.mark.medium
def test_found_path_is_free():
    rng, packed, way, checked = np.random.default_rng(6), pack(REGIONS), np.zeros((9, 3)), 0
    state, end = search.Search(), np.array([8.0, 0.5, 2.5])
    for count in (looks(state, START, end, packed, 1, rng, way)[0] for _ in range(200)):
        points = [START, *way[:count]]
        for a, b in zip(points[:-1], points[1:], strict=True):
            assert min(clearance(packed, a + (b - a) * s) for s in np.linspace(0.0, 1.0, 40)) > MARGIN - 0.03
            checked += 1
    assert checked > 20


@pytest.mark.medium
def test_full_tree_restarts_and_overlong_chain_is_no_path():
    packed, state, rng = pack([]), search.Search(), np.random.default_rng(7)
    way, end = np.zeros((9, 3)), np.array([8.0, 0.5, 2.5])
    sizes = []
    for _ in range(1300):
        looks(state, START, end, packed, 1, rng, way)
        sizes.append(state.of_goal.size)
    assert max(sizes) == 512 and sizes[-1] < 512
    tree = state.of_vehicle
    tree.nodes[:70, 0], tree.size, tree.root = 0.01 * np.arange(70), 70, 0
    tree.nodes[:70, 1:], tree.parents[:70] = START[1:], np.arange(-1, 69)
    assert search._write_path(state, 0, 69, START, packed, MARGIN, way) == 0
    assert search._write_path(state, 0, 40, START, packed, MARGIN, way) > 0


class Change:
    """`planner._mutate_path`, from the same random numbers."""

    def __init__(self, plan, goal):
        self.random, self.goal = plan.random.copy(), goal
        self.way = plan.path[: plan.points].copy()

    def draw(self):
        return uniform(self.random)

    def spread(self):
        return (sum(self.draw() for _ in range(4)) - 2.0) * np.sqrt(3.0)

    def end(self, at):
        found = np.empty(3)
        nearest_goal_point(self.goal, np.array(at), GAINS.depth, found)
        return found

    def anywhere(self):
        low, high = limits(START, self.way[-1], 2.5)
        return np.array([low[axis] + self.draw() * (high[axis] - low[axis]) for axis in range(3)])

    def made(self):
        way, corners, choice = list(self.way), len(self.way) - 1, self.draw()
        if choice < 0.1:
            way[-1] = self.end(way[-2] if corners else START)
            return [way[-1]] if self.draw() < 0.5 else way
        if choice < 0.2:
            reach = 0.02 * 30.0 ** self.draw()
            way[-1] = self.end(way[-1] + reach * np.array([self.spread() for _ in range(3)]))
            return way
        if choice < 0.3 and corners:
            del way[int(self.draw() * corners)]
            return way
        if choice < 0.65 and corners:
            moved, reach = int(self.draw() * corners), 0.03 * 30.0 ** self.draw()
            way[moved] = way[moved] + reach * np.array([self.spread() for _ in range(3)])
            return way
        if choice < 0.9 and corners < CORNERS:
            at = int(self.draw() * len(way))
            return [*way[:at], self.anywhere(), *way[at:]]
        return [self.anywhere(), way[-1]]


def test_path_changes_match_the_reference_transcription():
    plan, goal, rng = empty_plan(0, 3), pack([GOAL]), np.random.default_rng(5)
    for k in range(300):
        plan.points = 1 + k % (CORNERS + 1)
        plan.path[:] = rng.normal([4.0, 0.0, 2.5], 2.0, size=(CORNERS + 1, 3))
        change = Change(plan, goal)
        expected = change.made()
        way_round._mutate_path(plan, START, goal, GAINS)
        assert plan.candidate_points == len(expected)
        np.testing.assert_allclose(plan.candidate[: len(expected)], expected, rtol=1e-12, atol=1e-12)
        assert plan.random[0] == change.random[0]


@pytest.mark.medium
def test_path_is_updated_and_replaced_by_a_sufficiently_cheaper_one():
    """Turn by turn: the end goes with the goal, corners are passed, the cheaper way stays."""
    wall = Region("box", Box((5.0, -0.8, 2.6), (1.0, 9.0, 9.0)), "out", (-0.03, 0.0, 0.02))
    packed, goal, plan = pack([REGIONS[0], wall, *REGIONS[2:]]), pack([GOAL]), empty_plan(5, 1)
    goal.velocities[0] = drift = 0.05, -0.02, 0.01
    start, taken, grown, evaluated_from = START.copy(), 0, 0, START
    for k in range(400):
        start = start + np.array([0.004, 0.0, 0.0])
        packed.move_to(0.02 * k)
        goal.move_to(0.02 * k)
        before, phase, nodes = plan.path[: plan.points].copy(), plan.phase, plan.search.of_goal.size
        cost, found, candidate = plan.cost.copy(), plan.found_points, plan.candidate[: plan.candidate_points].copy()
        improve_path(plan, start, goal, packed, GAINS, 0.02)
        way = plan.path[: plan.points]
        if k == 0:
            continue
        before[-1] += np.array([0.05, -0.02, 0.01]) * 0.02
        while len(before) > 1 and np.linalg.norm(before[0] - start) < 0.25:
            before = before[1:]
        blocked = plan.cost[1] > 0.3 * np.linalg.norm(np.diff([start, *way], axis=0), axis=1).sum()
        dear = plan.cost[2] > 0.3 * np.linalg.norm(np.diff([start, *way], axis=0), axis=1).sum()
        looks_again = plan.second_look > 0  # for other paths, after a long search
        assert blocked or dear or looks_again or plan.search.sampling_margin == 3.0
        grown += plan.search.of_goal.size != nodes
        if phase == way_round._BEGIN and plan.phase == way_round._CANDIDATE:  # the path, in one call
            np.testing.assert_allclose(way, before, rtol=1e-12)
            assert plan.cost == pytest.approx(expected_cost([start, *before], packed, drift=drift), rel=1e-9)
            evaluated_from = start
            if found > 0:
                assert np.array_equal(plan.candidate[:found], plan.found[:found]) or blocked
        elif phase == way_round._CANDIDATE and plan.phase == way_round._BEGIN and not blocked:
            new = expected_cost([evaluated_from, *candidate], packed, drift=drift)
            if new[0] < cost[0] - 0.03 - 0.01 * cost[0]:
                taken += 1
                assert plan.cost == pytest.approx(new, rel=1e-3)  # regions move meanwhile
                assert np.array_equal(way, candidate)
            else:
                assert np.array_equal(plan.cost, cost)
                np.testing.assert_allclose(way, before, rtol=1e-12)
    assert taken > 1 and grown > 3


def test_found_path_is_the_next_candidate():
    plan, goal = empty_plan(0, 1), pack([GOAL])
    plan.points, plan.found_points, plan.path[0], plan.found[:2] = (
        1,
        2,
        (8.0, 0.5, 2.5),
        [(4.0, 1.0, 2.5), (8.0, 0.5, 2.5)],
    )
    way_round._choose_candidate(plan, START, goal, pack([]), GAINS)
    assert (plan.points, plan.candidate_points, plan.found_points) == (1, 2, -1)
    assert np.array_equal(plan.candidate[:2], plan.found[:2])
    way_round._choose_candidate(plan, START, goal, pack([]), GAINS)
    assert not np.array_equal(plan.candidate[:2], plan.found[:2])


@pytest.mark.parametrize(("count", "waits"), [(2, False), (2, True), (CORNERS, False), (CORNERS + 1, False)])
def test_wait_is_put_before_the_path_or_moved_and_stays_below_the_surface(count, waits):
    plan, rng, corners = empty_plan(0, 1), np.random.default_rng(1), []
    plan.path[:], plan.points, plan.waits = rng.normal(size=(CORNERS + 1, 3)), count, waits
    first, added = (plan.path[0], 0) if waits else (START, int(count <= CORNERS))
    for _ in range(300):
        way_round._choose_wait(plan, START)
        assert plan.candidate_waits and plan.candidate_points == count + added
        assert np.array_equal(plan.candidate[1 : count + added], plan.path[1 - added : count])
        corners.append(plan.candidate[0].copy())
    off = np.array(corners) - first
    assert (
        np.abs(np.median(off, axis=0)[:2]).max() < 0.2 < np.abs(off[:, :2]).max() and np.min(corners, axis=0)[2] == 0.0
    )


def test_passed_corners_of_a_full_path_are_dropped_and_its_length_is_measured():
    """By the cost of hard regions from which it counts as blocked."""
    plan, start = empty_plan(0, 1), np.array([0.45, 0.4, 2.5])
    plan.points, plan.path[:, 0], plan.path[:, 1:] = CORNERS + 1, np.linspace(0.4, 8.4, CORNERS + 1), (0.5, 2.5)
    plan.path[1, 0] = 0.5
    before = plan.path.copy()
    improve_path(plan, start, pack([GOAL]), pack([]), GAINS, 0.02)
    assert plan.points == CORNERS - 1
    assert np.array_equal(plan.path[: CORNERS - 1], before[2:])
    length = np.hypot(1.95, 0.1) + 6.0
    for part in (0.2999, 0.3001):
        plan.cost[1] = part * length
        assert is_blocked(plan, start) == (part > 0.3)


def test_distant_regions_are_not_reevaluated(monkeypatch):
    """In plain Python: a ball that is farther than the way is long, once; one at half of that, again after a while.

    A soft one is also evaluated where the way ends.
    """
    evaluated = []
    monkeypatch.setitem(
        add_cost.__globals__, "clearance_at", lambda *given: evaluated.append(1) or clearance_at(*given)
    )
    way = np.zeros((CORNERS + 1, 3))
    way[0] = START + np.array([6.0, 0.0, 0.0])
    for hard, aside, least, most in (
        (True, 12.0, 1, 1), (True, 4.0, 2, 9), (False, 12.0, 2, 2), (False, 3.5, 3, 10)
    ):  # fmt: skip
        evaluated.clear()
        regions = pack([Region("ball", Sphere((3.0, 0.2 + aside, 2.5), 0.3), "out", hard=hard)])
        assert cost_of(way, 1, regions)[0] == pytest.approx([6.0, 0.0, 0.0, 0.0])
        assert least <= len(evaluated) <= most


@pytest.mark.medium
def test_trees_grow_faster_once_the_path_has_been_blocked_for_a_second():
    """A goal that walls enclose: no path is found, so that every node stays."""
    sides = [((1.0, 0.0, 0.0), (0.4, 3.0, 3.0)), ((0.0, 1.0, 0.0), (3.0, 0.4, 3.0)), ((0.0, 0.0, 1.0), (3.0, 3.0, 0.4))]
    center = np.array([8.0, 0.5, 9.5])
    walls = [
        Region(f"wall {i} {sign}", Box(tuple(center + 1.3 * sign * np.array(normal)), size), "out")
        for i, (normal, size) in enumerate(sides)
        for sign in (-1.0, 1.0)
    ]
    plan, packed = empty_plan(len(walls), 1), pack(walls)
    goal = pack([Region("goal", Sphere(tuple(center), 0.4), "in")])
    nodes = []
    for _ in range(100):
        improve_path(plan, np.array([0.0, 0.0, 9.0]), goal, packed, GAINS, 0.02)
        nodes.append(int(plan.search.of_goal.size + plan.search.of_vehicle.size))
    grown = np.diff(nodes)
    assert grown[:48].max() == 1 and 2.0 < grown[52:].mean() < grown[52:].max() <= 8
