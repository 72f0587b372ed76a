"""Difficult regions and paths: regression scenes, and randomly drawn families."""

import functools
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.scenario.scenario import load_scenario

DATA = Path(__file__).parents[2] / "data" / "hard_regions"
VEHICLES = ("odin", "bluerov2_heavy", "rexrov")
MIDDLE = np.array([0.0, 0.0, 10.0])
FLIGHT = """
vehicle = "{vehicle}"
[time]
duration = {duration}
step = 0.01
control = 0.02
arbiter = 0.02
[initial]
position = {start}
[goal]
type = "sphere"
center = {goal}
radius = 0.5
[law]
name = "deployable"
[actuation]
through = "thrusters"
[sensing]
position_noise = {noise}
velocity_noise = {half}
seed = {seed}
"""
REGION = """
[[regions]]
name = "{name}"
criterion = "shape"
keep = "{keep}"
gain = 100.0
shape = {{ {shape} }}
"""


def text(numbers):
    return str([float(x) for x in numbers])


def unit_of(vector):
    return vector / np.linalg.norm(vector)


def unit(rng, n=3):
    return unit_of(rng.normal(size=n))


def scenario_text(vehicle, seed, start, goal, duration=240.0, noise=0.02):
    given = {"vehicle": vehicle, "seed": seed, "start": text(start), "goal": text(goal), "duration": duration}
    return FLIGHT.format(**given, noise=noise, half=noise / 2.0)


def room(kind, rng):
    """Return the shape of a room, a start within it, and a goal that lies beyond its surface or near it."""
    quaternion, way = unit(rng, 4), unit(rng)
    R = Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()
    if kind == "ellipsoid":
        axes = rng.uniform(0.6, 4.0, 3)
        shape = f"center = {text(MIDDLE)}, semi_axes = {text(axes)}, quaternion = {text(quaternion)}"
        start, goal = MIDDLE + R @ (0.4 * rng.uniform() * axes * way), MIDDLE + R @ (rng.uniform(1.2, 3.0) * axes * way)
    elif kind == "sphere":
        radius = rng.uniform(0.6, 3.0)
        shape = f"center = {text(MIDDLE)}, radius = {radius}"
        start, goal = MIDDLE - rng.uniform(-0.5, 0.5) * radius * way, MIDDLE + rng.uniform(1.5, 4.0) * radius * way
    elif kind == "box":
        half = rng.uniform(0.7, 4.0, 3)
        shape = f"center = {text(MIDDLE)}, size = {text(2.0 * half)}, quaternion = {text(quaternion)}"
        corner = R @ (half * rng.choice([-1.0, 1.0], 3) * rng.uniform(0.9, 2.0, 3))
        start, goal = MIDDLE + R @ (half * rng.uniform(-0.4, 0.4, 3)), MIDDLE + corner
    elif kind == "cylinder":
        half, radius = rng.uniform(1.2, 4.0) * unit(rng), rng.uniform(0.7, 3.0)
        shape = f"start = {text(MIDDLE - half)}, end = {text(MIDDLE + half)}, radius = {radius}"
        start, goal = MIDDLE + rng.uniform(-0.4, 0.4) * half, MIDDLE + rng.uniform(2.0, 8.0) * way
    else:
        axis, length, angle = unit(rng), rng.uniform(2.5, 5.0), rng.uniform(0.3, 0.9)
        feature = MIDDLE - 0.7 * length * axis
        shape = f"feature = {text(feature)}, axis = {text(axis)}, half_angle = {angle}, range = {length}"
        start, goal = MIDDLE, MIDDLE + rng.uniform(2.0, 8.0) * way
    return f'type = "{kind}", {shape}', start, [goal[0], goal[1], max(goal[2], 1.5)]


def kept_in(kind, vehicle, seed):
    rng = np.random.default_rng([seed, *kind.encode()])
    shape, start, goal = room(kind, rng)
    noise = 0.02 * rng.integers(2)
    flight = scenario_text(vehicle, seed, start, goal, duration=40.0, noise=noise)
    return flight + REGION.format(name="room", keep="in", shape=shape)


def block(name, x, y, half):
    size = 2.0 * np.array(half)
    return REGION.format(name=name, keep="out", shape=f'type = "box", center = {[x, y, 12.0]}, size = {text(size)}')


def barred(kind, vehicle, seed):
    """Return a flight whose straight way is closed, though there is another one."""
    rng = np.random.default_rng([seed, *kind.encode()])
    length, blocks = 12.0, ""
    if kind == "wall":
        width = rng.uniform(4.0, 20.0)
        blocks = block("wall", 6.0, rng.uniform(-0.3, 0.3) * width, [0.3, width / 2.0, 12.0])
    elif kind == "door":
        middle, gap = rng.uniform(-5.0, 5.0), rng.uniform(1.2, 2.0)
        for name, side in (("left", -1.0), ("right", 1.0)):
            blocks += block(name, 6.0, middle + side * (gap / 2.0 + 15.0), [0.3, 15.0, 12.0])
    else:
        length = rng.uniform(40.0, 60.0)
        for i in range(int(rng.integers(1, 5))):
            half = [rng.uniform(0.2, 1.0), rng.uniform(1.5, 4.0), rng.uniform(2.0, 12.0)]
            blocks += block(f"slab {i}", rng.uniform(5.0, length - 5.0), rng.uniform(-1.0, 1.0), half)
    flight = scenario_text(vehicle, seed, [0.0, 0.0, 12.0], [length, rng.uniform(-2.0, 2.0), 12.0])
    return flight + blocks


def pocket(vehicle, seed):
    """Return a flight that starts deep in a pocket of three tall walls, whose mouth is away from the goal."""
    rng = np.random.default_rng([seed, 77])
    depth, width, y = rng.uniform(3.0, 10.0), rng.uniform(2.0, 5.0), rng.uniform(-1.0, 1.0)
    thick, tall = 0.3, 12.0
    walls = block("end", 1.5, y, [thick, width / 2.0 + 2.0 * thick, tall])
    for name, side in (("left", -1.0), ("right", 1.0)):
        walls += block(name, 1.5 - depth / 2.0, y + side * (width / 2.0 + thick), [depth / 2.0, thick, tall])
    goal = [rng.uniform(6.0, 12.0), rng.uniform(-3.0, 3.0), 12.0]
    flight = scenario_text(vehicle, seed, [0.0, y, 12.0], goal)
    return flight + walls


def bent_pipe(vehicle, seed):
    """Return a flight through a pipe of five bends, that is kept in, to its other end."""
    rng = np.random.default_rng([seed, 78])
    points, way = [np.array([0.0, 0.0, 20.0])], np.array([1.0, 0.0, 0.0])
    for _ in range(6):
        points.append(points[-1] + rng.uniform(3.0, 7.0) * way)
        while True:  # turned by 40 to 95 degrees, clear of what is there
            turned = unit(rng) * [1.0, 1.0, 0.5]
            turned /= np.linalg.norm(turned)
            ahead = points[-1] + 5.0 * turned
            bend = np.degrees(np.arccos(turned @ way))
            if 40.0 < bend < 95.0 and ahead[2] > 3.0 and all(np.linalg.norm(ahead - p) > 3.5 for p in points[:-1]):
                break
        way = turned
    shape = f'type = "pipe", points = [{", ".join(map(text, points))}], radius = {rng.uniform(1.0, 1.6)}'
    goal = points[-1] - 0.2 * unit_of(points[-1] - points[-2])
    flight = scenario_text(vehicle, seed, [0.3, 0.0, 20.0], goal)
    return flight + REGION.format(name="pipe", keep="in", shape=shape)


def rocks(vehicle, seed):
    """Return a flight through two hundred spheres."""
    rng, length, rocks = np.random.default_rng([seed, 79]), 30.0, ""
    start, goal, count = np.array([0.0, 0.0, 15.0]), np.array([length, rng.uniform(-4.0, 4.0), 15.0]), 0
    while count < 200:
        center, radius = rng.uniform([1.0, -8.0, 8.0], [length - 1.0, 8.0, 22.0]), rng.uniform(0.2, 0.9)
        if min(np.linalg.norm(center - start), np.linalg.norm(center - goal)) > radius + 1.4:
            shape = f'type = "sphere", center = {text(center)}, radius = {radius}'
            rocks, count = rocks + REGION.format(name=f"rock {count}", keep="out", shape=shape), count + 1
    flight = scenario_text(vehicle, seed, start, goal, duration=120.0)
    return flight + rocks


FAMILIES = {"pocket": pocket, "bent pipe": bent_pipe, "rocks": rocks} | {
    kind: functools.partial(barred, kind) for kind in ("wall", "door", "transit")
}


@pytest.fixture
def flown(tmp_path):
    """Return a function that runs a scenario's text or file and returns the outcome."""

    def fly(scenario):
        file = scenario
        if isinstance(scenario, str):
            file = tmp_path / "flight.toml"
            file.write_text(scenario)
        whole = load_scenario(file, ["arbiter.engine=closed"])
        with FusedFlyer(Variation(whole, ())) as flyer:
            return flyer.fly_one(whole)[0]

    return fly


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(
    ("name", "reached"),
    [("ellipsoid", False), ("bluerov2-box-corner", False), ("wall", True), ("transit60-slab4", True)],
)
def test_regression_scenes_keep_hard_regions(flown, name, reached):
    outcome = flown(DATA / f"{name}.toml")
    assert outcome["min_clearance"] > 0.0 and bool(outcome["settled"]) == reached


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("kind", ["ellipsoid", "sphere", "box", "cylinder", "cone"])
@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 60), marks=pytest.mark.slow)], ids=["few", "many"])
def test_keep_in_region_is_satisfied_for_any_goal(flown, kind, vehicle, seeds):
    left = [seed for seed in seeds if not flown(kept_in(kind, vehicle, seed))["min_clearance"] > 0.0]
    assert left == []


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("vehicle", VEHICLES)
@pytest.mark.parametrize("kind", FAMILIES)
@pytest.mark.parametrize("seeds", [range(1), pytest.param(range(1, 40), marks=pytest.mark.slow)], ids=["few", "many"])
def test_path_around_obstacles_is_found(flown, kind, vehicle, seeds):
    for seed in seeds:
        outcome = flown(FAMILIES[kind](vehicle, seed))
        assert outcome["settled"] and outcome["min_clearance"] > 0.0, seed
