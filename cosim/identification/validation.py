"""Validation: errors of free-running predictions from start states that the samples give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.log import TOPICS, Log
from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Residuals
from cosim.identification.windows import Window, cut_windows
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

HORIZONS = (2.0, 5.0)  # s, lengths of the predictions


@dataclass(frozen=True)
class Prediction:
    """Root mean square errors of one topic over one horizon, by component, in the topic's unit."""

    topic: str
    horizon: float  # s
    windows: int  # number of predicted windows
    identified: Array  # (c,) errors of the identified vehicle
    start_vehicle: Array  # (c,) errors of the vehicle with the start values
    held: Array  # (c,) errors of a prediction with constant velocity


def validate(
    logs: Sequence[Log], vehicle: Vehicle, parameters: Sequence[Parameter], values: Array, step: float
) -> list[Prediction]:
    """Predict windows of runs from their sampled start states alone, and compare with the samples; step [s]."""
    found = []
    starts = np.array([p.start if not p.is_nuisance else x for p, x in zip(parameters, values, strict=True)])
    for horizon in HORIZONS:
        windows, _ = cut_windows(logs, vehicle, step, horizon)
        errors: dict[str, list[tuple[Array, Array, Array]]] = {}
        problem = Residuals(logs, vehicle, parameters, windows, step)
        for i, window in enumerate(windows):
            try:
                both = [problem.raw(i, problem.settings(x), window.start, full=False)[0] for x in (values, starts)]
            except IdentificationError:
                continue  # one of the two predictions does not stay finite
            count = 0
            for topic in window.topics:
                size = len(topic.times) * len(topic.components)
                one, other = (r[count : count + size].reshape(-1, len(topic.components)) * topic.noise for r in both)
                count += size
                errors.setdefault(topic.name, []).append((one, other, _held(window, topic.name)))
        for name in TOPICS:
            if name in errors:
                rms = [
                    np.sqrt(np.mean(np.square(np.concatenate(part)), axis=0))
                    for part in zip(*errors[name], strict=True)
                ]
                found.append(Prediction(name, horizon, len(errors[name]), *rms))
    return found


def _held(window: Window, name: str) -> Array:
    """Return the errors of a prediction with the constant velocities of the start, shape (n, c)."""
    topic = next(topic for topic in window.topics if topic.name == name)
    start, times = window.start, topic.times[:, None]
    e0, vector, speed, rate = start[3], start[4:7], start[7:10], start[10:13]
    world = speed + 2.0 * np.cross(vector, np.cross(vector, speed) + e0 * speed)
    if name == "velocity":
        found = speed - topic.values
    elif name == "angular_velocity":
        found = rate - topic.values
    elif name == "depth":
        found = start[2] + times * world[2] - topic.values
    elif name == "position":
        found = start[:3] + times * world - topic.values
    else:
        found = _held_attitude(start[3:7], rate, times, topic.values)
    result: Array = found
    return result


def _held_attitude(quaternion: Array, rate: Array, times: Array, measured: Array) -> Array:
    """Return the rotation vectors from the samples to a prediction with constant rate, shape (n, 3) [rad]."""
    e0, vector = quaternion[0], quaternion[1:]
    angle = np.linalg.norm(rate)
    axis = rate / angle if angle > 0.0 else np.zeros(3)
    turned = np.concatenate([np.cos(0.5 * angle * times), np.sin(0.5 * angle * times) * axis], axis=1)
    w, v = turned[:, :1], turned[:, 1:]
    ahead = np.concatenate([e0 * w - (v @ vector)[:, None], e0 * v + w * vector + np.cross(vector, v)], axis=1)
    m, n = measured[:, :1], measured[:, 1:]
    scalar = m * ahead[:, :1] + np.sum(n * ahead[:, 1:], axis=1, keepdims=True)
    rotation = m * ahead[:, 1:] - ahead[:, :1] * n - np.cross(n, ahead[:, 1:])
    result: Array = 2.0 * np.where(scalar < 0.0, -1.0, 1.0) * rotation
    return result
