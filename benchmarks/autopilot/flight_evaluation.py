"""Evaluation of a flight from the plant's record: clearances at the true pose, and the reaction to a fault."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.regions.region_set import of_attitude
from cosim.results.record import Record, load_record
from cosim.scenario.scenario import Scenario
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.signals import Array

_STAYED = 2.0  # s, time at the end in which the vehicle must stay in the goal


@dataclass
class FlightEvents:
    """Events of a flight, with times of the plant [s]."""

    states: list[tuple[float, str]] = field(default_factory=list)  # start [s] and name of each state of the companion
    failed_at: float = math.nan  # s, time of the fault
    status: str = ""  # status of the companion's run
    offset: list[float] = field(default_factory=lambda: [math.nan] * 3)  # m, NED, autopilot's local origin
    begun: float = math.nan  # s, start of the plant's record

    def first(self, *states: str) -> float:
        """Return the time [s] at which one of the states was first entered; NaN if none was."""
        return next((time for time, state in self.states if state in states), math.nan)


def evaluate_flight(scenario: Scenario, events: FlightEvents, folder: Path) -> dict[str, Any]:
    """Evaluate the plant's record from the start of the dive, or of steering, to the end of the flight."""
    start_time, steering_start = events.first("diving", "steering"), events.first("steering")
    if not math.isfinite(steering_start) or not folder.exists():
        return {"reached": False, "states": events.states}
    record = load_record(folder)
    times = record["time"] + events.begun
    end_time = steering_start + scenario.time.duration
    rows = (times >= start_time) & (times <= end_time)
    clearances = clearances_at(scenario, record, times - steering_start)
    if math.isfinite(events.failed_at):
        return {"states": events.states} | _evaluate_fault(record, times, events, scenario, clearances)
    distances: dict[str, float] = {}
    angles: dict[str, float] = {}
    for i, secondary in enumerate(scenario.regions, 1):
        region = secondary.region
        if region.hard:
            counted = times >= (steering_start if of_attitude(region.shape) else start_time)
            minimum = float(clearances[rows & counted, i].min())
            (angles if of_attitude(region.shape) else distances)[region.name] = round(minimum, 4)
    goal = clearances[:, 0]
    inside = (goal >= 0.0) & rows & (times >= steering_start)
    entered = float(times[np.argmax(inside)] - steering_start) if inside.any() else None
    attitude = [record[f"attitude.{name}"][rows] for name in ("roll", "pitch", "yaw")]
    estimate = [record[f"law.estimate.{name}"][rows] for name in ("x", "y", "z", "yaw")]
    true = [record[f"position.{axis}"][rows] for axis in "xyz"]
    errors = [np.abs(e + o - t) for e, o, t in zip(estimate[:3], events.offset, true, strict=True)]
    heading_errors = np.abs(np.remainder(estimate[3] - attitude[2] + np.pi, 2.0 * np.pi) - np.pi)
    tilt = np.degrees(np.arccos(np.cos(attitude[0]) * np.cos(attitude[1])))
    last = rows & (times > end_time - _STAYED)
    return {
        "reached": entered is not None,
        "entered": entered and round(entered, 2),
        "stayed": bool((goal[last] >= 0.0).all()),
        "violated": [name for name, minimum in (distances | angles).items() if minimum < 0.0],
        "min_clearance": min(distances.values(), default=None),
        "min_angle": min(angles.values(), default=None),
        "clearances": {name: minimum for name, minimum in (distances | angles).items() if minimum < 1.0},
        "dive": None if start_time == steering_start else round(steering_start - start_time, 2),
        "tilt": round(float(tilt.max()), 1),
        "position_error": [round(float(np.nanmax(error)), 3) for error in errors],
        "heading_error": round(float(np.degrees(np.nanmax(heading_errors[times[rows] >= steering_start]))), 2),
        "states": [(round(t, 2), state) for t, state in events.states],
    }


def clearances_at(scenario: Scenario, record: Record, time: Array) -> Array:
    """Return the clearances of goal and regions, shape (rows, n + 1) [m]; time since steering began (rows,) [s]."""
    environment, shifts = RegionEnvironment(scenario), np.zeros((len(scenario.moving), 3))
    positions = np.stack([record[f"position.{axis}"] for axis in "xyz"], axis=1)
    quaternions = np.stack([record[f"quaternion.e{i}"] for i in range(4)], axis=1)
    clearances = np.zeros((len(time), len(scenario.regions) + 1))
    for row, t in enumerate(time.tolist()):
        environment.update_positions(max(t, 0.0), shifts)
        clearances[row] = environment.evaluate(positions[row], quaternions[row])[1]
    return clearances


def _evaluate_fault(
    record: Record, times: Array, events: FlightEvents, scenario: Scenario, clearances: Array
) -> dict[str, Any]:
    """Return the reaction to the fault: end of steering, mode, speeds, distance traveled, tilt, violated regions."""
    handover = events.first("held", "pilot")
    resumed = next((time for time, state in events.states if state == "steering" and time > handover), math.inf)
    velocity = np.linalg.norm([record[f"velocity.{name}"] for name in "uvw"], axis=0)
    distance = np.cumsum(velocity) * float(np.median(np.diff(times)))

    def row_after(seconds: float) -> int:
        return min(int(np.searchsorted(times, events.failed_at + seconds)), len(times) - 1)

    def first_time(flags: NDArray[np.bool_]) -> float | None:
        """Return the time from the fault to the first row after it that has a flag [s]."""
        rows = np.flatnonzero(flags[fault:])
        return round(float(times[fault + rows[0]] - events.failed_at), 2) if rows.size else None

    fault, modes = row_after(0.0), record["law.mode"]
    end = row_after(resumed - events.failed_at) if math.isfinite(resumed) else -1
    pulses = np.array([record[f"law.pwm{i + 1}"] for i in range(scenario.vehicle.n_thrusters)])
    tilt = np.degrees(np.arccos(np.cos(record["attitude.roll"]) * np.cos(record["attitude.pitch"])))
    return {
        "handover_delay": None if math.isnan(handover) else round(handover - events.failed_at, 2),
        "mode": int(modes[-1]),
        "mode_after": first_time(modes != modes[fault]),
        "neutral_after": first_time(np.all(np.abs(pulses - 1500.0) < 2.0, axis=0)),
        "disarmed_after": first_time(record["law.armed"] == 0.0),
        "speed": [round(float(velocity[row_after(s)]), 2) for s in (0.0, 1.0, 3.0)],
        "distance_1s": round(float(distance[row_after(1.0)] - distance[fault]), 2),
        "distance_to_end": round(float(distance[end] - distance[fault]), 2),  # or to where steering is resumed
        "resumed": round(resumed - events.failed_at, 2) if math.isfinite(resumed) else None,
        "tilt": round(float(tilt[fault:].max()), 1),
        "violated": [
            s.region.name
            for i, s in enumerate(scenario.regions, 1)
            if s.region.hard and clearances[fault:, i].min() < 0.0
        ],
    }
