"""A whole flight, and its metrics."""

from __future__ import annotations

import math
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from controller.linear_algebra import norm
from controller.regions.kinds import FIRST_OF_ATTITUDE
from cosim.step.decision import controls
from cosim.step.one_step import step
from cosim.step.plant_calls import PlantCalls, fmi_get
from cosim.step.step_model import Array, StepData, StepModel

T = TypeVar("T", float, Array)

_ATTITUDE = FIRST_OF_ATTITUDE


class FlightMetrics(NamedTuple, Generic[T]):
    """Metrics of a flight, floats, or arrays of shape (1,) during the flight. Steps are -1 for none."""

    first_inside: T  # first step inside the goal region at the last of its positions
    last_entered: T  # first step of the last visit of the goal
    inside: T  # 1 if inside at the end
    min_clearance: T  # m, minimum over hard regions in space; negative: violated; inf: there is none
    min_angle: T  # rad, the same for hard regions of attitude
    goal_clearance: T  # m, greatest; negative: the goal was never reached
    effort: T  # N s, integral of the magnitude of the force on the body
    thrust_effort: T  # N s, sum over thrusters of the integral of the given force's magnitude
    thrust_variation: T  # N, sum of the absolute changes of the commands, from 0 on
    max_force: T  # N, on the body
    max_speed: T  # m/s, over ground
    worst_step: T  # s of the wall clock, longest time of law and allocation in a step
    failed_step: T  # step in which the FMU failed
    bound_excess: T  # m, maximum excess of the law's bound over a clearance; -inf: no bound
    weighted_violation: T  # m s, rad s: sum over regions of priority times the integral of the violation depth
    bound: T  # m, the law's last bound of the clearances; NaN: none
    calls: T  # number of calls of a law that gives bounds
    promises: T  # number of those after which it gave one
    healthy_isolated: T  # 1 if the law isolated a thruster that had not failed
    thrust_limit: T  # least limit of a thruster that the law estimated, as a fraction of that in the vehicle's file


def empty_metrics() -> tuple[Array, FlightMetrics[Array]]:
    """Return the metrics before a flight, as one array and as views of its elements."""
    inf, nan = math.inf, math.nan
    values = np.array(
        [-1.0, -1.0, 0.0, inf, inf, -inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, -inf, 0.0, nan] + [0.0] * 3 + [inf]
    )
    return values, FlightMetrics(*(values[i : i + 1] for i in range(values.size)))


def fly(
    model: StepModel, data: StepData, plant: PlantCalls, metrics: FlightMetrics[Array], before: Array, rows: Array
) -> None:
    """Fly from start to end; rows (control steps, columns), or (0, 0) for none; before (i,) last inputs."""
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
    metrics.worst_step[0], metrics.failed_step[0] = data.max_duration, data.failed_step


def score_state(model: StepModel, data: StepData, metrics: FlightMetrics[Array], k: int) -> None:
    """Score clearances, goal and speed at the beginning of a step."""
    clearances, goal_clearance = data.true_evaluation.clearances[1:], data.true_evaluation.clearances[0]
    for i in range(clearances.size):
        if data.regions.hard[i]:
            if data.regions.kinds[i] < _ATTITUDE:
                metrics.min_clearance[0] = minimum(clearances[i], metrics.min_clearance[0])
                if not np.isnan(metrics.bound[0]):
                    metrics.bound_excess[0] = max(metrics.bound_excess[0], metrics.bound[0] - clearances[i])
            else:
                metrics.min_angle[0] = minimum(clearances[i], metrics.min_angle[0])
        if k < model.steps and not clearances[i] >= 0.0:
            metrics.weighted_violation[0] -= model.priorities[i] * clearances[i] * model.step
    if data.shown_goal_index == model.goal_places.shape[0]:
        metrics.goal_clearance[0] = max(metrics.goal_clearance[0], goal_clearance)
        if goal_clearance >= 0.0 and metrics.inside[0] == 0.0:
            metrics.last_entered[0] = k
            if metrics.first_inside[0] < 0.0:
                metrics.first_inside[0] = k
        metrics.inside[0] = goal_clearance >= 0.0
    metrics.max_speed[0] = max(metrics.max_speed[0], norm(data.true_state.velocity_body[:3]))
    if model.bound >= 0 and k % model.control_every == 0 and controls(model, data):
        metrics.bound[0] = data.law.report[model.bound]
        metrics.calls[0] += 1.0
        metrics.promises[0] += 0.0 if np.isnan(metrics.bound[0]) else 1.0
        if model.isolated >= 0 and data.law.report[model.isolated] > 0.0:
            failed = False
            for i in range(data.failures):
                failed = failed or model.failed[i] + 1 == data.law.report[model.isolated]
            metrics.healthy_isolated[0] = max(metrics.healthy_isolated[0], 0.0 if failed else 1.0)
        if model.limit >= 0:
            metrics.thrust_limit[0] = min(metrics.thrust_limit[0], data.law.report[model.limit])


def score_forces(model: StepModel, data: StepData, metrics: FlightMetrics[Array], before: Array) -> None:
    """Score commands, and the forces that the plant gave in a step."""
    for j in range(before.size):
        metrics.thrust_variation[0] += abs(data.inputs[j] - before[j])
        before[j] = data.inputs[j]
    if data.failed_step >= 0:
        return
    for j in range(data.forces.size):
        metrics.thrust_effort[0] += abs(data.forces[j]) * model.step
    force = norm(data.force)
    metrics.effort[0] += force * model.step
    metrics.max_force[0] = max(metrics.max_force[0], force)


def minimum(clearance: float, other: float) -> float:
    """Return the lesser of two clearances [m] or [rad], NaN if one of them is."""
    return clearance if clearance < other or np.isnan(clearance) else other
