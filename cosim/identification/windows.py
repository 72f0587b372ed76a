"""Windows of runs, each predicted from a start state of its own; windows that cannot be predicted are rejected."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cosim.identification.log import STATES, Log, Topic
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

MARGINS = (0.1, 0.2)  # s, times without samples at start and end of a window, if delays are estimated

_MIN_LENGTH = 0.6  # fraction of a full window, below which the rest of a run is dropped
_SETTLED = 1.0  # s, from a run's first command to its first window: the commands then determine lagged forces
_REST_FRACTION = 0.01  # of a thruster's maximum command, up to which it rests: its neutral pulse may be a little off
_IDLE = "no thruster works before or after it: the vehicle may be held"
_MAX_GAP, _MAX_PAUSE = 1.0, 1.5  # s, longest gap in the commands; in samples of velocity, position and attitude
_MAX_RATE = 3.0  # rad/s, maximum angular velocity about a body axis
_MAX_PITCH = math.radians(80.0)  # rad, maximum pitch
_MAX_SATURATED = 0.1  # maximum fraction of a window in which a thruster is commanded beyond its limits


@dataclass(frozen=True)
class Window:
    """A piece of a run on the grid of its commands."""

    run: int  # index of the run
    first: int  # first step on the grid
    steps: int  # number of steps
    begin: float  # s, start of the window in the run's time
    topics: tuple[Topic, ...]  # samples, with times since the window's start
    start: Array  # (13,) start state interpolated from samples: position [m], quaternion, velocity [m/s, rad/s]

    @property
    def topic_names(self) -> NDArray[np.str_]:
        """Topic of each residual, shape (n,)."""
        return np.repeat([t.name for t in self.topics], [len(t.times) * len(t.components) for t in self.topics])

    def by_topic(self, residual: Array) -> dict[str, Array]:
        """Split residuals by topic, shape (samples, components) each; residual (n,)."""
        names = self.topic_names
        return {t.name: residual[: len(names)][names == t.name].reshape(len(t.times), -1) for t in self.topics}


def cut_windows(
    logs: Sequence[Log], vehicle: Vehicle, step: float, length: float, margins: tuple[float, float] = (0.0, 0.0)
) -> tuple[list[Window], Counter[str]]:
    """Cut runs into windows, and reject those that cannot be predicted; step [s], length [s], margins [s]."""
    windows: list[Window] = []
    rejected: Counter[str] = Counter()
    for run, log in enumerate(logs):
        begin, end = _working_time(log)
        idle = int((begin - log.times[0]) / length) + int((log.times[-1] - end) / length)
        if idle:
            rejected[_IDLE] += idle
        for first, steps in _pieces(log, begin, end, step, length):
            window = _window(log, run, first, steps, step, margins)
            if reason := _rejection(log, vehicle, window, steps * step):
                rejected[reason] += 1
            else:
                windows.append(window)
    return windows, rejected


def _working_time(log: Log) -> tuple[float, float]:
    """Return the times [s] of a run's first and last command above its noise; its start and end if all are zero."""
    commands = np.abs(np.concatenate([log.thrust, log.wrench], axis=1))
    working = np.flatnonzero((commands > _REST_FRACTION * commands.max(axis=0)).any(axis=1))
    if not len(working):
        return float(log.times[0]), float(log.times[-1])
    # a sampled command may have begun after the sample before, and ended before the sample after
    first, last = max(working[0] - 1, 0), min(working[-1] + 1, len(log.times) - 1)
    return float(log.times[first]), float(log.times[last])


def _pieces(log: Log, begin: float, end: float, step: float, length: float) -> Iterator[tuple[int, int]]:
    """Yield first step and number of steps of windows of about one length between two times [s]."""
    total = math.floor((end - log.times[0]) / step)
    steps = max(1, round(length / step))
    for first in range(math.ceil((begin - log.times[0] + _SETTLED) / step), total, steps):
        count = min(steps, total - first)
        if count >= _MIN_LENGTH * steps:
            yield first, count


def _window(log: Log, run: int, first: int, steps: int, step: float, margins: tuple[float, float]) -> Window:
    begin = float(log.times[0]) + first * step
    end = begin + steps * step
    inside = [(t.times >= begin + margins[0]) & (t.times < end - margins[1]) for t in log.topics]
    topics = (replace(t, times=t.times[i] - begin, values=t.values[i]) for t, i in zip(log.topics, inside, strict=True))
    return Window(run, first, steps, begin, tuple(topics), _start(log, begin))


def _start(log: Log, time: float) -> Array:
    """Return the state interpolated from the samples at a time [s], shape (13,)."""
    state = np.zeros(13)
    for topic in log.topics:
        values = np.array([np.interp(time, topic.times, x) for x in topic.values.T])
        size = np.linalg.norm(values) if topic.name == "attitude" else 1.0
        state[STATES[topic.name]] = values / size
    return state


def _rejection(log: Log, vehicle: Vehicle, window: Window, length: float) -> str:
    """Return the rule that rejects a window, or an empty text."""
    begin, end = window.begin, window.begin + length
    commanded = (log.times >= begin - _MAX_GAP) & (log.times < end + _MAX_GAP)
    if commanded.sum() < 2 or np.diff(log.times[commanded]).max() > _MAX_GAP:
        return f"a gap of more than {_MAX_GAP:g} s in the commands"
    for topic in window.topics:
        if topic.name in ("velocity", "position", "attitude"):
            times = np.concatenate([[0.0], topic.times, [length]])
            if np.diff(times).max() > _MAX_PAUSE:
                return f"a gap of more than {_MAX_PAUSE:g} s in the {topic.name}"
        if not len(topic.times):
            return f"no samples of {topic.name.replace('_', ' ')}"
        if topic.name == "angular_velocity" and np.abs(topic.values).max() > _MAX_RATE:
            return f"it turns at more than {_MAX_RATE:g} rad/s"
        if topic.name == "attitude":
            e0, e1, e2, e3 = topic.values.T
            if np.abs(2.0 * (e0 * e2 - e1 * e3)).max() > math.sin(_MAX_PITCH):
                return f"it pitches by more than {math.degrees(_MAX_PITCH):.0f} degrees"
        if topic.name == "depth" and topic.values.min() < vehicle.hull_radius:
            return "the hull is at the surface"
    thrust = log.thrust[(log.times >= begin) & (log.times < end)]
    beyond = (thrust < vehicle.thrust_min) | (thrust > vehicle.thrust_max)
    if len(thrust) and beyond.mean(axis=0).max() > _MAX_SATURATED:
        return f"a thruster is beyond its limits for more than {100 * _MAX_SATURATED:.0f} % of it"
    return ""
