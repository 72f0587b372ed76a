"""Reports of the deployable law after each step."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from controller.law import Diagnostic
from controller.laws.deployable.estimate import EFFECTIVENESS, Estimate
from controller.linear_algebra import norm
from controller.stack_array import Array, Shape, Vector3
from controller.state import State

Vector2 = Annotated[Array, Shape(2)]

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
    Diagnostic("desired_speed", "m/s", "Desired speed of the attraction"),
    Diagnostic("path_cost", "m", "Length of the path into the goal region, plus the price of passing regions closely"),
    Diagnostic("path_corners", "", "Corners of the path"),
    Diagnostic("barriers", "", "Active barriers"),
    Diagnostic("constraint_slack", "m/s2", "Maximum slack of a barrier"),
    Diagnostic("qp_steps", "", "Steps of the quadratic program, negative if it was cut short"),
    Diagnostic("failed_thruster", "", "Last isolated thruster, from 1; 0 for none"),
    Diagnostic("time_since_measurement", "s", "Time since the last measurement that was accepted"),
    Diagnostic("bound", "m", "Lower bound of the clearances of hard regions from now on; NaN: none"),
    Diagnostic("rejected", "", "Fraction of the position and velocity samples so far that the gate rejected"),
    Diagnostic(
        "thrust_limit",
        "",
        "Lowest estimated limit of a thruster, as a fraction of that in the vehicle's file; NaN: none",
    ),
    Diagnostic("drag", "", "Estimated drag of translation, relative to the vehicle's file; NaN: none"),
    Diagnostic("acceleration_error", "m/s2", "Maximum error of the predicted acceleration of late, by the innovations"),
)


class Report(State):
    """The numbers of `DIAGNOSTICS`, in their order."""

    position: Vector3  # m, NED
    velocity: Vector3  # m/s over ground, NED
    current: Vector2  # m/s, north and east
    desired_speed: float  # m/s
    path_cost: float  # m
    path_corners: float
    barriers: float
    constraint_slack: float  # m/s2
    qp_steps: float
    failed_thruster: float
    time_since_measurement: float  # s
    bound: float  # m
    rejected: float  # fraction
    thrust_limit: float  # dimensionless, relative to the vehicle's
    drag: float  # relative to the vehicle's
    acceleration_error: float  # m/s2


def clear_report(report: Report) -> None:
    """Write that there is no bound, and no estimate of limits and drag."""
    report.bound = report.thrust_limit = report.drag = report.acceleration_error = NO_BOUND


def write_report(report: Report, estimate: Estimate, cost: float, points: int, health: Array, desired: Vector3) -> None:
    """Write the numbers of estimate, path and thrusters; `report` has the thruster that was isolated last."""
    report.position, report.velocity, report.current = estimate.position, estimate.velocity, estimate.water_velocity[:2]
    report.desired_speed, report.path_cost, report.path_corners = norm(desired), cost, points - 1
    last = int(report.failed_thruster)
    if last == 0 or health[last - 1] > 0.0:
        report.failed_thruster = 0.0
        for j in range(health.size):
            if health[j] == 0.0:
                report.failed_thruster = j + 1
    report.time_since_measurement = estimate.time_since_measurement
    report.thrust_limit, report.drag = np.inf, estimate.drag
    for j in range(health.size):
        if health[j] > 0.0:
            report.thrust_limit = min(report.thrust_limit, estimate.state[EFFECTIVENESS + health.size + j])


def write_program_report(report: Report, multipliers: Array, slack: float, rows: int, steps: int) -> None:
    """Write the numbers of barriers and quadratic program."""
    report.barriers, report.constraint_slack, report.qp_steps = 0.0, slack, steps
    for i in range(rows):
        report.barriers += 1.0 if multipliers[i] > 0.0 else 0.0
