"""Validation: errors of free-running predictions from start states that the samples give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.errors import IdentificationError
from cosim.identification.log import TOPICS, Log
from cosim.identification.measurements import NO_ERRORS, residual
from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

HORIZONS = (2.0, 5.0)  # s, lengths of the predictions


@dataclass(frozen=True)
class Prediction:
    """Root mean square errors of one topic over one horizon, by component, in the topic's unit."""

    topic: str
    horizon: float  # s
    windows: int  # number of predicted windows
    identified: Array  # (c,) errors of the identified vehicle
    start_vehicle: Array  # (c,) errors of the vehicle with the start values
    constant_velocity: Array  # (c,) SI, errors of a prediction with constant velocity


def validate(
    logs: Sequence[Log], vehicle: Vehicle, parameters: Sequence[Parameter], values: Array, step: float
) -> list[Prediction]:
    """Predict windows of runs from their sampled start states alone, and compare with the samples; step [s]."""
    starts = np.array([p.start if not p.is_nuisance else x for p, x in zip(parameters, values, strict=True)])
    predictions = []
    for horizon in HORIZONS:
        windows, _ = cut_windows(logs, vehicle, step, horizon)
        problem = Residuals(logs, vehicle, parameters, windows, step)
        errors: dict[str, list[tuple[Array, ...]]] = {}
        for i, window in enumerate(windows):
            try:
                identified, start_vehicle = (
                    window.by_topic(problem.raw(i, problem.settings(x), window.start, full=False)[0])
                    for x in (values, starts)
                )
            except IdentificationError:
                continue  # one of the two predictions does not stay finite
            for topic in window.topics:
                constant_velocity = residual(topic, _constant_velocity(window.start, topic.times), NO_ERRORS)
                rows = (identified[topic.name], start_vehicle[topic.name], constant_velocity)
                errors.setdefault(topic.name, []).append(tuple(r * topic.noise for r in rows))
        for name in TOPICS:
            if name in errors:
                rms = (np.sqrt(np.mean(np.square(np.concatenate(e)), axis=0)) for e in zip(*errors[name], strict=True))
                predictions.append(Prediction(name, horizon, len(errors[name]), *rms))
    return predictions


def _constant_velocity(start: Array, times: Array) -> Array:
    """Return the states of a motion with the constant velocities of its start, shape (n, 13); times (n,) [s]."""
    attitude = Rotation.from_quat(start[3:7], scalar_first=True)
    position = start[:3] + times[:, None] * attitude.apply(start[7:10])
    turned = attitude * Rotation.from_rotvec(times[:, None] * start[10:13])
    velocity = np.broadcast_to(start[7:], (len(times), 6))
    return np.hstack([position, turned.as_quat(scalar_first=True), velocity])
