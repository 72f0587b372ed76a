"""The Lyapunov function V of the paper's law, and its rate, as signals of a run."""

from __future__ import annotations

import numpy as np

from controller.paper_law import primary_error, secondary_error
from controller.quaternion import error, rotation_matrix
from controller.theory import (
    mapped_error,
    mapped_error_rate,
    normalized_secondary,
    primary_value,
    printed_secondary,
    value_rate,
)
from cosim.scenario.scenario import Scenario
from cosim.scenario.true_vehicle import true_model
from cosim.simulation.signals import Array, Column
from cosim.step.step_model import StepData

FORMS = ("printed", "normalized", "primary")  # forms of V, in the order of the columns

_STEP = 1e-4  # m, half width of the central differences along the motion


def lyapunov_columns(scenario: Scenario) -> list[Column]:
    """Return the columns of V and its rate; empty unless the scenario records them."""
    if not scenario.record.lyapunov:
        return []
    return [
        Column("lyapunov.printed", "N.m", "V of (31) as printed"),
        Column("lyapunov.normalized", "N.m", "V of (31) with the potential of the normalized force (22)"),
        Column("lyapunov.primary", "N.m", "V of (31) without secondary regions"),
        Column("lyapunov.rate", "W", "dV/dt = -W of (40), (41)"),
    ]


class LyapunovSignals:
    """Writes V and its rate into the row of a step; out (4,)."""

    def __init__(self, scenario: Scenario, data: StepData, out: Array) -> None:
        self._model, self._gains = true_model(scenario), scenario.law.gains
        self._desired = np.array(scenario.law.desired_quaternion)
        self._state, self._goal, self._regions, self._data = data.true_state, data.goal, data.regions, data
        self._out, n = out, data.weights.size
        self._goal_buffers = np.empty(1), np.empty((1, 3)), np.empty((1, 3)), np.empty(1)
        self._region_buffers = np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty(n)

    def write(self) -> None:
        """Write V in its three forms, and its rate."""
        model, gains, state, out = self._model, self._gains, self._state, self._out
        velocity, estimate, betas = (
            state.velocity_body,
            self._data.estimate,
            self._regions.gains * self._data.weights / gains.k_q,
        )
        R, turned = rotation_matrix(state.quaternion), error(self._desired, state.quaternion)
        region_rate = self._region_rate(R @ velocity[:3], betas)
        e_p, e_s = self._region_errors(state.position, betas)
        f, (g, g_gradients, _, clearances) = self._goal_buffers[0][0], self._region_buffers
        y = mapped_error(e_p, e_s, turned[1:], R, gains)
        alone = mapped_error(e_p, np.zeros(3), turned[1:], R, gains)
        value = primary_value(model, gains, f, turned, y, velocity, estimate)
        out[0] = value + printed_secondary(g, g_gradients, betas, gains)
        out[1] = value + normalized_secondary(g, g_gradients, clearances, betas, gains)
        out[2] = primary_value(model, gains, f, turned, alone, velocity, estimate)
        y_rate = mapped_error_rate(region_rate, y, turned, R, velocity[3:])
        out[3] = value_rate(model, gains, y, y_rate, velocity)

    def _region_rate(self, velocity: Array, betas: Array) -> Array:
        """Return d/dt (e_p + (k_q/k_p1) e_s), shape (3,), by central differences along the motion, weights held."""
        speed = float(np.linalg.norm(velocity))
        if not speed > 0.0:
            return 0.0 * velocity
        ratio = self._gains.k_q / self._gains.k_p1
        offset = _STEP / speed * velocity
        (p_ahead, s_ahead), (p_behind, s_behind) = (
            self._region_errors(self._state.position + side * offset, betas) for side in (1.0, -1.0)
        )
        result: Array = (p_ahead - p_behind + ratio * (s_ahead - s_behind)) * (speed / (2.0 * _STEP))
        return result

    def _region_errors(self, position: Array, betas: Array) -> tuple[Array, Array]:
        """Evaluate goal and regions at a position; return e_p and e_s, shape (3,) each."""
        self._goal.evaluate(position, self._state.quaternion, *self._goal_buffers)
        self._regions.evaluate(position, self._state.quaternion, *self._region_buffers)
        (f, *_), (gradient, *_) = self._goal_buffers[:2]
        return primary_error(f, gradient), secondary_error(*self._region_buffers[:2], betas)
