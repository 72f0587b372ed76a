"""A whole flight, and its metrics."""

from __future__ import annotations

import math

import numpy as np

from controller.linear_algebra import norm
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.state import State
from cosim.step.decision import controls
from cosim.step.one_step import step
from cosim.step.plant_calls import PlantCalls, fmi_get
from cosim.step.step_model import Array, StepData, StepModel

_ATTITUDE = FIRST_OF_ATTITUDE


class FlightMetrics(State):
    """Metrics of a flight. Steps are -1 for none."""

    first_inside: float = -1.0  # first step inside the goal region at the last of its positions
    last_entered: float = -1.0  # first step of the last visit of the goal
    inside: float  # 1 if inside at the end
    min_clearance: float = math.inf  # m, minimum over hard regions in space; negative: violated; inf: there is none
    min_angle: float = math.inf  # rad, the same for hard regions of attitude
    goal_clearance: float = -math.inf  # m, greatest; negative: the goal was never reached
    effort: float  # N s, integral of the magnitude of the force on the body
    thrust_effort: float  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: float  # N, sum of the absolute changes of the commands, from 0 on
    max_force: float  # N, on the body
    max_speed: float  # m/s, over ground
    worst_step: float  # s of the wall clock, longest time of law and allocation in a step
    failed_step: float = -1.0  # step in which the FMU failed
    bound_excess: float = -math.inf  # m, maximum excess of the law's bound over a clearance; -inf: no bound
    weighted_violation: float  # m s, rad s: sum over regions of priority times the integral of the violation depth
    bound: float = math.nan  # m, the law's last bound of the clearances; NaN: none
    calls: float  # number of calls of a law that gives bounds
    promises: float  # number of those after which it gave one
    healthy_isolated: float  # 1 if the law isolated a thruster that had not failed
    # dimensionless: minimum over thrusters of the limit that the law estimated, relative to the vehicle's
    thrust_limit: float = math.inf


def fly(
    model: StepModel, data: StepData, plant: PlantCalls, metrics: FlightMetrics, before: Array, rows: Array
) -> None:
    """Fly from start to end; rows (control steps, columns), or (0, columns) for none; before (i,) last inputs."""
    if not fmi_get(plant.native):
        data.failed_step = 0
    for k in range(model.steps + 1):
        if data.failed_step >= 0:
            break
        step(model, data, plant, k)
        score_state(model, data, metrics, k)
        if k < model.steps:
            score_forces(model, data, metrics, before)
            if rows.shape[0] > 0 and k % model.control_every == 0 and data.failed_step < 0:
                rows[k // model.control_every] = data.row
    metrics.worst_step, metrics.failed_step = data.max_duration, data.failed_step


def score_state(model: StepModel, data: StepData, metrics: FlightMetrics, k: int) -> None:
    """Score clearances, goal and speed at the beginning of a step."""
    clearances, goal_clearance = data.true_evaluation.clearances[1:], data.true_evaluation.clearances[0]
    for i in range(clearances.size):
        if data.regions.hard[i]:
            if data.regions.kinds[i] < _ATTITUDE:
                metrics.min_clearance = minimum(clearances[i], metrics.min_clearance)
                if not np.isnan(metrics.bound):
                    metrics.bound_excess = max(metrics.bound_excess, metrics.bound - clearances[i])
            else:
                metrics.min_angle = minimum(clearances[i], metrics.min_angle)
        if k < model.steps and not clearances[i] >= 0.0:
            metrics.weighted_violation -= model.priorities[i] * clearances[i] * model.step
    if data.shown_stop == model.mission.stops[model.mission.stops.size - 1]:
        metrics.goal_clearance = max(metrics.goal_clearance, goal_clearance)
        if goal_clearance >= 0.0 and metrics.inside == 0.0:
            metrics.last_entered = k
            if metrics.first_inside < 0.0:
                metrics.first_inside = k
        metrics.inside = goal_clearance >= 0.0
    metrics.max_speed = max(metrics.max_speed, norm(data.true_state.velocity_body[:3]))
    if model.bound >= 0 and k % model.control_every == 0 and controls(model, data):
        metrics.bound = data.law.report[model.bound]
        metrics.calls += 1.0
        metrics.promises += 0.0 if np.isnan(metrics.bound) else 1.0
        if model.isolated >= 0 and data.law.report[model.isolated] > 0.0:
            failed = False
            for i in range(data.failures):
                failed = failed or model.failed[i] + 1 == data.law.report[model.isolated]
            metrics.healthy_isolated = max(metrics.healthy_isolated, 0.0 if failed else 1.0)
        if model.limit >= 0 and not np.isnan(data.law.report[model.limit]):
            metrics.thrust_limit = min(metrics.thrust_limit, data.law.report[model.limit])


def score_forces(model: StepModel, data: StepData, metrics: FlightMetrics, before: Array) -> None:
    """Score commands, and the forces that the plant gave in a step."""
    for j in range(before.size):
        metrics.thrust_variation += abs(data.inputs[j] - before[j])
        before[j] = data.inputs[j]
    if data.failed_step >= 0:
        return
    for j in range(data.forces.size):
        metrics.thrust_effort += abs(data.forces[j]) * model.step
    force = norm(data.force)
    metrics.effort += force * model.step
    metrics.max_force = max(metrics.max_force, force)


def minimum(clearance: float, other: float) -> float:
    """Return the lesser of two clearances [m] or [rad], NaN if one of them is."""
    return clearance if clearance < other or np.isnan(clearance) else other
