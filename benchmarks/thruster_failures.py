"""Flights of the deployable law with thruster failures.

``python -m benchmarks.thruster_failures VEHICLE CASE N [--lag S] [--seed K]``; the law is not given the lag. With
``--sensors`` it navigates by sensors, with ``--lost dvl`` without one of them for 30 s, with ``--slow`` at 1 Hz.
"""

from __future__ import annotations

import argparse
import json
import math
from typing import Any

import numpy as np

from cosim.batch.fused import FusedFlyer
from cosim.batch.variation import Variation
from cosim.results.record import Rows
from cosim.scenario.scenario import validate_scenario
from cosim.scenario.tables import Failure
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu.vehicle import Vehicle, load_vehicle

CASES = ("healthy", "worn", "rolled", "lost", "two lost", "part lost", "stuck")
_FAILURES = {"lost": 1, "part lost": 1, "stuck": 1, "two lost": 2}  # number of failures in each case
_WINDOW = 25  # control steps of the average: half a second


def scene(vehicle: Vehicle, case: str, seed: int, lag: float | None, weight: float, tilt: float) -> dict[str, Any]:
    """Draw a scenario: spheres, a depth band, a current, noise, |W - B| up to `weight` [N], and failures of a case."""
    rng, m = np.random.default_rng([seed, 7]), vehicle.n_thrusters
    start = np.array([0.0, 0.0, rng.uniform(3.0, 5.0)])
    away, heading = rng.uniform(8.0, 20.0), rng.uniform(-0.5, 0.5)
    goal = start + np.array([away * math.cos(heading), away * math.sin(heading), rng.uniform(-0.8, 0.8)])
    angle, axis = math.radians(tilt) if case == "rolled" else 0.0, rng.normal(size=3)
    quaternion = np.r_[math.cos(angle / 2.0), math.sin(angle / 2.0) * axis / np.linalg.norm(axis)]
    speed, direction = rng.uniform(0.0, 0.15), rng.uniform(0.0, 2.0 * math.pi)
    parameters = {"buoyancy": vehicle.weight - rng.uniform(-weight, weight)}
    if lag is not None:
        parameters |= {f"thrust_time_constant[{j + 1}]": lag for j in range(m)}
    if case == "worn":
        parameters |= {f"thrust_effectiveness[{j + 1}]": rng.uniform(0.7, 1.0) for j in range(m)}
    band = {"type": "depth_band", "depth": start[2], "tolerance": 2.2}
    shapes = [("band", "depth", "in", band)]
    for i in range(int(rng.integers(2, 6))):
        center = start + (goal - start) * rng.uniform(0.2, 0.85) + rng.uniform(-1.0, 1.0, 3) * [1.5, 1.5, 0.6]
        radius = rng.uniform(0.3, 0.7)
        if min(np.linalg.norm(center - start), np.linalg.norm(center - goal)) > radius + 1.5:
            ball = {"type": "sphere", "center": center.tolist(), "radius": radius}
            shapes.append((f"rock{i}", "obstacle", "out", ball))
    first = rng.uniform(1.0, 8.0)
    times = [first, first + rng.uniform(2.0, 8.0)][: _FAILURES.get(case, 0)]
    kind = {"effectiveness": 0.4 if case == "part lost" else 0.0, "stuck": case == "stuck"}
    failed = zip(rng.permutation(m) + 1, times, strict=False)
    return {
        "vehicle": "",
        "time": {"duration": 60.0, "step": 0.01, "control": 0.02, "arbiter": 0.02},
        "initial": {"position": start.tolist(), "quaternion": quaternion.tolist()},
        "goal": {"type": "sphere", "center": goal.tolist(), "radius": 0.5},
        "law": {"name": "deployable"},
        "actuation": {"through": "thrusters"},
        "arbiter": {"engine": "closed"},
        "sensing": {"position_noise": 0.02, "velocity_noise": 0.01, "seed": seed},
        "plant": {
            "current": [speed * math.cos(direction), speed * math.sin(direction), 0.0],
            "parameters": parameters,
        },
        "failures": [{"thruster": int(j), "time": float(t), **kind} for j, t in failed],
        "regions": [
            {"name": name, "criterion": criterion, "keep": keep, "gain": 100.0, "hard": True, "shape": shape}
            for name, criterion, keep, shape in shapes
        ],
    }


def through_sensors(table: dict[str, Any], lost: list[str], slow: bool) -> dict[str, Any]:
    """Return the changes for a scenario that navigates by sensors, some of them lost from 6 s on for 30 s."""
    rates = {"dvl.rate": 1.0, "usbl.rate": 1.0} if slow else {}
    return {
        "sensing": {"through": "sensors", "seed": table["sensing"]["seed"]},
        "outages": [{"sensor": sensor, "time": 6.0, "duration": 30.0} for sensor in lost],
        "time": table["time"] | {"duration": 120.0},
        "plant": table["plant"] | {"parameters": table["plant"]["parameters"] | rates},
    }


def since_it_matters(trace: Rows, failure: Failure, limit: float) -> float:
    """Return the time [s] from which a thruster lacks a tenth of its limit [N], averaged over 0.5 s; inf if never."""
    times, commands = trace["time"], trace[f"thrust[{failure.thruster}]"]
    after = times >= failure.time
    given = failure.effectiveness * commands
    if failure.stuck:
        given = np.full(commands.size, commands[np.argmax(after) - 1])
    lack, window = np.abs(np.convolve(commands - given, np.ones(_WINDOW) / _WINDOW)[: times.size]), after.copy()
    window[: np.argmax(after) + _WINDOW] = False
    matters = window & (lack > 0.1 * limit)
    return float(times[np.argmax(matters)]) if matters.any() else math.inf


def main() -> None:
    """Run the flights, and print the results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("vehicle")
    parser.add_argument("case", choices=CASES)
    parser.add_argument("flights", type=int)
    parser.add_argument("--lag", type=float, help="of all thrusters [s]; default: the vehicle's own")
    parser.add_argument("--weight", type=float, help="greatest |W - B| [N]; default: 15, of the BlueROV2 22")
    parser.add_argument("--tilt", type=float, default=180.0, help="of a rolled start [degrees]")
    parser.add_argument("--seed", type=int, default=0, help="of the first flight")
    parser.add_argument("--sensors", action="store_true", help="navigate by sensors")
    parser.add_argument("--lost", action="append", default=[], metavar="SENSOR", help="lost for 30 s")
    parser.add_argument("--slow", action="store_true", help="DVL and USBL of 1 Hz")
    given = parser.parse_args()
    vehicle = load_vehicle(given.vehicle)
    model = vehicle_model(vehicle)
    limits = np.minimum(-model.thrust_min, model.thrust_max)
    weight = given.weight or (22.0 if "bluerov2" in given.vehicle else 15.0)
    delays, of_use, failures, wrong, violated, late, least = [], [], 0, 0, 0, 0, math.inf
    for seed in range(given.seed, given.seed + given.flights):
        table = scene(vehicle, given.case, seed, given.lag, weight, given.tilt) | {"vehicle": given.vehicle}
        if given.sensors:
            table |= through_sensors(table, given.lost, given.slow)
        scenario = validate_scenario(json.loads(json.dumps(table)), f"{given.case} {seed}")
        with FusedFlyer(Variation(scenario, ())) as flyer:
            outcome, trace = flyer.fly_one(scenario, trace=True)
        reports, times = trace["law.failed_thruster"], trace["time"]
        isolated = {int(j): float(times[np.argmax(reports == j)]) for j in np.unique(reports) if j}
        failed = {failure.thruster: failure.time for failure in scenario.failures}
        failures += len(failed)
        delays += [isolated[j] - time for j, time in failed.items() if isolated.get(j, -1.0) >= time]
        for failure in scenario.failures:
            matters = since_it_matters(trace, failure, limits[failure.thruster - 1])
            if matters < math.inf and isolated.get(failure.thruster, math.inf) >= failure.time:
                of_use.append(isolated.get(failure.thruster, math.inf) - matters)
        wrong += any(time < failed.get(j, math.inf) for j, time in isolated.items())
        least = min(least, float(outcome["min_clearance"]))
        violated += bool(outcome["min_clearance"] < 0.0)
        late += not outcome["settled"]
    print(f"{given.vehicle}, {given.case}, lag {given.lag}: {given.flights} flights from seed {given.seed}")
    print(f"  regions violated in {violated}, least clearance {least:.3f} m; {late} not at rest in the goal")
    print(f"  a working thruster isolated in {wrong}")
    if failures:
        soon = sum(delay <= 3.0 for delay in delays)
        median = np.median(delays) if delays else math.nan
        print(f"  {len(delays)} of {failures} isolated, {soon} within 3 s, after {median:.2f} s (median)")
        soon = sum(delay <= 3.0 for delay in of_use)
        print(f"  of {len(of_use)} that came to matter, {soon} within 3 s from then on")


if __name__ == "__main__":
    main()
