"""Identification of vehicles whose numbers are known: errors, coverage of the 95 % intervals, and times.

``python -m benchmarks.identification N [--seed K] [--duration S] [--noise F]``. Each is a BlueROV2 Heavy with
other damping, added mass (all 21 elements), buoyancy, its center and thruster lag, in a current. The FMU moves it
by multisines on all axes about a station that it keeps; sensors are white: DVL 5 mm/s at 6.7 Hz, gyro 2 mrad/s with
biases, attitude 5 mrad and depth 3 mm at 20 Hz. The search starts from the shipped numbers.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.quaternion import from_axis_angle, multiply, rotation_matrix
from cosim.identification.fit import Fit, fit, integration_step
from cosim.identification.log import Log, make_topic
from cosim.identification.parameters import (
    DEFAULT_FREE,
    DEFAULT_NUISANCES,
    Parameter,
    free_parameters,
    nuisances,
)
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from plant_fmu import Plant, Vehicle, load_vehicle

Array = NDArray[np.float64]

PERIOD = 0.05  # s, of the commands
_FREQUENCIES = np.array([0.05, 0.09, 0.14, 0.21, 0.3, 0.41])  # Hz
_FORCE = np.array([22.0, 22.0, 22.0, 1.5, 1.5, 2.0])  # N, N m
_STATION = (30.0, 25.0)  # N/m, N s/m, of what brings it back
_LEVEL = (6.0, 1.5)  # N m/rad, N m s/rad
_NAMES = (
    *(f"position.{axis}" for axis in "xyz"), *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{name}" for name in "uvwpqr"),
)  # fmt: skip
_DEPTH = 5.0  # m


def draw_truth(parameters: list[Parameter], vehicle: Vehicle, rng: np.random.Generator) -> Array:
    """Return the true numbers of one vehicle."""
    body = np.diag(vehicle.mass_matrix)
    values = []
    for p in parameters:
        key, *place = p.name.split(".")[1:]
        if key == "time_constant":
            values.append(rng.uniform(0.05, 0.2))
        elif key == "added_mass":
            i, j = (int(x) - 1 for x in place)
            part = rng.uniform(0.6, 1.6) * p.start if i == j else rng.uniform(-0.05, 0.05) * np.sqrt(body[i] * body[j])
            values.append(float(part))
        elif key.endswith("damping"):
            values.append(rng.uniform(0.5, 1.5) * max(p.start, 0.3 * p.deviation))
        elif key == "buoyancy":
            values.append(vehicle.weight + rng.uniform(-2.0, 2.0))
        else:
            values.append(p.start + rng.uniform(-0.005, 0.005) - (0.02 if place == ["3"] else 0.0))
    return np.array(values)


def simulate(vehicle: Vehicle, truth: dict[str, float], duration: float, noise: float, rng: np.random.Generator) -> Log:
    """Return the log of a vehicle whose FMU has true numbers, and how far it went."""
    times: Any = PERIOD * np.arange(int(duration / PERIOD))
    phases = rng.uniform(0.0, 2.0 * np.pi, (6, len(_FREQUENCIES)))
    spread = 1.0 + 0.06 * np.arange(6)[:, None]
    waves = np.sin(2.0 * np.pi * spread[..., None] * _FREQUENCIES[:, None] * times + phases[..., None]).sum(axis=1)
    wanted = _FORCE[:, None] * waves / np.sqrt(0.5 * len(_FREQUENCIES)) / 1.5
    inverse, states, thrust = np.linalg.pinv(vehicle.thruster_matrix), [], []
    with Plant(vehicle) as plant:
        plant.set(truth | {"position.z": _DEPTH})
        plant.initialise()
        for k in range(len(times)):
            state = np.array([plant[name] for name in _NAMES])
            R = rotation_matrix(state[3:7])
            wrench = wanted[:, k].copy()
            wrench[:3] -= R.T @ (_STATION[0] * (state[:3] - [0.0, 0.0, _DEPTH])) * [0.15, 0.15, 1.0]
            wrench[:3] -= _STATION[1] * state[7:10] * [0.2, 0.2, 0.6]
            wrench[3:] -= (
                _LEVEL[0] * 2.0 * np.sign(state[3]) * state[4:7] * [0.3, 0.3, 1.0] + _LEVEL[1] * state[10:13] * 0.3
            )
            forces = np.clip(inverse @ wrench, vehicle.thrust_min, vehicle.thrust_max)
            plant.set({f"thrust[{i + 1}]": float(x) for i, x in enumerate(forces)})
            states.append(state)
            thrust.append(forces)
            plant.step(PERIOD)
    moved: Array = np.array(states, np.float64)

    def noisy(values: Array, deviation: float) -> Array:
        found: Array = values + deviation * noise * rng.standard_normal(values.shape)
        return found

    turned: Array = np.array([
        multiply(q, from_axis_angle(a / np.linalg.norm(a), float(np.linalg.norm(a))))
        for q, a in zip(moved[:, 3:7], noisy(np.zeros((len(moved), 3)), 0.005), strict=True)
    ], np.float64)  # fmt: skip
    bias: Any = rng.uniform(-0.003, 0.003, 3)
    dvl = slice(None, None, 3)
    topics = (
        make_topic("velocity", times[dvl], noisy(moved[dvl, 7:10], 0.005), 0.005 * noise),
        make_topic("angular_velocity", times, noisy(moved[:, 10:] + bias, 0.002), 0.002 * noise),
        make_topic("depth", times, noisy(moved[:, 2:3], 0.003), 0.003 * noise),
        make_topic("attitude", times, turned, 0.005 * noise),
    )
    commands: Any = np.array(thrust)
    return Log("simulated", times, commands, np.zeros((len(times), 6)), topics)


def relative_errors(parameters: list[Parameter], truth: Array, found: Array) -> dict[str, list[float]]:
    """Return errors by group: parts of the numbers, of off-diagonal added mass parts of the geometric mean, and N."""
    diagonal = {int(p.name.split(".")[2]): x for p, x in zip(parameters, truth, strict=True) if _is_diagonal(p)}
    groups: dict[str, list[float]] = {}
    for p, x, y in zip(parameters, truth, found, strict=True):
        key, *place = p.name.split(".")[1:]
        error = abs(y - x)
        if key == "added_mass" and not _is_diagonal(p):
            i, j = map(int, place)
            groups.setdefault("added mass, off-diagonal", []).append(error / np.sqrt(diagonal[i] * diagonal[j]))
        elif key == "buoyancy":
            groups.setdefault("weight less buoyancy [N]", []).append(error)
        elif key == "center_of_buoyancy":
            groups.setdefault("center of buoyancy [m]", []).append(error)
        else:
            groups.setdefault(key.replace("_", " "), []).append(error / abs(x))
    return groups


def _is_diagonal(p: Parameter) -> bool:
    place = p.name.split(".")[2:]
    return "added_mass" in p.name and place[0] == place[1]


def jacobian_times(log: Log, vehicle: Vehicle, parameters: list[Parameter], done: Fit) -> tuple[float, float]:
    """Return the process time of the exact Jacobian of a window of 20 s, and of one by forward differences [s]."""
    windows = cut_windows([log], vehicle, integration_step([log]), 20.0)[0][:1]
    problem = Residuals([log], vehicle, parameters, windows, integration_step([log]))
    settings = problem.settings(done.values)
    started = time.process_time()
    for i, window in enumerate(windows):
        problem.raw(i, settings, window.start, full=True)
    exact = time.process_time() - started
    started = time.process_time()
    for x in (done.values, *(done.values + row for row in np.diag(1e-6 * done.intervals.deviations))):
        settings = problem.settings(x)
        for i, window in enumerate(windows):
            problem.raw(i, settings, window.start, full=False)
    return exact, time.process_time() - started


def main() -> None:
    """Print one JSON line for each vehicle, and one of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vehicles", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--duration", type=float, default=300.0, help="of each run [s]")
    parser.add_argument("--noise", type=float, default=1.0, help="factor of all noise")
    options = parser.parse_args()
    vehicle, start = load_vehicle("bluerov2_heavy"), free_parameters(load_vehicle("bluerov2_heavy"), DEFAULT_FREE)
    groups: dict[str, list[float]] = {}
    covered: list[bool] = []
    nominal: list[bool] = []
    for seed in range(options.seed, options.seed + options.vehicles):
        rng = np.random.default_rng([seed, 27])
        truth = draw_truth(start, vehicle, rng)
        current = dict(zip(("current.x", "current.y"), rng.uniform(-0.15, 0.15, 2).tolist(), strict=True))
        plant = {p.plant: float(x) for p, x in zip(start, truth, strict=True) if p.plant}
        lag = float(truth[[p.kind for p in start].index("lag")])
        lags = {f"thrust_time_constant[{i + 1}]": lag for i in range(vehicle.n_thrusters)}
        log = simulate(vehicle, plant | current | lags, options.duration, options.noise, rng)
        parameters = [*start, *nuisances(DEFAULT_NUISANCES, [log])]
        wall, process = time.perf_counter(), time.process_time()
        done = fit([log], vehicle, parameters)
        wall, process = time.perf_counter() - wall, time.process_time() - process
        off = np.abs(done.values[: len(start)] - truth)
        inside = off <= done.intervals.factor * done.intervals.deviations[: len(start)]
        covered += inside.tolist()
        nominal += (off <= 1.96 * done.intervals.nominal[: len(start)]).tolist()
        for name, errors in relative_errors(start, truth, done.values[: len(start)]).items():
            groups.setdefault(name, []).extend(errors)
        line = {
            "seed": seed, "chi2": round(done.intervals.chi2, 3), "covered": f"{inside.sum()} of {inside.size}",
            "rejected": done.rejected.total(), "wall": round(wall, 1), "process": round(process, 1),
        }  # fmt: skip
        print(json.dumps(line), flush=True)
    exact, differences = jacobian_times(log, vehicle, parameters, done)
    print(json.dumps({
        "median errors": {name: float(f"{np.median(x):.2g}") for name, x in groups.items()},
        "coverage": round(float(np.mean(covered)), 3), "nominal coverage": round(float(np.mean(nominal)), 3),
        "exact Jacobian [s]": round(exact, 2), "by differences [s]": round(differences, 2),
    }))  # fmt: skip


if __name__ == "__main__":
    main()
