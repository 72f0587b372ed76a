"""Why a completed run missed its goal, in a sentence, from its record."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from controller.regions import Region
from controller.regions.region_set import clearances_at, evaluate_at_pose, of_attitude
from cosim.results.record import Rows
from cosim.scenario.scenario import Scenario
from cosim.simulation.signals import Array

_WINDOW = 10.0  # s, time before the end that is examined
_SAMPLES = 500  # maximum number of rows of that time that are read
_APPROACHING = 0.03  # m/s, least mean rate at which the distance to the goal falls or grows
_SWIMS = 1.0  # m/s, speed of a vehicle for which a time would not be too short
_MOVING = 0.1  # m/s, least mean speed of a vehicle that is under way
_AT_LIMITS = 0.5  # least fraction of the time with an actuator at its limit that counts as a lack of thrust
_FULL = 0.999  # fraction of a thruster's limit that counts as the limit
_POINTS = 400  # number of points of the line to the goal
_WITHIN = 0.02  # m by which that line goes into the goal region
_POSITION = [f"position.{axis}" for axis in "xyz"]
_SPEED = [f"velocity.{axis}" for axis in "uvw"]
_CHECK = "`cosim check FILE` looks for a way into the goal and for enough thrust."


def explain_miss(scenario: Scenario, record: Rows, flags: list[str], summary: dict[str, Any]) -> str | None:
    """Explain why the run did not end at rest in its goal region."""
    commanded = scenario.commands.enabled or bool(scenario.log)
    if summary["settled"] or summary["status"] != "completed" or commanded or not scenario.has_goal:
        return None
    end = _End(scenario, record, flags)
    if not np.isfinite(end.distance).all():
        return None
    return f"{_cause(scenario, end, summary)} {_CHECK}"


class _End:
    """The end of a run: signals over its last seconds."""

    def __init__(self, scenario: Scenario, record: Rows, flags: list[str]) -> None:
        last = len(record) - 1
        seconds = [record.value("time", row) for row in (0, last)]
        fraction = min(_WINDOW / max(seconds[1] - seconds[0], 1e-9), 1.0)
        columns = ("time", "goal.clearance", "goal.place", "law.time_since_measurement")
        thrusts = [f"thrust[{j + 1}]" for j in range(scenario.vehicle.n_thrusters)]
        shifts = [f"{name}.shift.{axis}" for name in scenario.moving for axis in "xyz"]
        names = [n for n in (*columns, *_POSITION, *_SPEED, *flags, *thrusts, *shifts) if n in record.units]
        picked = np.unique(np.linspace(last - round(fraction * last), last, _SAMPLES).astype(int))
        rows = self.rows = record.take(picked.tolist(), names)
        self.duration = float(rows["time"][-1] - rows["time"][0])
        self.distance = -rows["goal.clearance"]  # m
        with np.errstate(invalid="ignore"):
            self.closing = float(self.distance[0] - self.distance[-1]) / max(self.duration, 1e-9)  # m/s
        self.speed = float(np.linalg.norm(rows.stack(_SPEED), axis=1).mean())  # m/s
        limited = np.logical_or.reduce([rows[name] > 0.0 for name in flags])
        for j, name in enumerate(thrusts):
            if name in rows.units:
                low, high = _FULL * scenario.vehicle.thrust_min[j], _FULL * scenario.vehicle.thrust_max[j]
                limited = limited | (rows[name] <= low) | (rows[name] >= high)
        self.at_limits = float(np.mean(limited))  # fraction of the time

    def shift(self, name: str) -> Array:
        """Return the last displacement of a region or the goal [m, NED]."""
        names = [f"{name}.shift.{axis}" for axis in "xyz"]
        return np.array([self.rows[n][-1] if n in self.rows.units else 0.0 for n in names])


def _cause(scenario: Scenario, end: _End, summary: dict[str, Any]) -> str:
    """Return the sentence with the cause."""
    distance = float(end.distance[-1])
    if distance <= 0.0 and summary["reached"]:
        stayed = summary["simulated_time"] - summary["settle_time"]
        return f"The time was too short: the vehicle was in the goal for the last {stayed:.1f} s only."
    if scenario.goal_then and end.rows["goal.place"][-1] < len(scenario.goal_then):
        where = f"place {end.rows['goal.place'][-1] + 1:.0f} of {len(scenario.goal_then) + 1} of the goal"
    else:
        where = "the goal"
    coast = getattr(scenario.law.gains, "coast", np.inf)
    silence = end.rows["law.time_since_measurement"][-1] if "law.time_since_measurement" in end.rows.units else 0.0
    if silence > coast:
        return f"The vehicle was adrift: the law had no measurement for the last {silence:.1f} s."
    away = f"{distance:.2f} m from {where}"
    if distance > max(_SWIMS, summary["max_speed"]) * summary["simulated_time"]:
        return f"The time was too short: the vehicle, {away}, had {summary['simulated_time']:.1f} s."
    if end.closing > _APPROACHING:
        return f"The time was too short: the vehicle, {away}, still came nearer at {end.closing:.2f} m/s."
    blocker, is_hard = next(_regions_between(scenario, end, distance), ("", False))
    if end.at_limits >= _AT_LIMITS:
        isolated = [str(one["thruster"]) for one in summary["isolations"]]
        without = f" after thruster {', '.join(dict.fromkeys(isolated))} was isolated" if isolated else ""
        drift = f", and drifted away at {-end.closing:.2f} m/s" if end.closing < -_APPROACHING else ""
        return (
            f"The thrust was not enough{without}: {away}, the vehicle had a thruster or its force at the limit for "
            f"{end.at_limits:.0%} of the last {end.duration:.0f} s{drift}."
        )
    if end.speed > _MOVING and end.closing >= -_APPROACHING:
        round_it = f"; {blocker} lies in between" if blocker else ""
        return f"The vehicle, {away}, was under way at {end.speed:.2f} m/s, but came no nearer{round_it}."
    if is_hard:
        return f"The goal was blocked: {away}, the vehicle stopped before {blocker}."
    if end.closing < -_APPROACHING:
        return f"The vehicle was adrift: {away}, it went away at {-end.closing:.2f} m/s with its thrust within limits."
    return f"The vehicle stood still {away}, with its thrust within limits and {blocker or 'nothing'} in between."


def _regions_between(scenario: Scenario, end: _End, distance: float) -> Iterator[tuple[str, bool]]:
    """Yield the regions that the line into the goal violates, and if they are hard; hard ones first."""
    position = end.rows.stack(_POSITION)[-1]
    goal = Region("goal", scenario.goal, "in")
    _, (gradient,), _ = evaluate_at_pose([goal], position - end.shift("goal"), [1.0, 0.0, 0.0, 0.0])
    slope = float(np.linalg.norm(gradient))
    if not slope > 0.0:
        return
    line = np.linspace(0.0, distance + _WITHIN, _POINTS)[:, None] * (-gradient / slope)
    for is_hard in (True, False):
        for region in (r.region for r in scenario.regions if r.region.hard == is_hard):
            if of_attitude(region.shape):
                continue
            clearances = clearances_at(position - end.shift(region.name) + line, region)
            if clearances.min() < min(0.0, clearances[0]):
                yield f"the {'hard' if is_hard else 'soft'} region {region.name}", is_hard
