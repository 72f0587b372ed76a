"""The measured state that law and arbiter receive: noise on position and velocity, and times without them."""

from __future__ import annotations

import numpy as np

from controller import VehicleState
from cosim.scenario.tables import Sensing
from cosim.simulation.signals import Array

STREAM = 1  # second part of the seed, as in scored scenes: a scene and a scenario of one seed have the same noise


class Sensor:
    """Computes the measured state from the true state."""

    def __init__(self, sensing: Sensing, true_state: VehicleState, given: VehicleState) -> None:
        self._sensing, self._true_state, self._given = sensing, true_state, given
        self._rng = np.random.default_rng([sensing.seed, STREAM])
        self._deviation: Array = np.repeat([sensing.position_noise, sensing.velocity_noise], 3)
        self._noise: Array = np.zeros(6)

    def measure(self, time: float, anew: bool) -> None:
        """Write the measured state at a time; time [s]."""
        sensing, true_state, measured = self._sensing, self._true_state, self._given
        if anew:
            self._noise[:] = self._deviation * self._rng.standard_normal(6)
        measured.quaternion[:] = true_state.quaternion
        measured.velocity_body[3:] = true_state.velocity_body[3:]
        if sensing.dead_from <= time < sensing.dead_from + sensing.dead_for:
            if not sensing.frozen:
                measured.position[:] = np.nan
                measured.velocity_body[:3] = np.nan
            elif time == 0.0:  # nothing was measured before
                measured.position[:] = true_state.position
                measured.velocity_body[:3] = true_state.velocity_body[:3]
            return
        measured.position[:] = true_state.position + self._noise[:3]
        measured.velocity_body[:3] = true_state.velocity_body[:3] + self._noise[3:]
