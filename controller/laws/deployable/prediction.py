"""The state behind the thrusters' lag.

Behind a lag tau, forces f follow commands u by tau f' = u - f. Let a be the acceleration without thrust, and G f that
of the thrusters. Then p + tau v has the rate v + tau (a + G f), and this has the rate a + G u + tau a'. So the point
ahead answers to commands at once, and the vehicle follows it: its position is a mean of where that point was. The law
controls the point ahead; without a lag it is the vehicle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.arithmetic import length3
from controller.laws.deployable.attitude import integrate_attitude

Array = NDArray[np.float64]

_GREATEST_TURN = 0.5  # rad, of the attitude ahead


class PredictedState(NamedTuple):
    """The state ahead by the lag."""

    position: Array  # (3,) m, NED
    velocity: Array  # (6,) m/s over ground, NED, and rad/s, body axes
    quaternion: Array  # (4,) from body to world


def empty_prediction() -> PredictedState:
    """Return the state before the first step."""
    return PredictedState(np.zeros(3), np.zeros(6), np.array([1.0, 0.0, 0.0, 0.0]))


def predict_state(
    predicted: PredictedState,
    position: Array,
    velocity: Array,
    quaternion: Array,
    omega: Array,
    acceleration: Array,
    lag: float,
) -> None:
    """Predict the state ahead.

    Parameters
    ----------
    predicted : PredictedState
        Updated.
    position, velocity : ndarray, shape (3,)
        [m], [m/s], NED.
    quaternion : ndarray, shape (4,)
        From body to world.
    omega : ndarray, shape (3,)
        [rad/s], body axes.
    acceleration : ndarray, shape (6,)
        With the forces that act now: [m/s2] over ground, NED; [rad/s2], body axes.
    lag : float
        [s].
    """
    for i in range(3):
        predicted.position[i] = position[i] + lag * velocity[i]
        predicted.velocity[i] = velocity[i] + lag * acceleration[i]
        predicted.velocity[3 + i] = omega[i] + lag * acceleration[3 + i]
    angle = lag * length3(omega[0], omega[1], omega[2])
    share = lag if angle < _GREATEST_TURN else lag * _GREATEST_TURN / angle
    integrate_attitude(quaternion, omega, share, predicted.quaternion)
