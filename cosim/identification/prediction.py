"""Validation: errors of free-running predictions from start states that the samples give."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.errors import IdentificationError
from cosim.identification.delays import move_back
from cosim.identification.log import TOPICS, Log
from cosim.identification.measurements import NO_ERRORS, residual
from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

HORIZONS = (2.0, 5.0, 10.0)  # s, lengths of the predictions


@dataclass(frozen=True)
class Prediction:
    """Errors of the predictions of one topic over one horizon, by component, in the topic's unit."""

    topic: str
    horizon: float  # s
    turns_measured: bool  # True if attitude and angular velocity are inputs, as measured; False if they are predicted
    windows: int  # number of predicted windows
    identified: Array  # (c,) root mean square errors of the identified vehicle
    start_vehicle: Array  # (c,) those of the vehicle with the start values
    constant_velocity: Array  # (c,) SI, those of a prediction with constant velocity
    r2: Array  # (c,) coefficient of determination of the identified vehicle: 1 less squared errors by total variation
    scores: Array  # (runs,) mean of r2 over the components, of each run; NaN for runs without a window


def validate(
    logs: Sequence[Log], vehicle: Vehicle, parameters: Sequence[Parameter], values: Array, step: float,
    horizons: Sequence[float] = HORIZONS, modes: Sequence[bool] = (False, True),
) -> list[Prediction]:  # fmt: skip
    """Predict windows of runs from their sampled start states alone, and compare with the samples; step [s]."""
    # `modes`: with attitude and angular velocity predicted (False), and with those that were measured as inputs (True).
    starts = np.array([p.start if not p.is_nuisance else x for p, x in zip(parameters, values, strict=True)])
    delays = {name: float(x) for p, x in zip(parameters, values, strict=True) if p.kind == "delay" for name in p.topics}
    logs = [move_back(log, delays) for log in logs]
    predictions = []
    for horizon, measured in itertools.product(horizons, modes):
        windows, _ = cut_windows(logs, vehicle, step, horizon)
        problem = Residuals(logs, vehicle, parameters, windows, step, turns_measured=measured)
        settings = [problem.settings(x) for x in (values, starts)]
        rows: dict[str, list[tuple[int, Array, tuple[Array, ...]]]] = {}
        for i, window in enumerate(problem.windows):
            try:
                both = [window.by_topic(problem.raw(i, setting, window.start, full=False)[0]) for setting in settings]
            except IdentificationError:
                continue  # one of the two predictions does not stay finite
            for topic in window.topics:
                constant_velocity = residual(topic, _constant_velocity(window.start, topic.times), NO_ERRORS)
                errors = (both[0][topic.name], both[1][topic.name], constant_velocity)
                entry = window.run, topic.values, tuple(r * topic.noise for r in errors)
                rows.setdefault(topic.name, []).append(entry)
        names = [name for name in TOPICS if name in rows]
        predictions += [_summarize(name, horizon, measured, rows[name], len(logs)) for name in names]
    return predictions


def _summarize(
    name: str, horizon: float, measured: bool, rows: Sequence[tuple[int, Array, tuple[Array, ...]]], runs: int
) -> Prediction:
    """Return the errors of a topic from run, samples and errors of each window."""
    of_run = np.concatenate([np.full(len(values), run) for run, values, _ in rows])
    samples = np.concatenate([values for _, values, _ in rows])
    errors = [np.concatenate(e) for e in zip(*(e for _, _, e in rows), strict=True)]
    # quaternions have no such coefficient by axis; positions and depth have that about their mean
    spread = np.sum(np.square(samples - samples.mean(axis=0)), axis=0) if name != "attitude" else np.full(3, np.nan)
    r2 = 1.0 - np.sum(np.square(errors[0]), axis=0) / spread
    squares = [np.sum(np.square(errors[0][of_run == run]), axis=0) * len(of_run) for run in range(runs)]
    counts = np.bincount(of_run, minlength=runs)
    scores = [np.mean(1.0 - s / (n * spread)) if n else np.nan for s, n in zip(squares, counts, strict=True)]
    identified, start, constant = (np.sqrt(np.mean(np.square(e), axis=0)) for e in errors)
    return Prediction(name, horizon, measured, len(rows), identified, start, constant, r2, np.array(scores))


def _constant_velocity(start: Array, times: Array) -> Array:
    """Return the states of a motion with the constant velocities of its start, shape (n, 13); times (n,) [s]."""
    attitude = Rotation.from_quat(start[3:7], scalar_first=True)
    position = start[:3] + times[:, None] * attitude.apply(start[7:10])
    turned = attitude * Rotation.from_rotvec(times[:, None] * start[10:13])
    velocity = np.broadcast_to(start[7:], (len(times), 6))
    return np.hstack([position, turned.as_quat(scalar_first=True), velocity])
