"""Predicted measurements of a motion: residuals of each topic, and their exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.identification.log import Topic

Array = NDArray[np.float64]

_POSITION, _ATTITUDE, _LINEAR, _ANGULAR = slice(0, 3), slice(3, 7), slice(7, 10), slice(10, 13)


@dataclass(frozen=True)
class Errors:
    """Constant errors of the sensors."""

    lever: Array  # (3,) m, body frame, from the body origin to the DVL
    scale: float  # relative error of the DVL's velocity [-]; positive: it measures too much
    bias: Array  # (3,) rad/s, body frame, bias of the gyro


def residual(topic: Topic, states: Array, errors: Errors) -> Array:
    """Return prediction less sample, shape (n, c), in standard deviations of the noise; states (n, 13)."""
    if topic.name == "velocity":
        found = (1.0 + errors.scale) * (states[:, _LINEAR] + np.cross(states[:, _ANGULAR], errors.lever)) - topic.values
    elif topic.name == "angular_velocity":
        found = states[:, _ANGULAR] + errors.bias - topic.values
    elif topic.name == "depth":
        found = states[:, 2:3] - topic.values
    elif topic.name == "position":
        found = states[:, _POSITION] - topic.values
    else:
        matrix, sign = _attitude_matrix(topic.values, states)
        found = 2.0 * sign * np.einsum("nij,nj->ni", matrix, states[:, _ATTITUDE])
    result: Array = found / topic.noise
    return result


def derivative(topic: Topic, states: Array, tangents: Array, errors: Errors) -> Array:
    """Return the derivatives of the residual along d directions, shape (n, c, d)."""
    if topic.name == "velocity":
        turned = np.cross(tangents[:, :, _ANGULAR], errors.lever)
        found = (1.0 + errors.scale) * (tangents[:, :, _LINEAR] + turned)
    elif topic.name == "angular_velocity":
        found = tangents[:, :, _ANGULAR]
    elif topic.name == "depth":
        found = tangents[:, :, 2:3]
    elif topic.name == "position":
        found = tangents[:, :, _POSITION]
    else:
        matrix, sign = _attitude_matrix(topic.values, states)
        found = 2.0 * sign[:, :, None] * np.einsum("nij,ndj->ndi", matrix, tangents[:, :, _ATTITUDE])
    result: Array = np.swapaxes(found, 1, 2) / topic.noise[:, None]
    return result


def derivative_by_errors(topic: Topic, states: Array, errors: Errors, kind: str, axis: int) -> Array | None:
    """Return the derivative of the residual by one constant error, shape (n, c); None if it does not depend on it."""
    unit = np.eye(3)[axis]
    if topic.name == "velocity" and kind == "lever":
        found = (1.0 + errors.scale) * np.cross(states[:, _ANGULAR], unit)
    elif topic.name == "velocity" and kind == "scale":
        found = states[:, _LINEAR] + np.cross(states[:, _ANGULAR], errors.lever)
    elif topic.name == "angular_velocity" and kind == "bias":
        found = np.broadcast_to(unit, (len(states), 3))
    else:
        return None
    result: Array = found / topic.noise
    return result


def _attitude_matrix(measured: Array, states: Array) -> tuple[Array, Array]:
    """Return matrices (n, 3, 4) from q to the vector part of conj(measured) q, and signs (n, 1) of its scalar part."""
    # Twice that vector part is the rotation from the sample to the prediction [rad, body frame], if it is small.
    e0, e1, e2, e3 = measured.T
    matrix = np.stack([
        np.stack([-e1, e0, e3, -e2], axis=1),
        np.stack([-e2, -e3, e0, e1], axis=1),
        np.stack([-e3, e2, -e1, e0], axis=1),
    ], axis=1)  # fmt: skip
    scalar = np.sum(measured * states[:, _ATTITUDE], axis=1, keepdims=True)
    return matrix, np.where(scalar < 0.0, -1.0, 1.0)


def turn_tangent(quaternion: Array, axis: int) -> Array:
    """Return the tangent of q exp(angle axis / 2) at angle 0, body axes."""
    e0, e1, e2, e3 = quaternion
    columns = ((-e1, e0, e3, -e2), (-e2, -e3, e0, e1), (-e3, e2, -e1, e0))
    return 0.5 * np.array(columns[axis])
