"""Reports of the deployable law after each step."""

from __future__ import annotations

import numpy as np

from controller.law import Diagnostic
from controller.laws.deployable.estimate import EFFECTIVENESS, Estimate
from controller.linear_algebra import norm
from controller.stack_array import Array, Vector3

NO_BOUND = np.nan  # m, reported bound without an estimate, or without barriers

DIAGNOSTICS = (
    Diagnostic("position.x", "m", "Estimated position, north"),
    Diagnostic("position.y", "m", "Estimated position, east"),
    Diagnostic("position.z", "m", "Estimated position, down"),
    Diagnostic("velocity.x", "m/s", "Estimated velocity over ground, north"),
    Diagnostic("velocity.y", "m/s", "Estimated velocity over ground, east"),
    Diagnostic("velocity.z", "m/s", "Estimated velocity over ground, down"),
    Diagnostic("current.x", "m/s", "Estimated current, north"),
    Diagnostic("current.y", "m/s", "Estimated current, east"),
    Diagnostic("desired_speed", "m/s", "Speed that the attraction wants"),
    Diagnostic("path_cost", "m", "Length of the path into the goal region, and what it costs to pass close"),
    Diagnostic("path_corners", "", "Corners of the path"),
    Diagnostic("barriers", "", "Active barriers"),
    Diagnostic("constraint_slack", "m/s2", "Greatest slack of a barrier"),
    Diagnostic("qp_steps", "", "Steps of the quadratic program, negative if it was cut short"),
    Diagnostic("failed_thruster", "", "Thruster isolated last, from 1; 0 for none"),
    Diagnostic("time_since_measurement", "s", "Time since the last measurement that was accepted"),
    Diagnostic("bound", "m", "What the clearance of a hard region may fall to from here; NaN: no promise"),
    Diagnostic("rejected", "", "Fraction of the position and velocity samples so far that the gate rejected"),
    Diagnostic("thrust_limit", "", "Least estimated limit of a thruster, as a fraction of that in the vehicle's file"),
)
BOUND, REJECTED, THRUST_LIMIT = 16, 17, 18  # indices in `DIAGNOSTICS`


def write_report(report: Array, estimate: Estimate, cost: float, points: int, health: Array, desired: Vector3) -> None:
    """Write the `DIAGNOSTICS` of estimate, path and thrusters; `report` has the thruster that was isolated last."""
    report[:3] = estimate.position
    report[3:6] = estimate.velocity
    report[6:8] = estimate.water_velocity[:2]
    report[8] = norm(desired)
    report[9] = cost
    report[10] = points - 1
    last = int(report[14])
    if last == 0 or health[last - 1] > 0.0:
        report[14] = 0.0
        for j in range(health.size):
            if health[j] == 0.0:
                report[14] = j + 1
    report[15] = estimate.time_since_measurement[0]
    report[THRUST_LIMIT] = np.inf
    for j in range(health.size):
        if health[j] > 0.0:
            report[THRUST_LIMIT] = min(report[THRUST_LIMIT], estimate.state[EFFECTIVENESS + health.size + j])


def write_program_report(report: Array, multipliers: Array, price: Array, rows: int, steps: int) -> None:
    """Write the `DIAGNOSTICS` of barriers and quadratic program."""
    active, yielding = 0, 0.0
    for i in range(rows):
        if multipliers[i] > 0.0:
            active += 1
            yielding = max(yielding, multipliers[i] * price[i])
    report[11], report[12], report[13] = active, yielding, steps
