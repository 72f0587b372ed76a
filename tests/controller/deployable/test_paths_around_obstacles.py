"""The way round against a plain transcription of its cost and of its search, step by step."""

import numpy as np
import pytest

from controller.laws.deployable import path_planner as way_round
from controller.laws.deployable import search
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planner import (
    CORNERS,
    empty_plan,
    improve_path,
    nearest_goal_point,
    path_cost,
    uniform,
)
from controller.regions import Box, DepthBand, Orientation, Region, Sphere, pack
from controller.regions.region_set import clearance_at

# of the generator of random numbers, on purpose
pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")

GAINS = DeployableGains()
START = np.array([0.0, 0.2, 2.5])
REGIONS = [
    Region("ball", Sphere((3.0, 0.1, 2.4), 0.9), "out", (0.02, -0.05, 0.01)),
    Region("box", Box((5.0, -0.8, 2.6), (1.0, 1.5, 3.0)), "out", (-0.03, 0.0, 0.02)),
    Region("band", DepthBand(3.0, 2.5), "in"),
    Region("soft", Sphere((1.0, 0.0, 2.5), 0.5), "out", hard=False),
    Region("face", Orientation((1.0, 0.0, 0.0, 0.0), 0.1), "in"),
]
GOAL = Region("goal", Sphere((8.0, 0.5, 2.5), 0.5), "in")
PLACES = [0, 1, 2]  # hard regions of place


def clearance(packed, point, later=0.0):
    """Return the least clearance of the hard regions of place, each where it will be."""
    return min(clearance_at(packed, i, point - packed.velocities[i] * later) for i in PLACES)


def expected_cost(points, packed, gains=GAINS):
    """Look at all regions at each stride: what is far cannot matter."""
    points = np.asarray(points)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    enough, total, samples = gains.clearance + 3.0 / 0.7, lengths.sum(), 0
    for leg, length in enumerate(lengths):
        s = 0.0
        while s < length:
            if samples == 64:
                return total + 200.0 * (length - s + lengths[leg + 1 :].sum())
            samples += 1
            gone = lengths[:leg].sum() + s
            at = points[leg] + (points[leg + 1] - points[leg]) * s / length
            free = min(enough, clearance(packed, at, gone / gains.speed))
            stride = min(np.clip(0.7 * (free - gains.clearance), 0.08, 3.0), length - s + 1e-9)
            lack = max(gains.clearance - free, 0.0)
            total += stride * 3.0 * (lack / gains.clearance) ** 2
            if free < gains.margin:
                total += stride * 200.0 * (1.0 + gains.margin - free)
            s += stride
    return total


def random_way(rng, reach=1.0):
    way, count = np.zeros((CORNERS + 1, 3)), int(rng.integers(1, 5))
    way[:count] = rng.normal([4.0, 0.0, 2.5], np.array([3.0, 1.5, 1.0]) * reach, size=(count, 3))
    return way, count


def test_the_cost_is_that_of_looking_everywhere():
    rng, packed, far, dear, long = np.random.default_rng(1), pack(REGIONS), np.zeros(5), 0, 0
    for k in range(60):
        way, count = random_way(rng, 20.0 if k % 6 == 0 else 1.0)
        packed.move_to(0.1 * k)
        packed.velocities[:3] = rng.normal(size=(3, 3)) * rng.choice([0.05, 0.4])
        expected = expected_cost([START, *way[:count]], packed)
        assert path_cost(way, count, START, packed, far, GAINS) == pytest.approx(expected, rel=1e-9)
        length = np.linalg.norm(np.diff([START, *way[:count]], axis=0), axis=1).sum()
        dear, long = dear + (expected > 1.2 * length), long + (expected > 50.0 * length)
    assert dear > 20 and long > 1


def test_the_nearest_end_is_along_the_slope_where_the_goal_is_deep_enough():
    rng, end = np.random.default_rng(2), np.empty(3)
    for goal, depth in ((GOAL, 0.3), (Region("goal", Box((8.0, 0.5, 2.5), (2.0, 2.0, 2.0)), "in"), 0.3)):
        packed = pack([goal])
        for _ in range(20):
            at = np.array([4.0, *rng.uniform([0.0, 2.0], [1.0, 3.0])])
            nearest_goal_point(packed, at, depth, end)
            assert clearance_at(packed, 0, end) == pytest.approx(depth, abs=2e-3)
            from_centre = end - [8.0, 0.5, 2.5]
            if goal is GOAL:
                assert from_centre == pytest.approx(0.2 * (at - end + from_centre) / np.linalg.norm(at - [8, 0.5, 2.5]))
            else:
                assert from_centre == pytest.approx([-0.7, *(at[1:] - [0.5, 2.5])], abs=1e-9)


def test_a_line_is_free_if_dense_sampling_says_so():
    rng, packed, said = np.random.default_rng(3), pack(REGIONS), []
    for _ in range(200):
        a, b = rng.normal([4.0, 0.0, 2.5], [1.5, 1.0, 0.7], size=(2, 3))
        least = min(clearance(packed, a + (b - a) * s) for s in np.linspace(0.0, 1.0, 60))
        if abs(least - 0.13) > 0.03:  # else a look may step over it
            said.append(search.is_line_free(a, b, packed, 0.13))
            assert said[-1] == (least > 0.13)
    assert 20 < sum(said) < len(said) - 20
    assert search.is_line_free(START, START, packed, 0.1)


def test_a_look_goes_no_farther_than_what_is_known_to_be_free():
    """Past a small ball, 0.45 m from it at the nearest: a longer look from the start would land behind it."""
    packed = pack([Region("ball", Sphere((1.0, 0.55, 0.0), 0.1), "out")])
    begin, end = np.zeros(3), np.array([3.0, 0.0, 0.0])
    assert not search.is_line_free(begin, end, packed, 0.5)
    assert search.is_line_free(begin, end, packed, 0.4)


def test_a_start_closer_to_a_region_than_the_way_may_be_is_left():
    packed = pack([Region("ball", Sphere((4.0, 0.2, 2.4), 0.7), "out")])  # 0.04 m away
    start, end = np.array([3.26, 0.2, 2.4]), np.array([-2.0, 0.2, 2.4])
    rng, tree, way = np.random.default_rng(0), search.empty_tree(), np.zeros((9, 3))
    assert max(search.grow_tree(tree, start, end, rng.uniform(size=4), packed, GAINS, way) for _ in range(40)) > 0


def limits(start, end, room):
    """Return the corners of the box in which places are drawn: not out of the water."""
    low, high = np.minimum(start, end), np.maximum(start, end)
    return np.r_[low[:2] - room, max(low[2] - room, min(low[2], 0.0))], high + room


def walk(seed_of_tree, packed, steps):
    """Grow a tree beside a transcription of it, and return ways found."""
    rng, tree, way, found = np.random.default_rng(seed_of_tree), search.empty_tree(), np.zeros((9, 3)), []
    nodes, parents, end, wanted, room = [], [], np.array([8.0, 0.5, 2.5]), 0.03 + 0.4 * 0.25, 3.0
    for k in range(steps):
        if k == steps // 2:
            end = end + np.array([0.0, 0.25, 0.25])  # more than 0.3 m: anew
        draws = rng.uniform(size=4)
        if not nodes or np.linalg.norm(nodes[0] - end) > 0.3:
            nodes, parents = [end], [-1]
        count = search.grow_tree(tree, START, end, draws, packed, GAINS, way)
        room = min(1.006 * room, 16.0)
        low, high = limits(START, end, room)
        target = START if draws[3] < 0.2 else low + draws[:3] * (high - low)
        apart = np.linalg.norm(np.array(nodes) - target, axis=1)
        nearest = int(apart.argmin())
        new = nodes[nearest] + min(1.0, 1.5 / max(apart[nearest], 1e-9)) * (target - nodes[nearest])
        expected = []
        if apart[nearest] >= 0.05 and search.is_line_free(new, nodes[nearest], packed, wanted):
            parent = nearest
            for _ in range(2):
                if parents[parent] < 0 or not search.is_line_free(new, nodes[parents[parent]], packed, wanted):
                    break
                parent = parents[parent]
            nodes.append(new)
            parents.append(parent)
            if search.is_line_free(new, START, packed, min(0.5 * wanted, clearance(packed, START) - 0.005)):
                at = len(nodes) - 1
                while at >= 0:
                    expected.append(nodes[at])
                    at = parents[at]
        assert tree.size[0] == len(nodes)
        np.testing.assert_allclose(tree.nodes[: len(nodes)], nodes, rtol=1e-12, atol=1e-12)
        assert tree.parents[: len(nodes)].tolist() == parents
        assert count == (len(expected) if len(expected) <= 9 else 0)
        np.testing.assert_allclose(way[:count], np.reshape(expected[:count], (-1, 3)), rtol=1e-12, atol=1e-12)
        found.append(count)
    return found


def test_the_tree_is_that_of_the_transcription():
    found = walk(4, pack(REGIONS), 120)
    assert max(found) >= 3 and found.count(0) > 20


class Change:
    """`path_planner._mutate_path`, from the same random numbers."""

    def __init__(self, plan, goal):
        self.random, self.goal = plan.random.copy(), goal
        self.way = plan.path[: plan.counts[0]].copy()

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
            reach = 0.05 + self.draw() * 0.5
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


def test_changes_are_those_of_the_transcription():
    plan, goal, rng = empty_plan(0, 3), pack([GOAL]), np.random.default_rng(5)
    for k in range(300):
        plan.counts[0] = 1 + k % (CORNERS + 1)
        plan.path[:] = rng.normal([4.0, 0.0, 2.5], 2.0, size=(CORNERS + 1, 3))
        change = Change(plan, goal)
        expected = change.made()
        way_round._mutate_path(plan, START, goal, GAINS)
        assert plan.counts[1] == len(expected)
        np.testing.assert_allclose(plan.candidate[: len(expected)], expected, rtol=1e-12, atol=1e-12)
        assert plan.random[0] == change.random[0]


def test_a_way_is_kept_up_and_replaced_by_one_that_saves_enough():
    """Turn by turn: the end goes with the goal, corners are passed, the cheaper way stays."""
    packed, goal, plan = pack(REGIONS), pack([GOAL]), empty_plan(5, 1)
    goal.velocities[0] = 0.05, -0.02, 0.01
    start, taken, grown = START.copy(), 0, 0
    for k in range(240):
        start = start + np.array([0.004, 0.0, 0.0])
        packed.move_to(0.02 * k)
        goal.move_to(0.02 * k)
        before, random = plan.path[: plan.counts[0]].copy(), plan.random.copy()
        cost, turn, tree = plan.cost[0], plan.phase[0], plan.tree.size[0]
        improve_path(plan, start, goal, packed, GAINS, 0.02)
        way = plan.path[: plan.counts[0]]
        if k == 0:
            continue
        before[-1] += np.array([0.05, -0.02, 0.01]) * 0.02
        while len(before) > 1 and np.linalg.norm(before[0] - start) < 0.25:
            before = before[1:]
        if turn == 0:
            np.testing.assert_allclose(way, before, rtol=1e-12)
            assert plan.cost[0] == pytest.approx(expected_cost([start, *before], packed), rel=1e-9)
            assert np.array_equal(random, plan.random)
            continue
        draws = [uniform(random) for _ in range(5)]
        length = np.linalg.norm(np.diff([start, *before], axis=0), axis=1).sum()
        looked = cost > 1.3 * length and draws[4] < 0.7
        grown += plan.tree.size[0] != tree
        assert looked == np.array_equal(random, plan.random)
        other = plan.candidate[: plan.counts[1]]
        new = expected_cost([start, *other], packed) if len(other) else np.inf
        if new < cost - 0.03 - 0.01 * cost:
            taken += 1
            assert plan.cost[0] == pytest.approx(new, rel=1e-9)
            assert np.array_equal(way, other)
        else:
            assert plan.cost[0] == cost
            np.testing.assert_allclose(way, before, rtol=1e-12)
    assert taken > 2 and grown > 3


def test_passed_corners_are_dropped_one_after_the_other():
    plan, corners = empty_plan(0, 1), [(1.0, 0.0, 2.5), (1.1, 0.1, 2.5), (4.0, 1.0, 2.5), (8.0, 0.5, 2.5)]
    plan.counts[0], plan.path[:4] = 4, corners
    improve_path(plan, np.array([1.05, 0.05, 2.5]), pack([GOAL]), pack([]), GAINS, 0.02)
    assert plan.counts[0] == 2
    assert plan.path[:2].tolist() == [list(corner) for corner in corners[2:]]
    assert way_round._length(plan.path, 2, START) == pytest.approx(np.hypot(4.0, 0.8) + np.hypot(4.0, 0.5))


def test_the_first_corner_of_the_longest_way_is_dropped():
    plan = empty_plan(0, 1)
    plan.counts[0], plan.path[:, 0], plan.path[:, 1:] = CORNERS + 1, np.linspace(0.0, 8.0, CORNERS + 1), (0.5, 2.5)
    before = plan.path.copy()
    improve_path(plan, np.array([0.0, 0.4, 2.5]), pack([GOAL]), pack([]), GAINS, 0.02)
    assert plan.counts[0] == CORNERS
    assert np.array_equal(plan.path[:CORNERS], before[1:])


def test_what_is_found_far_away_is_not_looked_at_again(monkeypatch):
    """In plain Python: a ball that is farther than the way is long, once; one at half of that, again after a while."""
    looks = []
    clearance = path_cost.__globals__["clearance_of_sphere"]
    monkeypatch.setitem(
        path_cost.__globals__, "clearance_of_sphere", lambda *given: looks.append(1) or clearance(*given)
    )
    way = np.zeros((CORNERS + 1, 3))
    way[0] = START + np.array([6.0, 0.0, 0.0])
    for aside, least, most in ((12.0, 1, 1), (4.0, 2, 9)):
        looks.clear()
        regions = pack([Region("ball", Sphere((3.0, 0.2 + aside, 2.5), 0.3), "out")])
        assert path_cost(way, 1, START, regions, np.zeros(1), GAINS) == pytest.approx(6.0)
        assert least <= len(looks) <= most
