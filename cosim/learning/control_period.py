"""A control period under a given wrench, with its reward and what is observed at its end."""

from __future__ import annotations

import numpy as np

from controller.law import Array
from controller.linear_algebra import norm
from controller.quaternion import rotation_matrix
from controller.stack_array import Vector6
from controller.state import State
from controller.translator.foreign import call_c
from cosim.results.spans import SETTLED_FOR
from cosim.step.arbiter_inputs import write_arbiter_state
from cosim.step.decision import control
from cosim.step.one_step import decide, step_plant
from cosim.step.plant_calls import PlantCalls, fmi_get
from cosim.step.region_positions import evaluate_all
from cosim.step.score import FlightMetrics, score_forces, score_state
from cosim.step.sensing import fail_thrusters, measure
from cosim.step.step_model import WORDS, Integers, StepData, StepModel

VEHICLE, REGION = 12, 4  # observed numbers of the vehicle; of the goal and of each region
REWARD, TERMINATED, TRUNCATED = 0, 1, 2  # indices of an outcome
_VIOLATION = 10.0  # reward lost per meter and second of weighted violation


class Episode(State):
    """Inputs of a period, and the score at its beginning."""

    wrench: Vector6  # N, N m, body frame
    before: Array  # (i,) inputs of the plant in the step before
    approach: float  # m, clearance of the goal, at most 0
    violation: float  # m s, weighted violation so far


def begin(
    model: StepModel,
    data: StepData,
    plant: PlantCalls,
    metrics: FlightMetrics,
    episode: Episode,
    observation: Array,
    outcome: Array,
) -> None:
    """Observe the initial state; for `observation` and `outcome` see `advance_period`."""
    if not fmi_get(plant.native):
        data.failed_step = 0
    _begin_step(model, data, plant, metrics, 0)
    _observe(model, data, observation)
    _judge(model, data, metrics, episode, outcome)


def advance_period(
    model: StepModel,
    data: StepData,
    plant: PlantCalls,
    metrics: FlightMetrics,
    episode: Episode,
    observation: Array,
    outcome: Array,
) -> None:
    """Hold a wrench for a control period; write the observation (see `RegionEnv`), and the outcome, shape (3,)."""
    data.command[:] = episode.wrench
    control(model, data)
    for _ in range(model.control_every):
        if data.failed_step < 0 and data.k < model.steps:
            step_plant(model, data, plant)
            score_forces(model, data, metrics, episode.before)
            if data.failed_step < 0:
                _begin_step(model, data, plant, metrics, data.k + 1)
    _observe(model, data, observation)
    _judge(model, data, metrics, episode, outcome)


def call_each(calls: Integers) -> None:
    """Call the functions whose addresses and arguments stand in turn in `calls`, shape (2 n,)."""
    for i in range(0, calls.size, 2):
        call_c(calls[i], WORDS, calls[i + 1])


def _begin_step(model: StepModel, data: StepData, plant: PlantCalls, metrics: FlightMetrics, k: int) -> None:
    """Begin step `k` as a run does, up to the control law."""
    data.k = k
    data.now = k * model.step
    fail_thrusters(model, data, plant)
    measure(model, data, plant)
    decide(model, data, k % model.arbiter_every == 0, False)
    score_state(model, data, metrics, k)


def _observe(model: StepModel, data: StepData, observation: Array) -> None:
    write_arbiter_state(data.state, data.expected, data.arbiter_state)
    R, evaluation = rotation_matrix(data.arbiter_state.quaternion), data.arbiter_evaluation
    evaluate_all(data, data.arbiter_state, evaluation)
    observation[:3] = R.T @ (data.goal_center + data.goal.shifts[0] - data.arbiter_state.position)
    observation[3:6] = R[2]
    observation[6:VEHICLE] = data.arbiter_state.velocity_body
    for i in range(evaluation.clearances.size):
        first = VEHICLE + REGION * i
        observation[first] = evaluation.clearances[i]
        slope = norm(evaluation.gradients[i])
        inward = -1.0 / slope if slope > 0.0 else 0.0
        observation[first + 1 : first + REGION] = R.T @ (evaluation.gradients[i] * inward)
    observation[VEHICLE + REGION * evaluation.clearances.size :] = data.by_criterion
    for i in range(observation.size):
        if not np.isfinite(observation[i]):  # of a position that is lost, or a region without end
            observation[i] = 0.0


def _judge(model: StepModel, data: StepData, metrics: FlightMetrics, episode: Episode, outcome: Array) -> None:
    """Write the reward of a period, and whether the episode ends with it."""
    approach, inside = min(data.true_evaluation.clearances[0], 0.0), metrics.inside > 0.0
    violation = metrics.weighted_violation - episode.violation
    outcome[REWARD] = approach - episode.approach - _VIOLATION * violation
    if inside:
        outcome[REWARD] += model.control_every * model.step
    stayed = inside and (data.k - metrics.last_entered) * model.step >= SETTLED_FOR
    outcome[TERMINATED] = 1.0 if stayed or data.failed_step >= 0 else 0.0
    outcome[TRUNCATED] = 1.0 if data.k >= model.steps and outcome[TERMINATED] == 0.0 else 0.0
    episode.approach = approach
    episode.violation = metrics.weighted_violation
