"""Generators of random scenes for campaigns, determined by the seed."""

# A scene has a start, a spherical goal region, spheres near the straight path to it, a depth band, a steady current,
# and restoring forces that laws do not receive. A hard one has more obstacles, the first of which drifts, a stronger
# current, noise, and a thruster that fails. `cosim.campaigns.scenes.scene` defines the numbers.

from __future__ import annotations

import functools
import itertools
import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.campaigns.scenes.conflicts import make_conflict
from cosim.campaigns.scenes.scene import ODIN
from cosim.campaigns.scenes.trials import make_trial
from cosim.errors import ScenarioError
from plant_fmu.vehicle import Vehicle, load_vehicle

MAX_OBSTACLES = {"plain": 6, "hard": 14}  # maximum number of obstacles of each kind of scene
_GOAL_RADIUS = 0.5  # m
_FREE = 0.6  # m, minimum distance of an obstacle from the start and from the goal region


def generate_scenes(count: int, seed: int = 0, kind: str = "plain", vehicle: str | None = None) -> Iterator[str]:
    r"""Generate scenes with successive seeds.

    Parameters
    ----------
    count : int
        Number of scenes.
    seed : int
        Seed of the first scene, 0 or above.
    kind : {"plain", "hard", "conflict", "tour", "trial", "mismatch"}
        Kind of all scenes; the last four as in the modules `conflicts`, `trials` and `mismatches`.
    vehicle : str, optional
        Vehicle of plain and hard scenes, a shipped name or a TOML file; default: ODIN. The other kinds draw theirs.

    Yields
    ------
    str
        Scene as a line of JSON for `cosim.campaigns.scenes.scene_file.read_scenes`.

    Raises
    ------
    ScenarioError, VehicleError
        If the kind takes no vehicle, or there is no such vehicle.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cosim
    >>> _ = Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(2)))
    >>> len(list(cosim.read_scenes(Path("scenes.jsonl"))))
    2
    """
    if vehicle and kind not in MAX_OBSTACLES:
        raise ScenarioError(
            f"kind is {kind!r}, whose scenes draw their vehicles, expected plain or hard with a vehicle"
        )
    of = {"vehicle": load_vehicle(vehicle), "name": vehicle} if vehicle else {}
    for one in range(seed, seed + count):
        yield json.dumps(MAKERS[kind](one, **of))


def make_scene(
    seed: int, kind: str = "plain", vehicle: Vehicle | None = None, name: str | None = None
) -> dict[str, Any]:
    """Make the scene of a seed, for ODIN or a vehicle by its name or file."""
    rng = np.random.default_rng([20261121, seed, int(kind == "hard")])
    scene = draw_scene(rng, itertools.repeat(rng), seed, kind)
    if vehicle is None:
        return scene
    # restoring forces and moments in proportion to the vehicle's; its thrusters fail alike
    odin = load_vehicle(ODIN)
    scene["vehicle"] = name
    scene["weight_minus_buoyancy"] *= vehicle.weight / odin.weight
    scene["righting_moment"] *= vehicle.righting_moment / odin.righting_moment
    if failure := scene["failed_thruster"]:
        failure["index"] = 1 + failure["index"] % vehicle.n_thrusters
    return scene


def draw_scene(rng: Any, of_obstacles: Iterable[Any], seed: int, kind: str) -> dict[str, Any]:
    """Make a plain or hard scene; `rng` and those of the obstacles have the methods of a NumPy generator."""
    hard = kind == "hard"
    start = np.array([0.0, 0.0, rng.uniform(1.5, 4.0)])
    goal = np.array([rng.uniform(8.0, 12.0), rng.uniform(-3.0, 3.0), rng.uniform(1.5, 4.5)])
    n_obstacles = int(rng.integers(6 if hard else 1, MAX_OBSTACLES[kind] + 1))
    obstacles = [_make_obstacle(of, start, goal) for of in itertools.islice(of_obstacles, n_obstacles)]
    heading, speed = rng.uniform(-np.pi, np.pi), rng.uniform(0.0, 0.4 if hard else 0.25)
    if hard:
        obstacles[0]["velocity"] = rng.uniform([-0.08, -0.1, 0.0], [0.0, 0.1, 0.0]).tolist()
    return {
        "seed": seed,
        "start": start.tolist(),
        "goal": {"centre": goal.tolist(), "radius": _GOAL_RADIUS},
        "obstacles": obstacles,
        "depth_band": [0.3, 7.0],
        "current": [float(speed * np.cos(heading)), float(speed * np.sin(heading)), 0.0],
        "weight_minus_buoyancy": rng.uniform(-15.0, 15.0),
        "righting_moment": rng.uniform(10.0, 62.0),
        "noise": {"position": 0.02, "velocity": 0.01} if hard else {"position": 0.0, "velocity": 0.0},
        "failed_thruster": {"index": int(rng.integers(1, 9)), "time": rng.uniform(5.0, 30.0)} if hard else None,
    }


def _make_obstacle(rng: Any, start: NDArray[np.float64], goal: NDArray[np.float64]) -> dict[str, Any]:
    while True:
        radius = rng.uniform(0.3, 0.9)
        center = start + rng.uniform(0.2, 0.8) * (goal - start) + rng.normal(0.0, [0.3, 0.6, 0.5])
        clear_start = np.linalg.norm(center - start) - radius
        clear_goal = np.linalg.norm(center - goal) - radius - _GOAL_RADIUS
        if min(clear_start, clear_goal) > _FREE:
            return {"centre": center.tolist(), "radius": radius, "velocity": [0.0, 0.0, 0.0]}


def _make_mismatch(seed: int) -> dict[str, Any]:
    from cosim.campaigns.scenes.mismatches import make_mismatch  # needs SciPy

    return make_mismatch(seed)


MAKERS: dict[str, Callable[[int], dict[str, Any]]] = {
    "plain": make_scene,
    "hard": functools.partial(make_scene, kind="hard"),
    "conflict": make_conflict,
    "tour": functools.partial(make_conflict, family="tour"),
    "trial": make_trial,
    "mismatch": _make_mismatch,
}
