"""Random scenes for flights with a real autopilot: spheres between start and goal, a current, and a wrong weight."""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim.scenario.scenario import Scenario, load_scenario, validate_scenario
from plant_fmu import load_vehicle

GOAL_RADIUS = 0.5  # m
VEHICLE = "bluerov2_heavy"
OTHER_SET = "bluerov2_heavy_wu"  # the other published drag and added mass of that vehicle
_FREE = 0.6  # m, minimum distance of an obstacle from the start, from the dive below it, and from the goal
_DIVE = 0.6  # m, depth of the dive below the start
_MOST_DRAWS = 1000  # draws of an obstacle, after which it is left out


def random_scene(seed: int, has_other_set: bool = False) -> Scenario:
    """Make a random scene: spheres, a current, and a vehicle that is too light or too heavy.

    With `has_other_set` the plant has drag and added mass of `OTHER_SET`, which the law does not know.
    """
    # up to 30 spheres of radius 0.3 m to 0.9 m, a goal 8 m to 12 m ahead, a current of up to 0.4 m/s, |W - B| up to
    # 15 N; the DVL measures 8 times a second with a noise of 0.01 m/s
    rng = np.random.default_rng([20261125, seed])
    start = np.array([0.0, 0.0, rng.uniform(1.5, 4.0)])
    goal = np.array([rng.uniform(8.0, 12.0), rng.uniform(-3.0, 3.0), rng.uniform(1.5, 4.5)])
    places = [start, start + np.array([0.0, 0.0, _DIVE])]
    heading, speed = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, 0.4)
    vehicle = load_vehicle(VEHICLE)
    regions: list[dict[str, Any]] = [
        {"name": "depth", "criterion": "depth", "keep": "in", "gain": 100.0,
         "shape": {"type": "depth_band", "depth": 3.65, "tolerance": 3.35}}
    ]  # fmt: skip
    for i in range(int(rng.integers(6, 31))):
        for _ in range(_MOST_DRAWS):
            radius = rng.uniform(0.3, 0.9)
            center = start + rng.uniform(0.1, 0.9) * (goal - start) + rng.normal(0.0, [0.5, 1.5, 1.0])
            away = min(*(np.linalg.norm(center - p) for p in places), np.linalg.norm(center - goal) - GOAL_RADIUS)
            if away - radius > _FREE:
                shape = {"type": "sphere", "center": center.tolist(), "radius": float(radius)}
                regions.append(
                    {"name": f"rock {i + 1}", "criterion": "obstacle", "keep": "out", "gain": 100.0, "shape": shape}
                )
                break
    table = load_scenario("docking").table
    table = {name: table[name] for name in ("vehicle", "time", "law", "arbiter", "actuation", "sensing")} | {
        "title": f"Random scene {seed}",
        "plant": {
            "current": [float(speed * np.cos(heading)), float(speed * np.sin(heading)), 0.0],
            "parameters": {
                "buoyancy": vehicle.weight + float(rng.uniform(-15.0, 15.0)),
                "dvl.rate": 8.0,
                "dvl.velocity_noise": 0.01,
            },
        },
        "initial": {"position": start.tolist()},
        "goal": {"type": "sphere", "center": goal.tolist(), "radius": GOAL_RADIUS},
        "law": {"name": "deployable"},
        "regions": regions,
    }
    if has_other_set:
        table["plant"]["parameters"] |= _other_parameters()
    return validate_scenario(table, f"random-{seed}", vehicle)


def _other_parameters() -> dict[str, float]:
    other = load_vehicle(OTHER_SET)
    matrix = {f"added_mass[{i + 1},{j + 1}]": float(other.added_mass[i, j]) for i in range(6) for j in range(i, 6)}
    damping = {
        f"{name}[{i + 1}]": float(x)
        for name in ("linear_damping", "quadratic_damping")
        for i, x in enumerate(getattr(other, name))
    }
    return matrix | damping
