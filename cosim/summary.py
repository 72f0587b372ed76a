"""What a run comes to: numbers from its record alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.regions import of_attitude
from cosim.lyapunov import summarise_lyapunov
from cosim.record import Record
from cosim.scenario import CRITERIA, Scenario
from cosim.signals import Array

SETTLED_FOR = 10.0  # s, that the vehicle must be inside at the end

Flags = NDArray[np.bool_]


def spans(flags: Flags, time: Array) -> list[tuple[float, float]]:
    """Return when a condition held, as pairs of the first instant in and the first out.

    Parameters
    ----------
    flags : ndarray of bool, shape (steps,)
        The condition at each step.
    time : ndarray, shape (steps,)
        [s].

    Returns
    -------
    list of (float, float)
        [s]; a condition that still holds at the end ends at the last instant.
    """
    edges = np.diff(flags.astype(np.int8), prepend=0, append=0)
    starts, ends = np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist()
    last = len(time) - 1
    return [(float(time[a]), float(time[min(b, last)])) for a, b in zip(starts, ends, strict=True)]


def summarise(scenario: Scenario, record: Record, status: str, wall_time: float | None) -> dict[str, Any]:
    """Return the summary of a run.

    Parameters
    ----------
    scenario : Scenario
        What was run.
    record : Record
        What it left, at least one row.
    status : str
        ``"completed"``, ``"interrupted"``, ``"killed"``, or ``"failed: ..."``.
    wall_time : float or None
        What the stepping took [s], if that is known.

    Returns
    -------
    dict
        Ready for JSON; times in s, lengths in m, forces in N. Clearances are distances to a region's surface where that
        was then, or angles [rad] for regions of attitude; positive where it is respected, negative where it is violated
        (inside a region that is to be kept out of).
    """
    time = record["time"]
    inside = record["goal.clearance"] >= 0.0
    visits = spans(inside, time)
    settled = bool(visits and inside[-1] and time[-1] - visits[-1][0] >= SETTLED_FOR)
    names = [secondary.region.name for secondary in scenario.regions]
    overlap = [record[f"{names[i]}.clearance"] < 0.0 for i in scenario.intersection]
    period = (
        float(time[1] - time[0]) if len(time) > 1 else scenario.time.step
    )  # of the record, which may be thinned out
    every = round(period / scenario.time.step)
    acted = slice(0, math.ceil(scenario.steps / every))  # the last row of a whole run decides, but acts no more
    force = np.linalg.norm(record.stack([f"actuation.{axis}" for axis in "XYZ"]), axis=1)[acted]
    asked = np.linalg.norm(record.stack([f"command.{axis}" for axis in "XYZ"]), axis=1)
    speed = np.linalg.norm(record.stack([f"velocity.{axis}" for axis in "uvw"]), axis=1)
    simulated = float(time[-1])
    weights = record.stack([f"weight.{name}" for name in CRITERIA])
    # extremes are of the numbers that there are: fmin and fmax pass over what is none
    least = {name: float(np.fmin.reduce(record[f"{name}.clearance"])) for name in names}
    return {
        "scenario": scenario.name,
        "law": scenario.law.name,
        "arbiter": scenario.arbiter.engine,
        "vehicle": scenario.vehicle.name,
        "status": status,
        "simulated_time": simulated,
        "reached": bool(visits),
        "reach_time": visits[0][0] if visits else None,
        "settled": settled,
        "settle_time": visits[-1][0] if visits else None,
        "final_position": [float(record[f"position.{axis}"][-1]) for axis in "xyz"],
        "closest_to_goal": float(-np.fmax.reduce(record["goal.clearance"])),
        "intersection": [names[i] for i in scenario.intersection],
        "intersection_windows": spans(np.logical_and.reduce(overlap), time) if overlap else [],
        "min_clearance": least,
        "clearance_unit": {r.region.name: "rad" if of_attitude(r.region.shape) else "m" for r in scenario.regions},
        "hard": [r.region.name for r in scenario.regions if r.region.hard],
        "hard_violated": [r.region.name for r in scenario.regions if r.region.hard and least[r.region.name] < 0.0],
        "violated_at_start": [name for name in names if record[f"{name}.clearance"][0] < 0.0],
        "max_force": float(np.fmax.reduce(force)) if force.size else 0.0,
        "max_force_asked": float(np.fmax.reduce(asked)),
        "max_speed": float(np.fmax.reduce(speed)),
        "weights_above_half": int((weights > 0.5).sum(axis=1).max()),
        "weights_sum_max": float(np.fmax.reduce(weights.sum(axis=1))),
        "effort": float(force.sum() * period),
        "saturated_time": _saturated_time(record, acted, period),
        "estimate_final": [float(record[f"estimate.phi{i}"][-1]) for i in range(1, 5)],
        "estimate_true": scenario.true_restoring_parameters.tolist(),
        "estimate_lowest": [float(np.fmin.reduce(record[f"estimate.phi{i}"])) for i in range(1, 5)],
        "estimate_highest": [float(np.fmax.reduce(record[f"estimate.phi{i}"])) for i in range(1, 5)],
        "lyapunov": summarise_lyapunov(record),
        "steps": round(simulated / scenario.time.step),
        "wall_time": wall_time,
        "real_time_factor": simulated / wall_time if wall_time else None,
    }


def seconds_or_none(value: object) -> float | None:
    """Return a time that a summary was written with.

    Parameters
    ----------
    value : object
        As JSON has it.

    Returns
    -------
    float or None
        [s].

    Raises
    ------
    ValueError
        If it is none.
    """
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < 1e12:
        raise ValueError(f"a time is {str(value)[:80]!r}, expected seconds")
    return float(value)


def _saturated_time(record: Record, acted: slice, period: float) -> float:
    """How long any actuator was asked for more than it gives [s]."""
    of_all = ("wrench_saturated", "allocation_saturated")
    flags = [name for name in record.units if name.startswith("thrust_saturated[") or name in of_all]
    any_cut = np.logical_or.reduce([record[name][acted] > 0.0 for name in flags])
    return float(np.count_nonzero(any_cut) * period)
