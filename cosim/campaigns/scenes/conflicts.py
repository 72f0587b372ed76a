"""Scenes with conflicting regions, some of which must be violated by the arbiter's choice."""

# Each scene is a scenario: four criteria in a random order, soft and hard regions that exclude each other, a net weight
# of up to 50 N (more for a heavy vehicle), a current of up to 0.4 m/s, noise, and one of three vehicles. The score is
# the priority-weighted violation: a region has four times the weight of one of the next criterion in that order. The
# generator does not depend on the performance of any law.

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from cosim.campaigns.scenes.scene_tables import (
    Generator,
    Table,
    horizontal,
    scenario_table,
    sphere_table,
    thruster_lags,
)  # fmt: skip
from plant_fmu.vehicle import Vehicle, load_vehicle

Kinds = dict[str, Callable[[Generator], tuple[Table, list[Table]]]]

# s, lag of each vehicle's thrusters; None: that of its file
_LAGS = {"odin": 0.0, "bluerov2_heavy": 0.15, "rexrov": None}
_PRIORITY = 4.0  # ratio of priorities of successive criteria
_MAX_NET_WEIGHT = 50.0  # N, maximum magnitude of the net weight of a light vehicle
_WEIGHT_FRACTION = 0.025  # maximum magnitude as a fraction of the weight, where that is more: of a heavy vehicle
_CURRENT = 0.4  # m/s, maximum speed of the current
_CRITERIA = ("obstacle", "shape", "depth", "visibility")


def make_conflict(seed: int, family: str = "conflict") -> Table:
    """Make the conflict of a seed."""
    return draw_conflict(np.random.default_rng([CONFLICTS[family].stream, seed]), seed, family)


def draw_conflict(rng: Any, seed: int, family: str = "conflict") -> Table:
    """Make a conflict from random numbers."""
    _, kinds, duration = CONFLICTS[family]
    vehicle = load_vehicle(list(_LAGS)[int(rng.integers(len(_LAGS)))])
    kind = list(kinds)[int(rng.integers(len(kinds)))]
    order = rng.permutation(len(_CRITERIA)).tolist()  # position of each criterion in the order, from 0
    goal, regions = kinds[kind](rng)
    heading, speed = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, _CURRENT)
    criteria: list[Table] = [{"name": name, "order": 1 + rank} for name, rank in zip(_CRITERIA, order, strict=True)]
    criteria[-1]["membership"] = {"clearance": {"falling": [-0.2, 0.1]}}
    for region in regions:
        rank = order[_CRITERIA.index(region["criterion"])]
        region |= {"gain": 100.0 * _scale(vehicle), "priority": _PRIORITY ** (len(_CRITERIA) - 1 - rank)}
    current, parameters = horizontal(heading, speed), _parameters(rng, vehicle)
    start = [0.0, 0.0, float(rng.uniform(3.6, 4.4))]
    title = f"{family.capitalize()} {seed}: {kind}, {vehicle.name}"
    table = scenario_table(
        title, seed, vehicle, duration, current, parameters, start, {"goal": goal, "criteria": criteria}, regions
    )
    return {"seed": seed, "kind": f"{kind}, {vehicle.name}", "scenario": table}


def _scale(vehicle: Vehicle) -> float:
    """Return the factor of forces, relative to a vehicle of up to 50 kg."""
    return max(1.0, vehicle.mass / 50.0)


def _parameters(rng: Generator, vehicle: Vehicle) -> dict[str, float]:
    max_net_weight = max(_MAX_NET_WEIGHT, _WEIGHT_FRACTION * vehicle.weight)
    parameters = {"buoyancy": float(vehicle.weight - rng.uniform(-max_net_weight, max_net_weight))}
    lag = _LAGS[vehicle.name]
    if lag is not None:
        parameters |= thruster_lags(vehicle, lag)
    return parameters


def _region(name: str, criterion: str, keep: str, hard: bool, shape: Table, velocity: Any = (0.0, 0.0, 0.0)) -> Table:
    drift = [float(v) for v in velocity]
    return {"name": name, "criterion": criterion, "keep": keep, "hard": hard, "velocity": drift, "shape": shape}


def _box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Table:
    spans = np.array([x, y, z], dtype=float)
    return {"type": "box", "center": spans.mean(axis=1).tolist(), "size": np.ptp(spans, axis=1).tolist()}


def _beyond(axis: int, at: float, sign: float = 1.0) -> Table:
    """Return the half-space below `at` [m] along an axis, or above it for a negative sign."""
    point, normal = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    point[axis], normal[axis] = float(at), float(sign)
    return {"type": "half_space", "point": point, "normal": normal}


def _two(rng: Generator) -> tuple[str, str]:
    """Return two random criteria."""
    first, second = rng.choice(3, 2, replace=False).tolist()
    return _CRITERIA[first], _CRITERIA[second]


def _closing(rng: Generator, axis: int, middle: float) -> tuple[Table, list[Table]]:
    """Make two hard faces that approach each other along an axis until they overlap."""
    one, other = _two(rng)
    apart, overlap, duration = rng.uniform(3.0, 4.0), rng.uniform(0.2, 0.8), rng.uniform(35.0, 50.0)
    fast = (apart + overlap) / duration  # m/s, closing speed of both faces
    fraction = rng.uniform()  # fraction of it by which the first face moves
    velocities = np.zeros((2, 3))
    velocities[0, axis], velocities[1, axis] = fraction * fast, (fraction - 1.0) * fast
    regions = [
        _region("lower face", one, "out", True, _beyond(axis, middle - apart / 2.0), velocities[0]),
        _region("upper face", other, "out", True, _beyond(axis, middle + apart / 2.0, -1.0), velocities[1]),
    ]
    meet = middle - apart / 2.0 + fraction * apart
    ahead = rng.uniform(6.0, 9.0)
    return sphere_table((ahead, meet if axis == 1 else 0.0, meet if axis == 2 else 4.0), 1.0), regions


def _door(rng: Generator) -> tuple[Table, list[Table]]:
    """Make a wall with a door, a soft region behind the door, and another one below the wall."""
    one, other = _two(rng)
    gap, edge = rng.uniform(1.4, 2.0), rng.uniform(5.5, 6.5)
    at, deep = rng.uniform(4.0, 6.0), rng.uniform(0.6, 2.0)
    door = rng.uniform(-1.5, 1.5)
    walls = [
        _region(name, "obstacle", "out", True, _box((at, at + 0.6), (door + left, door + right), (-5.0, edge)))
        for name, left, right in (("left wall", -20.0, -gap / 2.0), ("right wall", gap / 2.0, 20.0))
    ]
    width = rng.uniform(2.0, 4.0)
    behind = _box((at, at + deep), (door - width / 2.0, door + width / 2.0), (-5.0, edge))
    below = _beyond(2, edge - rng.uniform(0.0, 0.6))
    return sphere_table((10.0, rng.uniform(-1.0, 1.0), rng.uniform(3.5, 4.5)), 0.5), [
        *walls,
        _region("behind the door", one, "out", False, behind),
        _region("greatest depth", other, "in", False, below),
    ]


def _sides(rng: Generator) -> tuple[Table, list[Table]]:
    """Make an obstacle with a soft region on its left and another one on its right."""
    one, other = _two(rng)
    at, half = rng.uniform(4.0, 5.5), rng.uniform(1.0, 1.8)
    thick = rng.uniform(0.8, 2.0, 2)
    wide = rng.uniform(6.0, 9.0)
    return sphere_table((10.0, rng.uniform(-0.8, 0.8), rng.uniform(3.5, 4.5)), 0.5), [
        _region("obstacle ahead", "obstacle", "out", True, _box((at, at + 0.8), (-half, half), (-5.0, 15.0))),
        _region("left", one, "out", False, _box((at, at + thick[0]), (-half - wide, -half), (-5.0, 15.0))),
        _region("right", other, "out", False, _box((at, at + thick[1]), (half, half + wide), (-5.0, 15.0))),
    ]


def _squeeze(rng: Generator) -> tuple[Table, list[Table]]:
    """Make a minimum and a maximum depth, both soft, that exclude each other."""
    one, other = _two(rng)
    middle, overlap = rng.uniform(3.7, 4.3), rng.uniform(0.2, 1.0)
    return sphere_table((rng.uniform(8.0, 11.0), rng.uniform(-2.0, 2.0), middle), rng.uniform(0.8, 1.4)), [
        _region("least depth", one, "out", False, _beyond(2, middle + overlap / 2.0)),
        _region("greatest depth", other, "in", False, _beyond(2, middle - overlap / 2.0)),
    ]


def _view(rng: Generator) -> tuple[Table, list[Table]]:
    """Make a moving feature to be kept in view, with an obstacle, clutter, and a maximum depth on the path."""
    speed, drop = rng.uniform(0.1, 0.2), rng.uniform(0.0, 0.25)
    velocity = (speed, 0.0, drop * speed)
    end = 2.0 + 60.0 * speed
    radius, position = rng.uniform(0.4, 0.7), rng.uniform(3.5, 0.5 * end + 2.0)
    clutter = rng.uniform(0.5 * end + 1.0, end - 1.0)
    goal = sphere_table((2.0, 1.4, 3.8), 1.5) | {"velocity": list(velocity)}
    pillar = {"type": "cylinder", "start": [position, 2.6, 0.0], "end": [position, 2.6, 12.0], "radius": radius}
    risers = {"type": "cylinder", "start": [clutter, 2.2, 0.0], "end": [clutter, 2.2, 12.0], "radius": 1.0}
    cone = {"type": "cone", "feature": [2.0, 4.0, 4.2], "axis": [0.0, -1.0, -0.15], "half_angle": 0.35, "range": 2.6}
    return goal, [
        _region("pillar", "obstacle", "out", True, pillar),
        _region("risers", "shape", "out", False, risers),
        _region("greatest depth", "depth", "in", False, _beyond(2, 3.9 + drop * rng.uniform(0.2, 0.8) * end)),
        _region("view", "visibility", "in", False, cone, velocity),
    ]


def _in_turn(goal: Table, *positions: tuple[float, float, float]) -> Table:
    """Return a goal with further positions in turn."""
    return goal | {"then": [[float(x) for x in position] for position in positions], "stay": 3.0}


def _sides_in_turn(rng: Generator) -> tuple[Table, list[Table]]:
    """Make goals behind an obstacle, back at the start, and behind it again, with a soft region on each side."""
    goal, regions = _sides(rng)
    back = (rng.uniform(-1.0, 0.0), rng.uniform(-2.0, 2.0), rng.uniform(3.5, 4.5))
    return _in_turn(goal, back, (10.0, rng.uniform(-2.0, 2.0), rng.uniform(3.5, 4.5))), regions


def _depths_in_turn(rng: Generator) -> tuple[Table, list[Table]]:
    """Make goals near a minimum and a maximum depth in turn, both soft, which exclude each other."""
    goal, regions = _squeeze(rng)
    x, y, z = goal["center"]
    deep, shallow = z + rng.uniform(0.2, 0.8), z - rng.uniform(0.2, 0.8)
    goal["center"][2] = float(deep)
    return _in_turn(goal, (rng.uniform(0.0, 4.0), rng.uniform(-2.0, 2.0), shallow), (x, y, deep)), regions


def _views_in_turn(rng: Generator) -> tuple[Table, list[Table]]:
    """Make positions from which a structure is viewed in turn, with a pillar between them."""
    # A path outside of the pillar loses the view; one inside of it violates the region around the structure. A greatest
    # depth excludes the deeper positions.
    x, y, z = 4.0, 4.0, 4.2  # m, NED: center of the structure
    off, pillar, radius = rng.uniform(1.7, 2.2), rng.uniform(1.8, 2.2), rng.uniform(0.5, 0.9)
    angles = rng.uniform(0.7, 1.0, 3) * [-1.0, 1.0, -1.0]  # rad, about the structure, from east
    positions = [(x + off * np.sin(a), y - off * np.cos(a), z + rng.uniform(-0.6, 0.4)) for a in angles]
    standing = {"type": "cylinder", "start": [x, y - pillar, 0.0], "end": [x, y - pillar, 12.0], "radius": radius}
    cone = {"type": "cone", "feature": [x, y, z], "axis": [0.0, -1.0, 0.0], "half_angle": 1.2, "range": 2.6}
    return _in_turn(sphere_table(positions[0], 0.4), *positions[1:]), [
        _region("pillar", "obstacle", "out", True, standing),
        _region("structure", "shape", "out", False, sphere_table((x, y, z), rng.uniform(1.2, 1.6))),
        _region("greatest depth", "depth", "in", False, _beyond(2, z + rng.uniform(-0.3, 0.1))),
        _region("view", "visibility", "in", False, cone),
    ]


class _Family(NamedTuple):
    """Generators of the conflicts of a family."""

    stream: int  # first number of the random generator's seed
    kinds: Kinds  # generator of each kind of conflict
    duration: float  # s, duration of a flight


_KINDS: Kinds = {
    "ceiling": partial(_closing, axis=2, middle=4.0),  # a ceiling and a maximum depth
    "dock": partial(_closing, axis=1, middle=0.0),  # the walls of a dock
    "door": _door,
    "sides": _sides,
    "squeeze": _squeeze,
    "view": _view,
}
_TOURS: Kinds = {
    "sides in turn": _sides_in_turn,
    "depths in turn": _depths_in_turn,
    "views in turn": _views_in_turn,
}
CONFLICTS = {"conflict": _Family(20261124, _KINDS, 60.0), "tour": _Family(20261125, _TOURS, 120.0)}
