"""Predicted measurements of a motion: residuals of each topic, and their exact derivatives."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from cosim.identification.log import STATES, Topic, half_turns
from cosim.simulation.signals import Array

_LINEAR, _ANGULAR = STATES["velocity"], STATES["angular_velocity"]


@dataclass(frozen=True)
class Errors:
    """Constant errors of the sensors."""

    lever: Array  # (3,) m, body frame, from the body origin to the DVL
    scale: float  # relative error of the DVL's velocity [-]; positive: it measures too much
    bias: Array  # (3,) rad/s, body frame, bias of the gyro

    @functools.cached_property
    def turning(self) -> Array:
        """Matrix (3, 3) by which rows of angular velocity [rad/s] give the DVL's velocity about the origin [m/s]."""
        return np.cross(np.eye(3), self.lever)


NO_ERRORS = Errors(np.zeros(3), 0.0, np.zeros(3))


def residual(topic: Topic, states: Array, errors: Errors) -> Array:
    """Return prediction less sample, shape (n, c), in standard deviations of the noise; states (n, 13)."""
    prediction = states[:, STATES[topic.name]]
    if topic.name == "attitude":
        error = 2.0 * _sign(topic, states) * np.einsum("nij,nj->ni", half_turns(topic.values), prediction)
    else:
        if topic.name == "velocity":
            prediction = (1.0 + errors.scale) * (prediction + states[:, _ANGULAR] @ errors.turning)
        elif topic.name == "angular_velocity":
            prediction = prediction + errors.bias
        error = prediction - topic.values
    result: Array = error / topic.noise
    return result


def derivative(topic: Topic, states: Array, tangents: Array, errors: Errors) -> Array:
    """Return the derivatives of the residual along d directions, shape (n, c, d)."""
    change = tangents[:, :, STATES[topic.name]]
    if topic.name == "velocity":
        change = (1.0 + errors.scale) * (change + tangents[:, :, _ANGULAR] @ errors.turning)
    elif topic.name == "attitude":
        turn = np.einsum("nij,ndj->ndi", half_turns(topic.values), change)
        change = 2.0 * _sign(topic, states)[:, :, None] * turn
    result: Array = np.swapaxes(change, 1, 2) / topic.noise[:, None]
    return result


def derivative_by_errors(topic: Topic, states: Array, errors: Errors, kind: str, axis: int) -> Array | None:
    """Return the derivative of the residual by one constant error, shape (n, c); None if it does not depend on it."""
    unit = np.eye(3)[axis]
    if topic.name == "velocity" and kind == "lever":
        change = (1.0 + errors.scale) * states[:, _ANGULAR] @ np.cross(np.eye(3), unit)
    elif topic.name == "velocity" and kind == "scale":
        change = states[:, _LINEAR] + states[:, _ANGULAR] @ errors.turning
    elif topic.name == "angular_velocity" and kind == "bias":
        change = np.broadcast_to(unit, (len(states), 3))
    else:
        return None
    result: Array = change / topic.noise
    return result


def _sign(topic: Topic, states: Array) -> Array:
    """Return the sign of the scalar part of conj(sample) q, shape (n, 1)."""
    scalar = np.sum(topic.values * states[:, STATES["attitude"]], axis=1, keepdims=True)
    return np.where(scalar < 0.0, -1.0, 1.0)
