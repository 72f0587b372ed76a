"""Scenes that test one part of a law each: an estimate, fault detection, or path planning."""

# Each scene is a scenario with hard regions only: spheres near the path with narrow gaps, and one property that laws do
# not receive and that is far from nominal. The generator does not depend on the performance of any law.

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cosim.campaigns.scenes.scene_tables import (
    Generator,
    Table,
    each_thruster,
    horizontal,
    scenario_table,
    sphere_table,
    thruster_lags,
)  # fmt: skip
from plant_fmu.vehicle import Vehicle, load_vehicle

VEHICLES = ("odin", "bluerov2_heavy", "rexrov")
_START, _GOAL = np.array([0.0, 0.0, 4.0]), np.array([10.0, 0.0, 4.0])
_GOAL_RADIUS = 0.5  # m
_FREE = 0.8  # m, minimum distance of an obstacle from the start and from the goal region


def make_trial(seed: int) -> Table:
    """Make the trial of a seed."""
    rng = np.random.default_rng([20261125, seed])
    vehicle = load_vehicle(VEHICLES[int(rng.integers(len(VEHICLES)))])
    kind = list(_KINDS)[int(rng.integers(len(_KINDS)))]
    regions = [
        *(hard_region(f"obstacle {i + 1}", obstacle(rng)) for i in range(int(rng.integers(6, 12)))),
        hard_region("depth band", {"type": "depth_band", "depth": 4.0, "tolerance": 2.5}, "depth", "in"),
    ]
    table = scenario_table(
        f"Trial {seed}: {kind}, {vehicle.name}", seed, vehicle, 60.0, [0.0, 0.0, 0.0], thruster_lags(vehicle, 0.0),
        _START.tolist(), {"goal": sphere_table(_GOAL, _GOAL_RADIUS)}, regions,
    )  # fmt: skip
    _KINDS[kind](rng, vehicle, table)
    return {"seed": seed, "kind": kind, "scenario": table}


def hard_region(name: str, shape: Table, criterion: str = "obstacle", keep: str = "out") -> Table:
    """Return the table of a hard region."""
    return {"name": name, "criterion": criterion, "keep": keep, "gain": 100.0, "shape": shape}


def obstacle(rng: Generator) -> Table:
    """Return a sphere near the path, at a distance from start and goal."""
    while True:
        radius = rng.uniform(0.3, 0.9)
        center = _START + rng.uniform(0.2, 0.8) * (_GOAL - _START) + rng.normal(0.0, [0.3, 0.8, 0.8])
        free = np.linalg.norm(center - _START), np.linalg.norm(center - _GOAL) - _GOAL_RADIUS
        if min(free) - radius > _FREE:
            return sphere_table(center, radius)


def _net_weight(rng: Generator, vehicle: Vehicle, table: Table) -> None:
    """Make the vehicle heavy or light by 25 to 50 N, or by 1.25 to 2.5 % of its weight if that is more."""
    max_net_weight = max(50.0, 0.025 * vehicle.weight)
    net = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0) * max_net_weight
    table["plant"]["parameters"]["buoyancy"] = float(vehicle.weight - net)


def _current(rng: Generator, vehicle: Vehicle, table: Table) -> None:
    """Set a current of 0.25 to 0.5 m/s."""
    heading, speed = rng.uniform(-np.pi, np.pi), rng.uniform(0.25, 0.5)
    table["plant"]["current"] = horizontal(heading, speed)


def _moments(rng: Generator, vehicle: Vehicle, table: Table) -> None:
    """Displace the center of buoyancy horizontally by 2 to 5 cm, so that the vehicle would rest tilted."""
    heading, arm = rng.uniform(-np.pi, np.pi), rng.uniform(0.02, 0.05)
    parameters = table["plant"]["parameters"]
    parameters["r_B.x"] = float(vehicle.r_B[0] + arm * np.cos(heading))
    parameters["r_B.y"] = float(vehicle.r_B[1] + arm * np.sin(heading))


def _effectiveness(rng: Generator, vehicle: Vehicle, table: Table) -> None:
    """Set the effectiveness of each thruster to 0.6 to 1."""
    wear = rng.uniform(0.6, 1.0, vehicle.n_thrusters)
    table["plant"]["parameters"] |= each_thruster(vehicle, "thrust_effectiveness", wear)


def _lag(rng: Generator, vehicle: Vehicle, table: Table) -> None:
    """Set a lag of the thrusters of 0.2 to 0.5 s, which is not in the vehicle's file."""
    table["plant"]["parameters"] = thruster_lags(vehicle, float(rng.uniform(0.2, 0.5)))


def _failure(rng: Generator, vehicle: Vehicle, table: Table) -> None:
    """Let a thruster fail or stick during the run."""
    thruster, time = int(rng.integers(1, vehicle.n_thrusters + 1)), float(rng.uniform(2.0, 8.0))
    table["failures"] = [{"thruster": thruster, "time": time, "stuck": bool(rng.integers(2))}]


def _pocket(rng: Generator, vehicle: Vehicle, table: Table) -> None:
    """Replace the spheres by a pocket on the path, open towards the start."""
    at, deep, half = rng.uniform(5.0, 7.0), rng.uniform(1.5, 3.5), rng.uniform(1.0, 2.0)
    walls = {
        "back": ((at, at + 0.4), (-half - 0.4, half + 0.4)),
        "left": ((at - deep, at), (-half - 0.4, -half)),
        "right": ((at - deep, at), (half, half + 0.4)),
    }
    boxes = {
        name: {"type": "box", "center": [sum(x) / 2.0, sum(y) / 2.0, 4.0], "size": [x[1] - x[0], y[1] - y[0], 8.0]}
        for name, (x, y) in walls.items()
    }
    table["regions"] = [table["regions"][-1], *(hard_region(name, box) for name, box in boxes.items())]


_KINDS: dict[str, Callable[[Generator, Vehicle, Table], None]] = {
    "net weight": _net_weight,
    "current": _current,
    "moments": _moments,
    "effectiveness": _effectiveness,
    "lag": _lag,
    "failure": _failure,
    "pocket": _pocket,
}
