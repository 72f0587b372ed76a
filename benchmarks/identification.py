"""Identification of vehicles whose numbers are known: errors, coverage of the 95 % intervals, and times.

``python -m benchmarks.identification N [--seed K] [--duration S] [--noise F] [--nuisance NAME ... [--unknown]] [--dive]
[--out FILE]``. With a file each vehicle is a line of it, and those that it has are not flown again.
Each is a BlueROV2 Heavy with other damping, added mass (all 21 elements), buoyancy, its center and thruster lag, in a
current. It gets the sticks of ``identify --excite`` in a box of 10 m, which know the shipped numbers alone. Sensors are
white: DVL 5 mm/s at 6.7 Hz, gyro 2 mrad/s with biases, attitude 5 mrad and depth 3 mm at 20 Hz. The search starts from
the shipped numbers. A nuisance is one of: ``force``, random of 0.2 to 0.5 N that changes within 5 to 10 s; ``bias`` of
the gyro, up to 20 mrad/s; ``scale`` of the DVL, 1 %; ``thrusters`` that give 90 to 110 %; ``asymmetric``, and less
force backward; ``delay`` of all sensors, 0.2 s. It is estimated, where the identification has a number for it, or not.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from controller.quaternion import from_axis_angle, multiply
from cosim.identification.excitation import DVL_PERIOD, NOISE, ROW, design, excitation_scenario, rehearse
from cosim.identification.findings import MIN_CAUSE_FRACTION
from cosim.identification.fit import Fit, fit, integration_step
from cosim.identification.intervals import DISAGREES
from cosim.identification.log import Log, make_topic
from cosim.identification.parameters import (
    DEFAULT_FREE,
    DEFAULT_NUISANCES,
    RANDOM_FORCE,
    Parameter,
    free_parameters,
    nuisances,
)
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import Command, ManualControl, SetMode
from plant_fmu import Plant, Vehicle, load_vehicle

Array = NDArray[np.float64]

VEHICLE, DEPTH, BOX = "bluerov2_heavy", 5.0, (10.0, 10.0, 4.0)  # m, depth of the center of the box, and its sizes
# nuisance: keys that are free in addition to the default, and nuisances that are estimated
ESTIMATED: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "none": ((), DEFAULT_NUISANCES), "force": ((), (*DEFAULT_NUISANCES, RANDOM_FORCE)), "bias": ((), DEFAULT_NUISANCES),
    "scale": ((), DEFAULT_NUISANCES), "thrusters": (("thrusters.matrix",), DEFAULT_NUISANCES),
    "asymmetric": (("thrusters.matrix",), (*DEFAULT_NUISANCES, "asymmetry")),
    "delay": ((), (*DEFAULT_NUISANCES, "delay")),
}  # fmt: skip


def draw_truth(parameters: list[Parameter], vehicle: Vehicle, rng: np.random.Generator) -> Array:
    """Draw the true values of a vehicle's parameters, shape (p,)."""
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


class Disturbed:
    """A plant with factors on forces forward and backward, and a wrench (steps, 6) [N, N m] added in each step."""

    def __init__(self, plant: Plant, force: Array, forward: Array, backward: Array) -> None:
        self._plant, self._force, self._factors, self._k = plant, force, (forward, backward), 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)

    def step(self, step: float) -> None:
        """Advance by one step [s] with the disturbed inputs."""
        values, n = self._plant.inputs.values, len(self._factors[0])
        values[:n] *= np.where(values[:n] < 0.0, self._factors[1], self._factors[0])
        values[n:] += self._force[min(self._k, len(self._force) - 1)]
        self._k += 1
        self._plant.step(step)


def random_force(steps: int, rng: np.random.Generator) -> Array:
    """Draw a force of 0.2 to 0.5 N with a correlation time of 5 to 10 s, as wrenches (steps, 6) [N, N m]."""
    wrenches = np.zeros((steps, 6))
    keep = np.exp(-ROW / rng.uniform(5.0, 10.0))
    size = rng.uniform(0.2, 0.5)
    for axis in range(3):
        wrenches[:, axis] = lfilter(
            [size * np.sqrt(1.0 - keep**2)], [1.0, -keep], rng.standard_normal(steps), zi=[size * rng.standard_normal()]
        )[0]
    return wrenches


def dive(duration: float) -> list[tuple[int, Command]]:
    """Return the sticks of an ordinary dive: ahead at a steady speed, some turns, a change of depth."""
    commands: list[tuple[int, Command]] = [(0, SetMode("depth_hold"))]
    for k in range(0, int(duration / ROW), 2):
        time = k * ROW
        ahead, turn = (0.3, 0.0) if time % 40.0 < 30.0 else (0.1, 0.05)
        down = 0.3 if 60.0 < time < 70.0 else -0.3 if 200.0 < time < 210.0 else 0.0
        commands.append((k, ManualControl((ahead, 0.0, down, 0.0, 0.0, turn))))
    return commands


def fly(scenario: Scenario, commands: Any, nuisance: str, noise: float, rng: np.random.Generator) -> tuple[Log, float]:
    """Simulate a run; return its log, and the maximum distance from the center of the box along an axis [m]."""
    n, steps = scenario.vehicle.n_thrusters, scenario.steps + 1
    force = random_force(steps, rng) if nuisance == "force" else np.zeros((1, 6))
    forward = rng.uniform(0.9, 1.1, n) if nuisance in ("thrusters", "asymmetric") else np.ones(n)
    backward = forward * rng.uniform(0.85, 0.95) if nuisance == "asymmetric" else forward
    own = scenario.vehicle  # its limits bound the commands; the disturbed forces may exceed them
    plant = Plant(dataclasses.replace(own, thrust_min=1.2 * own.thrust_min, thrust_max=1.2 * own.thrust_max))
    flown = rehearse(scenario, commands, Disturbed(plant, force, forward, backward))
    states, times = flown.states, flown.times

    def noisy(values: Array, deviation: float) -> Array:
        measured: Array = values + deviation * noise * rng.standard_normal(values.shape)
        return measured

    turned: Array = np.array([
        multiply(q, from_axis_angle(a / np.linalg.norm(a), float(np.linalg.norm(a))))
        for q, a in zip(states[:, 3:7], noisy(np.zeros((len(states), 3)), NOISE["attitude"]), strict=True)
    ], np.float64)  # fmt: skip
    bias: Any = rng.uniform(-1.0, 1.0, 3) * (0.02 if nuisance == "bias" else 0.003)
    scale = 1.01 if nuisance == "scale" else 1.0
    late = 0.2 if nuisance == "delay" else 0.0
    dvl = slice(None, None, round(DVL_PERIOD / ROW))
    values = {
        "velocity": (times[dvl], noisy(scale * states[dvl, 7:10], NOISE["velocity"])),
        "angular_velocity": (times, noisy(states[:, 10:] + bias, NOISE["angular_velocity"])),
        "depth": (times, noisy(states[:, 2:3], NOISE["depth"])), "attitude": (times, turned),
    }  # fmt: skip
    topics = tuple(make_topic(name, t + late, x, NOISE[name] * noise) for name, (t, x) in values.items())
    gone = np.abs(states[:, :3] - scenario.initial.position).max()
    return Log("simulated", times, flown.thrust, np.zeros((len(times), 6)), topics), float(gone)


def relative_errors(parameters: list[Parameter], truth: Array, estimate: Array) -> dict[str, list[float]]:
    """Return magnitudes of errors by group of parameters: relative, but in SI units for buoyancy and its center.

    Errors of off-diagonal added mass are relative to the geometric mean of its diagonal elements.
    """
    diagonal = {int(p.name.split(".")[2]): x for p, x in zip(parameters, truth, strict=True) if _is_diagonal(p)}
    groups: dict[str, list[float]] = {}
    for p, x, y in zip(parameters, truth, estimate, strict=True):
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
    """Return the process times of a 20 s window's Jacobian [s]: exact, and by forward differences."""
    windows = cut_windows([log], vehicle, integration_step([log]), 20.0)[0][:1]
    problem = Residuals([log], vehicle, parameters, windows, integration_step([log]))
    settings = problem.settings(done.values)
    started = time.process_time()
    for i, window in enumerate(windows):
        problem.raw(i, settings, window.start, full=True)
    exact = time.process_time() - started
    started = time.process_time()
    for x in (done.values, *(done.values + row for row in np.diag(1e-6 * done.intervals.nominal))):
        settings = problem.settings(x)
        for i, window in enumerate(windows):
            problem.raw(i, settings, window.start, full=False)
    return exact, time.process_time() - started


def measure(
    nuisance: str, estimated: bool, seed: int, duration: float, commands: Any, noise: float
) -> tuple[dict[str, Any], tuple[Log, list[Parameter], Fit]]:
    """Simulate a vehicle and identify it; return its line of results, and its log, parameters and fit."""
    vehicle = load_vehicle(VEHICLE)
    free, beside = ESTIMATED[nuisance if estimated else "none"]
    truths = free_parameters(vehicle, DEFAULT_FREE)
    rng = np.random.default_rng([seed, 27])
    truth = draw_truth(truths, vehicle, rng)
    current = [*rng.uniform(-0.15, 0.15, 2).tolist(), 0.0]
    over = {p.plant: float(x) for p, x in zip(truths, truth, strict=True) if p.plant}
    lag = float(truth[[p.kind for p in truths].index("lag")])
    over |= {f"thrust_time_constant[{i + 1}]": lag for i in range(vehicle.n_thrusters)}
    scenario = excitation_scenario(VEHICLE, vehicle, DEPTH, duration).replace(
        {"plant.current": current, "plant.parameters": over}
    )
    log, gone = fly(scenario, commands, nuisance, noise, rng)
    parameters = [*truths, *free_parameters(vehicle, free), *nuisances(beside, [log])]
    wall, process = time.perf_counter(), time.process_time()
    done = fit([log], vehicle, parameters, random_force=RANDOM_FORCE in beside)
    wall, process = time.perf_counter() - wall, time.process_time() - process
    n = len(truths)
    off = np.abs(done.values[:n] - truth)
    halves = done.intervals.half[:n]
    cause = done.causes[0].flag if done.causes and done.causes[0].fraction > MIN_CAUSE_FRACTION else "none"
    line = {
        "nuisance": nuisance, "estimated": estimated, "seed": seed, "chi2": round(done.intervals.chi2, 3),
        "covered": (off <= halves).tolist(), "nominal": (off <= 1.96 * done.intervals.nominal[:n]).tolist(),
        "half": (halves / np.array([p.deviation for p in truths])).tolist(),
        "errors": relative_errors(truths, truth, done.values[:n]),
        "cause": cause if done.intervals.chi2 > DISAGREES else None, "farthest [m]": gone,
        "window [s]": round(done.windows[0].steps * done.step, 3), "rejected": done.rejected.total(),
        "wall": round(wall, 1), "process": round(process, 1),
    }  # fmt: skip
    return line, (log, parameters, done)


def shorten(line: dict[str, Any]) -> dict[str, Any]:
    """Return a vehicle's line of results with medians and counts instead of lists."""
    return {name: x for name, x in line.items() if name not in ("nominal", "half", "errors", "cause")} | {
        "covered": f"{sum(line['covered'])} of {len(line['covered'])}", "median errors": _medians(line["errors"]),
    }  # fmt: skip


def summarize(lines: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the summary of the lines of all vehicles with one nuisance."""
    groups: dict[str, list[float]] = {}
    for line in lines:
        for name, values in line["errors"].items():
            groups.setdefault(name, []).extend(values)
    pooled = {name: np.concatenate([line[name] for line in lines]) for name in ("covered", "nominal", "half")}
    named = Counter(line["cause"] for line in lines if line["cause"])
    return {
        "nuisance": lines[0]["nuisance"], "estimated": lines[0]["estimated"], "vehicles": len(lines),
        "median errors": _medians(groups),
        "errors of nine in ten": {name: float(f"{np.quantile(x, 0.9):.2g}") for name, x in groups.items()},
        "greatest errors": {name: float(f"{np.max(x):.2g}") for name, x in groups.items()},
        "coverage": round(float(np.mean(pooled["covered"])), 3),
        "nominal coverage": round(float(np.mean(pooled["nominal"])), 3),
        "median half interval, in deviations of the prior": float(f"{np.median(pooled['half']):.2g}"),
        "chi2, median and greatest": [float(f(line["chi2"] for line in lines)) for f in (_median, max)],
        "process time of a fit, median [s]": _median(line["process"] for line in lines),
        "farthest from the center [m]": round(max(line["farthest [m]"] for line in lines), 2),
        "cause named where the model disagrees": dict(named),
    }  # fmt: skip


def _median(values: Any) -> float:
    return float(np.median(list(values)))


def _medians(groups: dict[str, list[float]]) -> dict[str, float]:
    return {name: float(f"{np.median(x):.2g}") for name, x in groups.items()}


def main() -> None:
    """Print a JSON line for each vehicle, and a summary for each nuisance."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vehicles", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--duration", type=float, default=300.0, help="of each run [s]")
    parser.add_argument("--noise", type=float, default=1.0, help="factor of all noise")
    parser.add_argument("--nuisance", choices=tuple(ESTIMATED), nargs="+", default=["none"])
    parser.add_argument("--unknown", action="store_true", help="nuisances are not estimated")
    parser.add_argument("--dive", action="store_true", help="an ordinary dive in the place of cosim identify --excite")
    parser.add_argument("--out", type=Path, help="file of lines, by which an interrupted measurement goes on")
    options = parser.parse_args()
    started = time.perf_counter()
    plan = None if options.dive else design(VEHICLE, BOX, DEPTH, options.duration)
    commands = dive(options.duration) if plan is None else plan.commands
    duration = options.duration if plan is None else plan.scenario.time.duration
    print(json.dumps({"design [s]": round(time.perf_counter() - started, 1), "duration [s]": duration}), flush=True)
    known = options.out.read_text().splitlines() if options.out and options.out.exists() else []
    flown = {(line["nuisance"], line["estimated"], line["seed"]): line for line in map(json.loads, known)}
    asked = [
        (nuisance, not options.unknown, seed)
        for seed in range(options.seed, options.seed + options.vehicles)
        for nuisance in options.nuisance
    ]
    last = None
    for case in asked:
        if case not in flown:
            flown[case], last = measure(*case, duration, commands, options.noise)
            if options.out:
                with options.out.open("a") as file:
                    file.write(json.dumps(flown[case]) + "\n")
            print(json.dumps(shorten(flown[case])), flush=True)
    for nuisance in options.nuisance:
        print(json.dumps(summarize([flown[case] for case in asked if case[0] == nuisance])), flush=True)
    if last:
        log, parameters, done = last
        exact, differences = jacobian_times(log, load_vehicle(VEHICLE), parameters, done)
        print(json.dumps({"exact Jacobian [s]": round(exact, 2), "by differences [s]": round(differences, 2)}))


if __name__ == "__main__":
    main()
