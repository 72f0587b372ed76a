"""The way round: its cost against dense sampling, its end, its work, and what it finds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.compiling.function import CompiledFunction
from controller.laws.deployable.attraction import approach_speed, desired_acceleration, desired_velocity
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.path_planning.cost import PathCost, add_cost, begin_cost
from controller.laws.deployable.path_planning.planner import (
    CORNERS,
    empty_plan,
    improve_path,
    nearest_goal_point,
    search_path,
    uniform,
)
from controller.regions import Box, DepthBand, HalfSpace, Region, Sphere, pack
from controller.regions.region_set import clearance_at

# of the generator of random numbers, on purpose
pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")

GAINS = DeployableGains()
START = np.array([0.0, 0.0, 2.5])
GOAL = Region("goal", Sphere((9.0, 0.0, 2.5), 0.5), "in")
NOTHING = pack([])


def scene(seed, moving=False):
    """Return balls across the straight way, and a depth band."""
    rng = np.random.default_rng(seed)
    balls = [
        Region(
            f"ball {i}",
            Sphere(tuple(rng.normal([4.5, 0.0, 2.5], [1.5, 1.0, 0.7])), float(rng.uniform(0.3, 0.9))),
            "out",
            tuple(rng.uniform(-0.1, 0.1, 3)) if moving else (0.0, 0.0, 0.0),
        )
        for i in range(6)
    ]
    return pack([*balls, Region("band", DepthBand(3.65, 3.35), "in")])


def least_clearance(way, count, regions):
    """Sample the way each centimeter, with every region where it is by then."""
    least, traveled = np.inf, 0.0
    still = regions._replace(shifts=regions.shifts.copy())
    for a, b in zip([START, *way[: count - 1]], way[:count], strict=True):
        length = np.linalg.norm(b - a)
        for s in np.arange(0.0, length, 0.01):
            still.shifts[:] = regions.shifts + regions.velocities * (traveled + s) / GAINS.speed
            at = a + (b - a) * s / length
            least = min(least, *(clearance_at(still, i, at) for i in range(still.kinds.size)))
        traveled += length
    return least


@pytest.mark.parametrize(
    ("goal", "depth"),
    [
        (Sphere((9.0, 0.0, 2.5), 0.5), 0.3),
        (Sphere((9.0, 0.0, 2.5), 0.1), 0.1),
        (Sphere((9.0, 0.0, 2.5), 0.02), 0.02),
        (HalfSpace((1.0, 0.0, 0.0), (6.0, 0.0, 0.0)), 0.3),
        (DepthBand(4.0, 0.15), 0.15),
        (DepthBand(4.0, 1.0), 0.3),
        (Box((9.0, 1.0, 3.0), (1.0, 0.4, 0.2)), 0.1),
    ],
    ids=lambda x: type(x).__name__ if not isinstance(x, float) else str(x),
)
def test_path_end_lies_inside_goals_of_any_shape(goal, depth):
    rng, packed, end = np.random.default_rng(6), pack([Region("goal", goal, "in")]), np.empty(3)
    for _ in range(50):
        nearest_goal_point(packed, rng.normal([4.0, 0.0, 2.5], [5.0, 3.0, 2.0]), GAINS.depth, end)
        assert clearance_at(packed, 0, end) > 0.5 * depth


improve = CompiledFunction(improve_path)


def run(regions, steps=400, goal=GOAL, start=START, plan=None, moved=None):
    plan, packed = plan or empty_plan(regions.kinds.size, 1), pack([goal])
    for k in range(steps):
        if moved:
            moved(k, packed)
        improve(plan, start, packed, regions, GAINS, 0.02)
    return plan, packed


@pytest.mark.medium
def test_path_around_blocking_obstacles_is_found():
    """Of 20 fields of six balls, straight through which no way is free, within 8 s of the vehicle's waiting."""
    found = blocked = 0
    for seed in range(20):
        regions = scene(seed)
        straight = np.zeros((CORNERS + 1, 3))
        straight[0] = (8.8, 0.0, 2.5)
        if (
            least_clearance(straight, 1, regions) > 0.0
            or min(clearance_at(regions, i, p) for i in range(7) for p in (START, straight[0])) < 0.3
        ):
            continue
        blocked += 1
        plan, goal = run(regions)
        found += least_clearance(plan.path, plan.points, regions) > 0.1
        assert clearance_at(goal, 0, plan.path[plan.points - 1]) > 0.0
    assert blocked > 8
    assert found == blocked


@pytest.mark.medium
def test_partly_covered_goal_is_entered_at_its_free_part():
    regions = pack([Region("cover", Sphere((8.4, 0.0, 2.5), 0.6), "out")])
    plan, goal = run(regions, 800)
    end = plan.path[plan.points - 1]
    assert clearance_at(goal, 0, end) > 0.0
    assert clearance_at(regions, 0, end) > GAINS.margin
    assert least_clearance(plan.path, plan.points, regions) > GAINS.margin


@pytest.mark.medium
def test_path_end_follows_a_moving_goal():
    """Given a velocity, and streamed to places that none tells of."""
    sailing = Region("goal", GOAL.shape, "in", (0.1, -0.2, 0.0))

    def sail(k, packed):
        packed.move_to(0.02 * k)

    def jump(k, packed):
        packed.shifts[0] = (0.0, 0.004 * k, 0.0) if k < 200 else (-3.0, 1.0, 0.5)

    for goal, moved in ((sailing, sail), (GOAL, jump)):
        plan, packed = run(NOTHING, 400, goal, moved=moved)
        assert clearance_at(packed, 0, plan.path[plan.points - 1]) > 0.05


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("velocity", [(-0.9, 0.0, 0.0), (0.0, 0.5, 0.0), (0.4, -0.4, 0.0)])
def test_vehicle_at_rest_steps_aside_from_a_fast_region_and_returns(velocity):
    """A ball through its place, and a vehicle that does no more than 0.5 m/s."""
    at, velocity = np.array([9.0, 0.0, 2.5]), np.array(velocity)
    ball = Region("ball", Sphere(tuple(at - 12.0 * velocity), 1.5), "out", tuple(velocity))
    regions, packed = pack([ball, Region("band", DepthBand(3.65, 3.35), "in")]), pack([GOAL])
    plan, least, waited = empty_plan(2, 1), np.inf, False
    for k in range(1500):
        regions.move_to(0.02 * k)
        improve(plan, at, packed, regions, GAINS, 0.02)
        desired = desired_velocity(plan, at, np.zeros(3), GAINS)
        at = at + 0.02 * desired * min(1.0, 0.5 / max(np.linalg.norm(desired), 1e-9))
        least, waited = min(least, clearance_at(regions, 0, at)), waited or bool(plan.waits)
    assert least > 0.2 and waited and not plan.waits
    assert clearance_at(packed, 0, at) > 0.2


def arrays_of(plan):
    """Yield all arrays of a plan."""
    for part in plan:
        if isinstance(part, tuple):
            yield from arrays_of(part)
        else:
            yield part


def test_planning_is_deterministic():
    one, other = (run(scene(3, moving=True))[0] for _ in range(2))
    assert one.points > 1
    for a, b in zip(arrays_of(one), arrays_of(other), strict=True):
        assert np.array_equal(a, b)


def test_random_generator_is_xorshift64star():
    state, x, mask = np.array([88172645463325252], dtype=np.uint64), 88172645463325252, 2**64 - 1
    numbers = []
    for _ in range(2000):
        x ^= x >> 12
        x ^= (x << 25) & mask
        x ^= x >> 27
        numbers.append(uniform(state))
        assert numbers[-1] == (((x * 0x2545F4914F6CDD1D) & mask) >> 11) / 2.0**53
    assert abs(np.mean(numbers) - 0.5) < 0.03 and 0.0 <= min(numbers) < max(numbers) < 1.0


def test_clearance_evaluations_are_bounded(monkeypatch):
    """In plain Python, a way of any length among any regions is looked at 64 times a call, and 512 times in all."""
    looked = []

    def counting(regions, i, point):
        looked.append(i)
        return clearance_at(regions, i, point)

    monkeypatch.setitem(add_cost.__globals__, "clearance_at", counting)
    regions = pack([Region(f"floor {i}", HalfSpace((0.0, 0.0, -1.0), (0.0, 0.0, 2.55)), "in") for i in range(3)])
    way = np.zeros((CORNERS + 1, 3))
    way[:] = [(100.0 * (i + 1), 50.0 * (-1.0) ** i, 2.5) for i in range(CORNERS + 1)]
    cost, calls = PathCost(n=3), [0]
    begin_cost(cost, START, np.zeros(3), False)
    while not add_cost(cost, way, CORNERS + 1, regions, GAINS, np.inf):
        calls.append(len(looked))
    assert max(np.diff(calls)) <= 64 * 3 and len(looked) == 512 * 3


@pytest.mark.medium
def test_search_at_rest_ends_with_a_free_path_or_its_period_limit():
    plan, periods = empty_plan(2, 1), np.array([2000, 0])
    regions, goal = pack([Region("wall", Box((4.0, 0.0, 2.5), (0.5, 4.0, 9.0)), "out")]), pack([GOAL])
    CompiledFunction(search_path)(plan, START, goal, regions, GAINS, 0.02, periods)
    assert 2 < periods[1] < 2000
    assert least_clearance(plan.path, plan.points, regions) > 0.0
    shut = pack([Region("wall", HalfSpace((1.0, 0.0, 0.0), (4.0, 0.0, 0.0)), "out")])
    CompiledFunction(search_path)(empty_plan(1, 1), START, goal, shut, GAINS, 0.02, periods)
    assert periods[1] == 2000


@given(st.floats(-1.0, 50.0), st.floats(0.01, 3.0), st.floats(0.1, 5.0))
def test_approach_speed_is_within_the_deceleration(distance, deceleration, slope):
    """v dv/dd is what it asks to brake with: below the deceleration, and v grows with `slope` near 0."""
    h = 1e-6
    v = approach_speed(distance, deceleration, slope)
    dv = (approach_speed(distance + h, deceleration, slope) - approach_speed(distance - h, deceleration, slope)) / (
        2 * h
    )
    if distance > 1e-3:
        assert 0.0 < v * dv < deceleration * (1.0 + 1e-5)
        assert v <= slope * distance * (1.0 + 1e-9)
    elif distance < -1e-3:
        assert v == slope * distance


def test_desired_acceleration_is_bounded():
    rng = np.random.default_rng(9)
    for scale in (1e-3, 1.0, 1e6):
        wanted, velocity = rng.normal(size=(2, 3)) * scale
        out = desired_acceleration(wanted, velocity, GAINS)
        free = GAINS.velocity_bandwidth * (wanted - velocity)
        assert np.linalg.norm(out) == pytest.approx(min(np.linalg.norm(free), GAINS.acceleration))
        assert out @ free > 0.0
