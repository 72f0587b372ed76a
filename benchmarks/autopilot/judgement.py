"""Evaluation of a flight from the plant's record: clearances at the true pose, and the reaction to a fault."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from controller.regions.region_set import of_attitude
from cosim.results.record import Record, load_record
from cosim.scenario.scenario import Scenario
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.signals import Array

_STAYED = 2.0  # s, time at the end in which the vehicle must stay in the goal


@dataclass
class Flown:
    """Events of a flight, with times of the plant [s]."""

    states: list[tuple[float, str]] = field(default_factory=list)  # start [s] and name of each state of the companion
    failed_at: float = math.nan  # s, time of the fault
    status: str = ""  # status of the companion's run
    offset: list[float] = field(default_factory=lambda: [math.nan] * 3)  # m, NED, autopilot's local origin
    begun: float = math.nan  # s, start of the plant's record

    def first(self, *states: str) -> float:
        """Return the time [s] at which one of the states was first entered; NaN if none was."""
        return next((at for at, state in self.states if state in states), math.nan)


def judge(scenario: Scenario, flown: Flown, folder: Path) -> dict[str, Any]:
    """Evaluate the plant's record from the start of the dive, or of steering, to the end of the flight.

    Parameters
    ----------
    scenario : Scenario
        Scenario with the regions, which move from the start of steering on; in the record, from the record's start.
    flown : Flown
        Events of the flight.
    folder : Path
        Folder of the plant's run.

    Returns
    -------
    dict
        Result of the flight, as values for JSON.
    """
    since, steered = flown.first("diving", "steering"), flown.first("steering")
    if not math.isfinite(steered) or not folder.exists():
        return {"reached": False, "states": flown.states}
    record = load_record(folder)
    at = record["time"] + flown.begun
    end = steered + scenario.time.duration
    rows = (at >= since) & (at <= end)
    found = clearances_at(scenario, record, at - steered)
    if math.isfinite(flown.failed_at):
        return {"states": flown.states} | _after_fault(record, at, flown, scenario, found)
    place: dict[str, float] = {}
    attitude: dict[str, float] = {}
    for i, secondary in enumerate(scenario.regions, 1):
        region = secondary.region
        if region.hard:
            kept = at >= (steered if of_attitude(region.shape) else since)
            least = float(found[rows & kept, i].min())
            (attitude if of_attitude(region.shape) else place)[region.name] = round(least, 4)
    goal = found[:, 0]
    inside = (goal >= 0.0) & rows & (at >= steered)
    entered = float(at[np.argmax(inside)] - steered) if inside.any() else None
    angles = [record[f"attitude.{name}"][rows] for name in ("roll", "pitch", "yaw")]
    own = [record[f"law.estimate.{name}"][rows] for name in ("x", "y", "z", "yaw")]
    true = [record[f"position.{axis}"][rows] for axis in "xyz"]
    errors = [np.abs(e + o - t) for e, o, t in zip(own[:3], flown.offset, true, strict=True)]
    turned = np.abs(np.remainder(own[3] - angles[2] + np.pi, 2.0 * np.pi) - np.pi)
    tilt = np.degrees(np.arccos(np.cos(angles[0]) * np.cos(angles[1])))
    last = rows & (at > end - _STAYED)
    return {
        "reached": entered is not None,
        "entered": entered and round(entered, 2),
        "stayed": bool((goal[last] >= 0.0).all()),
        "violated": [name for name, least in (place | attitude).items() if least < 0.0],
        "least": min(place.values(), default=None),
        "least_attitude": min(attitude.values(), default=None),
        "clearances": {name: least for name, least in (place | attitude).items() if least < 1.0},
        "dive": None if since == steered else round(steered - since, 2),
        "tilt": round(float(tilt.max()), 1),
        "position_error": [round(float(np.nanmax(error)), 3) for error in errors],
        "heading_error": round(float(np.degrees(np.nanmax(turned[at[rows] >= steered]))), 2),
        "states": [(round(t, 2), state) for t, state in flown.states],
    }


def clearances_at(scenario: Scenario, record: Record, time: Array) -> Array:
    """Return the clearances of goal and regions at the poses of a record [m], shape (rows, n + 1).

    Parameters
    ----------
    scenario : Scenario
        Scenario with the regions, which move from time 0 on.
    record : Record
        Record of the plant.
    time : ndarray, shape (rows,)
        Times of the rows since the start of steering [s].
    """
    environment, shifts = RegionEnvironment(scenario), np.zeros((len(scenario.moving), 3))
    positions = np.stack([record[f"position.{axis}"] for axis in "xyz"], axis=1)
    quaternions = np.stack([record[f"quaternion.e{i}"] for i in range(4)], axis=1)
    clearances = np.zeros((len(time), len(scenario.regions) + 1))
    for row, at in enumerate(time.tolist()):
        environment.update_positions(max(at, 0.0), shifts)
        clearances[row] = environment.evaluate(positions[row], quaternions[row])[1]
    return clearances


def _after_fault(record: Record, at: Array, flown: Flown, scenario: Scenario, found: Array) -> dict[str, Any]:
    """Return the reaction to the fault: end of steering, mode, speeds, distance traveled, tilt, violated regions."""
    failed = flown.failed_at
    left = flown.first("held", "pilot")
    velocity = np.linalg.norm([record[f"velocity.{name}"] for name in "uvw"], axis=0)
    way = np.cumsum(velocity) * float(np.median(np.diff(at)))

    def then(seconds: float) -> int:
        return min(int(np.searchsorted(at, failed + seconds)), len(at) - 1)

    modes = record["law.mode"]
    changed = [i for i in range(then(0.0), len(at)) if modes[i] != modes[then(0.0)]]
    armed = record["law.armed"]
    disarmed = [i for i in range(then(0.0), len(at)) if armed[i] == 0.0]
    pulses = np.array([record[f"law.pwm{i + 1}"] for i in range(scenario.vehicle.n_thrusters)])
    still = np.all(np.abs(pulses - 1500.0) < 2.0, axis=0).tolist()
    neutral = [i for i in range(then(0.0), len(at)) if still[i]]
    tilt = np.degrees(np.arccos(np.cos(record["attitude.roll"]) * np.cos(record["attitude.pitch"])))

    def when(found: list[int]) -> float | None:
        return round(float(at[found[0]] - failed), 2) if found else None

    return {
        "left": None if math.isnan(left) else round(left - failed, 2),
        "mode": int(modes[-1]),
        "mode_after": when(changed),
        "neutral_after": when(neutral),
        "disarmed_after": when(disarmed),
        "speed": [round(float(velocity[then(s)]), 2) for s in (0.0, 1.0, 3.0)],
        "way": round(float(way[then(1.0)] - way[then(0.0)]), 2),
        "way_to_end": round(float(way[-1] - way[then(0.0)]), 2),
        "tilt": round(float(tilt[then(0.0) :].max()), 1),
        "violated": [
            s.region.name
            for i, s in enumerate(scenario.regions, 1)
            if s.region.hard and found[then(0.0) :, i].min() < 0.0
        ],
    }
