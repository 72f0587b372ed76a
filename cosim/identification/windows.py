"""Windows of runs: each is predicted from a start of its own. What no model of still thrusters explains is rejected."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cosim.identification.log import Log, Topic
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

MARGINS = (0.1, 0.2)  # s, at the ends of a window without samples, where delays are free

_SHORTEST = 0.6  # part of a full window, below which the rest of a run is dropped
_SETTLED = 1.0  # s, after a run's first command: forces that lag are then known by the commands since
_MOST_GAP = 1.0  # s without a command, or without a sample of velocity, position or attitude
_FASTEST = 3.0  # rad/s
_STEEPEST = math.radians(80.0)  # of pitch
_MOST_SATURATED = 0.1  # part of a window that a thruster may be commanded beyond its limits


@dataclass(frozen=True)
class Window:
    """A piece of a run on the grid of its commands."""

    run: int
    first: int  # step of the grid
    steps: int
    begin: float  # s, in the run's time
    topics: tuple[Topic, ...]  # their times since the window's begin
    start: Array  # (13,) as the samples have it


def cut_windows(
    logs: Sequence[Log], vehicle: Vehicle, step: float, length: float, margins: tuple[float, float] = (0.0, 0.0)
) -> tuple[list[Window], Counter[str]]:
    """Cut runs into windows, and reject those that cannot be predicted.

    Parameters
    ----------
    logs : sequence of Log
        The runs.
    vehicle : Vehicle
        Its limits say whether thrusters are saturated, its hull where the surface is.
    step : float
        Of the grid [s].
    length : float
        Of a window [s]; the last one of a run may be shorter by two fifths.
    margins : tuple of float
        At begin and end, without samples [s].

    Returns
    -------
    list of Window
        In the order of the runs and of time.
    Counter of str
        How many windows were rejected, by the rule that rejected them.
    """
    kept: list[Window] = []
    rejected: Counter[str] = Counter()
    for run, log in enumerate(logs):
        for first, steps in _pieces(log, step, length):
            window = _window(log, run, first, steps, step, margins)
            reason = _fault(log, vehicle, window, steps * step)
            if reason:
                rejected[reason] += 1
            else:
                kept.append(window)
    return kept, rejected


def _pieces(log: Log, step: float, length: float) -> Iterator[tuple[int, int]]:
    """Yield first step and number of steps of windows of about one length."""
    total = math.floor((log.times[-1] - log.times[0]) / step)
    steps = max(1, round(length / step))
    for first in range(math.ceil(_SETTLED / step), total, steps):
        count = min(steps, total - first)
        if count >= _SHORTEST * steps:
            yield first, count


def _window(log: Log, run: int, first: int, steps: int, step: float, margins: tuple[float, float]) -> Window:
    begin = float(log.times[0]) + first * step
    end = begin + steps * step
    topics = []
    for topic in log.topics:
        inside = (topic.times >= begin + margins[0]) & (topic.times < end - margins[1])
        topics.append(replace(topic, times=topic.times[inside] - begin, values=topic.values[inside]))
    return Window(run, first, steps, begin, tuple(topics), _start(log, begin))


def _start(log: Log, time: float) -> Array:
    """Return the state that the samples about a time have."""
    state = np.zeros(13)
    for topic in log.topics:
        values = np.array([np.interp(time, topic.times, x) for x in topic.values.T])
        if topic.name == "attitude":
            state[3:7] = values / np.linalg.norm(values)
        elif topic.name == "depth":
            state[2] = values[0]
        else:
            first = {"velocity": 7, "angular_velocity": 10, "position": 0}[topic.name]
            state[first : first + 3] = values
    return state


def _fault(log: Log, vehicle: Vehicle, window: Window, length: float) -> str:
    """Return the rule that rejects a window; empty where none does."""
    begin, end = window.begin, window.begin + length
    commanded = (log.times >= begin - _MOST_GAP) & (log.times < end + _MOST_GAP)
    if commanded.sum() < 2 or np.diff(log.times[commanded]).max() > _MOST_GAP:
        return f"a gap of more than {_MOST_GAP:g} s in the commands"
    for topic in window.topics:
        if topic.name in ("velocity", "position", "attitude"):
            times = np.concatenate([[0.0], topic.times, [length]])
            if np.diff(times).max() > _MOST_GAP + 0.5:
                return f"a gap of more than {_MOST_GAP:g} s in the {topic.name}"
        if not len(topic.times):
            return f"no samples of {topic.name.replace('_', ' ')}"
        if topic.name == "angular_velocity" and np.abs(topic.values).max() > _FASTEST:
            return f"it turns at more than {_FASTEST:g} rad/s"
        if topic.name == "attitude":
            e0, e1, e2, e3 = topic.values.T
            if np.abs(2.0 * (e0 * e2 - e1 * e3)).max() > math.sin(_STEEPEST):
                return f"it pitches by more than {math.degrees(_STEEPEST):.0f} degrees"
        if topic.name == "depth" and topic.values.min() < vehicle.hull_radius:
            return "the hull is at the surface"
    thrust = log.thrust[(log.times >= begin) & (log.times < end)]
    beyond = (thrust < vehicle.thrust_min) | (thrust > vehicle.thrust_max)
    if len(thrust) and beyond.mean(axis=0).max() > _MOST_SATURATED:
        return f"a thruster is beyond its limits for more than {100 * _MOST_SATURATED:.0f} % of it"
    return ""


def topic_names(window: Window) -> NDArray[np.str_]:
    """Return the name of the topic of each residual of a window."""
    return np.repeat([t.name for t in window.topics], [len(t.times) * len(t.components) for t in window.topics])
