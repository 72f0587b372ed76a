"""What law and arbiter are told of the vehicle: its state with noise on position and velocity, held, or lost."""

from __future__ import annotations

import numpy as np

from controller import VehicleState
from cosim.scenario.tables import Sensing
from cosim.simulation.signals import Array

STREAM = 1  # beside the seed, as in scored scenes: a scene and a scenario of one seed have the same noise


class Sensor:
    """Makes the state that is told from the true one.

    Parameters
    ----------
    sensing : Sensing
        Noise and gaps.
    truth : VehicleState
        Views of the true state.
    told : VehicleState
        Receives what is told.
    """

    def __init__(self, sensing: Sensing, truth: VehicleState, told: VehicleState) -> None:
        self._sensing, self._truth, self._told = sensing, truth, told
        self._rng = np.random.default_rng([sensing.seed, STREAM])
        self._deviation: Array = np.repeat([sensing.position_noise, sensing.velocity_noise], 3)
        self._noise: Array = np.zeros(6)

    def tell_truth(self) -> None:
        """Write the true state, as before the first measurement."""
        self._told.position[:] = self._truth.position
        self._told.quaternion[:] = self._truth.quaternion
        self._told.velocity_body[:] = self._truth.velocity_body

    def measure(self, time: float, anew: bool) -> None:
        """Write what is told at a time.

        Parameters
        ----------
        time : float
            [s].
        anew : bool
            Draw new noise, as at each control step; otherwise that of the last one stays.
        """
        sensing, truth, told = self._sensing, self._truth, self._told
        if anew:
            self._noise[:] = self._deviation * self._rng.standard_normal(6)
        told.quaternion[:] = truth.quaternion
        told.velocity_body[3:] = truth.velocity_body[3:]
        if sensing.dead_from <= time < sensing.dead_from + sensing.dead_for:
            if not sensing.frozen:
                told.position[:] = np.nan
                told.velocity_body[:3] = np.nan
            elif time == 0.0:  # nothing was measured before
                told.position[:] = truth.position
                told.velocity_body[:3] = truth.velocity_body[:3]
            return
        told.position[:] = truth.position + self._noise[:3]
        told.velocity_body[:3] = truth.velocity_body[:3] + self._noise[3:]
