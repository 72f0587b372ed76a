"""Scenes whose plant differs from the vehicle's file, which is all that laws receive."""

# A scene is admitted if the path search of `cosim check` finds a way past its regions as they are at the start, and if
# the true thrust in the worst direction is at least `_RESERVE` times the sum of |W - B| and the greatest drag of the
# vehicle at rest, at either end of the depth band, in the mean current plus `_GUSTS` standard deviations. No flight
# enters the rule. Scenes that are not admitted have the kind `EXCLUDED`: totals of a campaign include them, its
# numbers by kind do not mix them with others.

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from controller.laws.deployable.gains import DeployableGains
from cosim.campaigns.scenes.scene_tables import (
    Generator,
    Table,
    each_thruster,
    horizontal,
    scenario_table,
    sphere_table,
    thruster_lags,
)  # fmt: skip
from cosim.campaigns.scenes.trials import hard_region, obstacle
from cosim.precheck.path_search import find_path
from cosim.precheck.thrust_margin import drag_wrench, least_margins
from cosim.scenario.scenario import Scenario, validate_scenario
from cosim.scenario.true_vehicle import true_vehicle
from plant_fmu.vehicle import Vehicle, load_vehicle

VEHICLES = ("odin", "bluerov2_heavy", "bluerov2_heavy_wu", "rexrov")
EXCLUDED = "excluded"
_OTHER_SET = {"bluerov2_heavy": "bluerov2_heavy_wu", "bluerov2_heavy_wu": "bluerov2_heavy"}
_LAG = 0.15  # s, lag of the BlueROV2's thrusters, for which no source has one
_START, _GOAL = np.array([0.0, 0.0, 4.0]), np.array([10.0, 0.0, 4.0])
_GOAL_RADIUS = 0.5  # m
_DEPTHS = (1.5, 6.5)  # m
_DURATION = 90.0  # s
_NET_WEIGHT = 0.01  # maximum |W - B|, as a fraction of the weight
_CURRENT = 0.3  # m/s, maximum speed of the current
_RESERVE = 1.2  # minimum ratio of available to required thrust
_GUSTS = 2.0  # standard deviations of the varying current that the thrust must bear


def make_mismatch(seed: int) -> Table:
    """Make the scene of a seed."""
    rng = np.random.default_rng([20261127, seed])
    kind = _KINDS_DRAWN[int(rng.integers(len(_KINDS_DRAWN)))]
    vehicles = list(_OTHER_SET) if kind == "other set" else VEHICLES
    vehicle = load_vehicle(vehicles[int(rng.integers(len(vehicles)))])
    band = {"type": "depth_band", "depth": sum(_DEPTHS) / 2.0, "tolerance": (_DEPTHS[1] - _DEPTHS[0]) / 2.0}
    regions = [hard_region(f"obstacle {i + 1}", obstacle(rng)) for i in range(int(rng.integers(4, 9)))]
    net = _NET_WEIGHT * vehicle.weight * rng.uniform(-1.0, 1.0)
    parameters = {
        "seed": seed % 2**31,
        "buoyancy": float(vehicle.weight - net),
        **thruster_lags(vehicle, vehicle.thrust_time_constant),
    }
    if "bluerov2" in vehicle.name:
        parameters |= thruster_lags(vehicle, vehicle.thrust_time_constant + _LAG)
    current = horizontal(rng.uniform(-np.pi, np.pi), rng.uniform(0.0, _CURRENT))
    table = scenario_table(
        f"Mismatch {seed}: {kind}, {vehicle.name}", seed, vehicle, _DURATION, current, parameters, _START.tolist(),
        {"goal": sphere_table(_GOAL, _GOAL_RADIUS)}, [*regions, hard_region("depth band", band, "depth", "in")],
    )  # fmt: skip
    _KINDS[kind](rng, vehicle, parameters)
    scenario = validate_scenario(table | {"law": {"name": "deployable"}}, f"mismatch-{seed}", vehicle)
    return {"seed": seed, "kind": kind if is_admitted(scenario) else EXCLUDED, "scenario": table}


def is_admitted(scenario: Scenario) -> bool:
    """Return True if there is a way to the goal, and thrust for it."""
    vehicle, over = true_vehicle(scenario), scenario.plant.parameters
    level, alive = np.array([1.0, 0.0, 0.0, 0.0]), np.ones((1, scenario.vehicle.n_thrusters))
    (thrust,) = least_margins(vehicle, level, np.zeros(6), alive)
    needed = 0.0
    for depth in _DEPTHS:
        current = np.array(scenario.plant.current)
        current += depth * np.array([over.get(f"current_shear.{axis}", 0.0) for axis in "xyz"])
        speed = float(np.linalg.norm(current))
        gust = _GUSTS * over.get("current_variation.x", 0.0)
        current = current * (1.0 + gust / speed) if speed > 0.0 else np.array([gust, 0.0, 0.0])
        needed = max(needed, float(np.linalg.norm(drag_wrench(vehicle, level, current)[:3])))
    if thrust is None or thrust.force < _RESERVE * (abs(vehicle.weight - vehicle.buoyancy) + needed):
        return False
    regions = [secondary.region for secondary in scenario.regions]
    start, duration = scenario.initial.position, scenario.time.duration
    return find_path(regions, scenario.goal_region, start, DeployableGains(), duration).found


def _drag(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Multiply all damping by 0.5 to 2."""
    _set_damping(vehicle, 2.0 ** rng.uniform(-1.0, 1.0), parameters)


def _set_damping(vehicle: Vehicle, factor: float, parameters: dict[str, float]) -> None:
    for name in ("linear_damping", "quadratic_damping"):
        parameters |= {f"{name}[{i + 1}]": float(factor * x) for i, x in enumerate(getattr(vehicle, name))}


def _limits(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Lower the limits to 0.5 to 1 of the file's, of all thrusters alike or of each."""
    left = rng.uniform(0.5, 1.0) if rng.integers(2) else rng.uniform(0.5, 1.0, vehicle.n_thrusters)
    parameters |= each_thruster(vehicle, "thrust_min", left * vehicle.thrust_min)
    parameters |= each_thruster(vehicle, "thrust_max", left * vehicle.thrust_max)


def _added_mass(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Multiply the added mass by 0.5 to 1.5."""
    _set_added_mass(rng.uniform(0.5, 1.5) * vehicle.added_mass, parameters)


def _set_added_mass(matrix: object, parameters: dict[str, float]) -> None:
    rows = np.asarray(matrix)
    parameters |= {f"added_mass[{i + 1},{j + 1}]": float(rows[i, j]) for i in range(6) for j in range(i, 6)}


def _mass(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Multiply mass, inertia, weight and buoyancy by 0.7 to 1.3."""
    _set_mass(vehicle, rng.uniform(0.7, 1.3), parameters)


def _set_mass(vehicle: Vehicle, factor: float, parameters: dict[str, float]) -> None:
    parameters |= {"mass": factor * vehicle.mass, "weight": factor * vehicle.weight}
    parameters["buoyancy"] += (factor - 1.0) * vehicle.weight
    for name, (i, j) in {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}.items():
        parameters[f"inertia.{name}"] = float(factor * vehicle.inertia[i, j])


def _dead_band(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Set a dead band of up to 0.15."""
    parameters |= each_thruster(vehicle, "thrust_dead_band", rng.uniform(0.0, 0.15))


def _lag(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Set a lag of up to 0.5 s."""
    parameters |= thruster_lags(vehicle, rng.uniform(0.0, 0.5))


def _gusts(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Let the current vary by a standard deviation of up to 0.2 m/s, a third of it vertically."""
    spread = rng.uniform(0.05, 0.2)
    parameters |= {"current_variation.x": spread, "current_variation.y": spread, "current_variation.z": spread / 3.0}
    parameters["current_correlation_time"] = rng.uniform(2.0, 8.0)


def _shear(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Let the current change with depth by up to 0.05 m/s each meter."""
    x, y, _ = horizontal(rng.uniform(-np.pi, np.pi), rng.uniform(0.0, 0.05))
    parameters |= {"current_shear.x": x, "current_shear.y": y}


def _arms(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Displace the center of buoyancy by up to 3 cm, and each thruster's arms by up to a tenth of their length."""
    for axis, shift in zip("xyz", rng.uniform(-0.03, 0.03, 3), strict=True):
        parameters[f"r_B.{axis}"] = float(vehicle.r_B["xyz".index(axis)] + shift * (0.3 if axis == "z" else 1.0))
    arms = vehicle.thruster_matrix[3:] * rng.uniform(0.9, 1.1, (3, vehicle.n_thrusters))
    parameters |= {f"thruster_matrix[{i + 4},{j + 1}]": float(x) for (i, j), x in np.ndenumerate(arms)}


def _other_set(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Take drag and added mass of the other published set of the vehicle."""
    other = load_vehicle(_OTHER_SET[vehicle.name])
    _set_damping(other, 1.0, parameters)
    _set_added_mass(other.added_mass, parameters)


def _several(rng: Generator, vehicle: Vehicle, parameters: dict[str, float]) -> None:
    """Let about half of the other differences come together."""
    for change in _SINGLE.values():
        if rng.integers(2):
            change(rng, vehicle, parameters)


_SINGLE: dict[str, Callable[[Generator, Vehicle, dict[str, float]], None]] = {
    "drag": _drag,
    "limits": _limits,
    "added mass": _added_mass,
    "mass": _mass,
    "dead band": _dead_band,
    "lag": _lag,
    "gusts": _gusts,
    "shear": _shear,
    "arms": _arms,
}
_KINDS = _SINGLE | {"other set": _other_set, "several": _several}
_KINDS_DRAWN = [*_KINDS, "other set", "several", "several", "several"]
