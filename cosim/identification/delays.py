"""Start values of the delays of samples behind the commands, found before the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cosim.identification.actuation import CommandedForces
from cosim.identification.log import TOPICS, Log, Topic
from cosim.identification.parameters import Parameter
from cosim.identification.windows import MARGINS
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

_SPAN = 0.3  # s, time between the two samples of a change of velocity
_GRID = np.arange(-0.1, 0.601, 0.02)  # s, candidate delays
_LAGS = (0.0, 0.1, 0.2)  # s, candidate lags of the thrusters; the most likely one is used
_MIN_CHANGES = 50  # minimum number of changes for an estimate
_DECIDED = 20.0  # twice the gain of log-likelihood above which a topic gets a delay of its own
_SLOW = ("depth", "position")  # topics whose second differences are noise: they get the least delay of the others


def find_delays(logs: Sequence[Log], vehicle: Vehicle, step: float) -> dict[str, float]:
    """Find the delay of each topic behind the commands, to some hundredths of a second; step [s]."""
    # Changes of a velocity over 0.3 s are regressed on the impulse of the commanded wrench over the same time, shifted
    # by a delay and filtered by a lag, and on the velocity itself. All topics get the delay with the least residual; a
    # topic whose own delay fits clearly better gets that. Of the vehicle only its thrusters' directions are used.
    evidence: dict[str, Array] = {}
    for log in logs:
        forces = CommandedForces(log, vehicle, step)
        ones = np.ones(vehicle.n_thrusters)
        wrenches = [forces.actuation(lag, ones).wrench[:, 0] for lag in _LAGS]
        impulses = [np.concatenate([np.zeros((1, 6)), step * np.cumsum(w, axis=0)]) for w in wrenches]
        edges = forces.start + step * np.arange(forces.steps + 1)
        for topic in (t for t in log.topics if t.name not in _SLOW):
            loss = _unexplained(*_velocities(topic), log, edges, impulses)
            if loss is not None:
                evidence[topic.name] = evidence.get(topic.name, 0.0) + loss
    losses = {name: loss.min(axis=0) for name, loss in evidence.items()}
    losses = {name: loss for name, loss in losses.items() if 0 < np.argmin(loss) < len(_GRID) - 1}  # a real minimum
    if not losses:
        return {}
    common = int(np.argmin(np.sum(list(losses.values()), axis=0)))
    delays = {
        name: float(_GRID[np.argmin(loss) if loss[common] - loss.min() > _DECIDED else common])
        for name, loss in losses.items()
    }
    present = (name for name in TOPICS if any(log.topic(name) for log in logs))
    return {name: delays.get(name, min(delays.values())) for name in present}


def usual_delays(vehicle: Vehicle) -> dict[str, float]:
    """Return the delay [s] of each topic by the vehicle's file."""
    return dict.fromkeys(TOPICS, vehicle.command_delay)


def move_back(log: Log, delays: dict[str, float]) -> Log:
    """Return a log whose sample times are corrected by the delays; delays [s]."""
    return replace(log, topics=tuple(
        replace(t, times=t.times - delays.get(t.name, 0.0), shift=delays.get(t.name, 0.0)) for t in log.topics
    ))  # fmt: skip


def delay_of(p: Parameter, delays: dict[str, float]) -> float:
    """Return the delay [s] of the topics of a parameter."""
    return max((delays[name] for name in p.topics if name in delays), default=0.0)


def within_margins(p: Parameter, delays: dict[str, float]) -> Parameter:
    """Return a delay with bounds that keep samples in their windows; return other parameters unchanged."""
    if p.kind != "delay":
        return p
    late = delay_of(p, delays)
    return replace(p, min=late - MARGINS[1], max=late + MARGINS[0])


def _velocities(topic: Topic) -> tuple[Array, Array]:
    """Return times [s], (n,), and velocities, (n, 3), of a topic; an attitude's are differences over the span."""
    if topic.name != "attitude":
        return topic.times, topic.values
    m = _pairs(topic.times)
    spans = (topic.times[m:] - topic.times[:-m])[:, None]
    middle = 0.5 * (topic.times[m:] + topic.times[:-m])
    (e0, v), (f0, w) = ((q[:, :1], q[:, 1:]) for q in (topic.values[:-m], topic.values[m:]))
    return middle, 2.0 * (e0 * w - f0 * v - np.cross(v, w)) / spans  # vector part of conj(q) q'


def _pairs(times: Array) -> int:
    """Return the number of samples between the two of a pair."""
    return max(1, round(_SPAN / float(np.median(np.diff(times)))))


def _unexplained(times: Array, velocity: Array, log: Log, edges: Array, impulses: Sequence[Array]) -> Array | None:
    """Return minus twice the log-likelihood up to a constant, shape (lags, delays); None for too few changes."""
    m, attitude = _pairs(times), log.topic("attitude")
    if len(times) <= m or attitude is None:
        return None
    e0, e1, e2, e3 = (np.interp(times, attitude.times, x) for x in attitude.values.T)
    down = np.column_stack([e1 * e3 - e0 * e2, e2 * e3 + e0 * e1])  # half the vertical's body components x and y
    drags = np.hstack([velocity, velocity * np.abs(velocity), down])
    pieces = np.diff(times)[:, None] * 0.5 * (drags[1:] + drags[:-1])
    sums = np.concatenate([np.zeros((1, pieces.shape[1])), np.cumsum(pieces, axis=0)])
    inside = (times[:-m] - _GRID[-1] > edges[0]) & (times[m:] - _GRID[0] < edges[-1])
    inside &= times[m:] - times[:-m] < 2.0 * _SPAN  # no gap
    if inside.sum() < _MIN_CHANGES:
        return None
    begin, end = times[:-m][inside], times[m:][inside]
    change = (velocity[m:] - velocity[:-m])[inside]
    known = np.column_stack([(sums[m:] - sums[:-m])[inside], end - begin])
    independent = float(np.median(np.diff(times))) / _SPAN  # independent fraction of each change, since they overlap
    losses = np.empty((len(impulses), len(_GRID)))
    for i, impulse in enumerate(impulses):
        for j, delay in enumerate(_GRID):
            both = (np.column_stack([np.interp(t - delay, edges, x) for x in impulse.T]) for t in (end, begin))
            regressors = np.column_stack([np.subtract(*both), known])
            solution, *_ = np.linalg.lstsq(regressors, change)
            losses[i, j] = float(np.log(np.square(change - regressors @ solution).sum(axis=0) + 1e-12).sum())
    return independent * len(change) * losses
