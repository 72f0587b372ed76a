"""Select the sources, the clock and the time span of a log for a run."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from cosim.errors import ImportLogError
from cosim.logs.cleaning.clocks import VehicleClock
from cosim.logs.cleaning.topics import Topic, clean
from cosim.logs.quantities import COMMANDS, QUANTITIES
from cosim.logs.spool import LogContents, Source
from cosim.simulation.signals import Array

RATES = (5, 10, 20, 25, 50, 100, 200)  # Hz, default rates of rows
_MOTION = ("attitude", "position", "depth")  # quantities of which a log must have at least one
_SEA_LEVEL, _SPECIFIC = 101325.0, 9800.0  # Pa, Pa/m: ArduPilot's conversion of pressure to depth
# parameters of ArduPilot with the cutoff frequency [Hz] of the filter of a quantity
_FILTERS = {"rates": "INS_GYRO_FILTER", "gyro": "INS_GYRO_FILTER", "acceleration": "INS_ACCEL_FILTER"}
_PLAUSIBLE = (0.1, 1e4)  # Hz, rates of samples
_EDGE = 5.0  # s, duration at start and end below which rows with partly unknown motion are cut


def select_topics(contents: LogContents, scratch: Path) -> tuple[dict[str, Topic], VehicleClock]:
    """Select the best source of each quantity, and convert it to a topic."""
    clock = _vehicle_clock(contents)
    topics: dict[str, Topic] = {}
    for quantity in QUANTITIES:
        source = contents.best(quantity)
        for other in contents.sources.values():
            if other.quantity == quantity and other is not source and other.count:
                contents.unread[f"{other.name} ({quantity})"] += other.count
        if source is not None:
            topics[quantity] = clean(source, _undelayed(_filter_delay(contents, quantity), clock), None, scratch)
    _depth_of_pressure(contents, topics, clock, scratch)
    if not any(name in topics for name in _MOTION):
        what = ", ".join(f"{name} ({QUANTITIES[name].what})" for name in _MOTION)
        raise ImportLogError(f"says nothing of the motion, expected one of {what}")
    if not any(name in topics for name in COMMANDS):
        contents.remarks.append(
            "The log has no commands of thrusters: servo outputs, forces, a wrench or sticks. "
            "Nothing can be identified from it."
        )
    if contents.autopilot == "ardupilot" and not set(_FILTERS.values()) & set(contents.parameters):
        contents.remarks.append("The log has no INS_GYRO_FILTER: rates are as late as that filter made them.")
    for when in clock.restarts:
        contents.remarks.append(f"The vehicle's clock restarted {when - time_span(topics)[0]:.1f} s after the start")
    fastest = max(topics.values(), key=lambda topic: topic.rate)
    if not has_plausible_rate(fastest):
        raise ImportLogError(
            f"has {fastest.rate:.3g} samples of {fastest.quantity} per second, expected {_PLAUSIBLE[0]:g} to "
            f"{_PLAUSIBLE[1]:g}: check the unit of its times"
        )
    return topics, clock


def has_plausible_rate(topic: Topic) -> bool:
    """Return True for a rate that a quantity of a log may have."""
    return not topic.period or _PLAUSIBLE[0] <= topic.rate <= _PLAUSIBLE[1]


def _filter_delay(contents: LogContents, quantity: str) -> float:
    """Return the delay of a quantity by ArduPilot's second-order Butterworth filter at low frequencies [s]."""
    cutoff = contents.parameters.get(_FILTERS.get(quantity, ""), 0.0)  # Hz
    return math.sqrt(2.0) / (2.0 * math.pi * cutoff) if contents.autopilot == "ardupilot" and cutoff > 0.0 else 0.0


def _undelayed(delay: float, clock: VehicleClock) -> Callable[[Array, Array], Array]:
    """Return a function from stamps and times of writing [s] to times [s], corrected by a delay [s]."""
    return lambda stamps, written: clock.times(stamps, written) - delay


def time_span(topics: Mapping[str, Topic]) -> tuple[float, float]:
    """Return start and end [s] of the rows: all of the motion is known there, unless that cuts 5 s or more."""
    motion = [topics[name] for name in _MOTION if name in topics]
    starts, ends = [topic.start for topic in motion], [topic.end for topic in motion]
    start = max(starts) if max(starts) - min(starts) < _EDGE else min(starts)
    end = min(ends) if max(ends) - min(ends) < _EDGE else max(ends)
    return start, max(start, end)


def _vehicle_clock(contents: LogContents) -> VehicleClock:
    """Return the vehicle's clock, fitted to the stamps of the source with most samples."""
    clock = VehicleClock()
    stamped = [source for source in contents.sources.values() if next(_stamps(source), None) is not None]
    if stamped:  # others are of the same clock
        best = max(stamped, key=lambda source: source.count)
        for block in _stamps(best):
            for stamp, written in block.tolist():
                clock.put(stamp, written)
    return clock


def _stamps(source: Source) -> Iterator[Array]:
    """Yield stamps and times of writing of a source that has stamps."""
    for block in source.blocks():
        known = block[~np.isnan(block[:, 0]), :2]
        if not len(known):
            return
        yield known


def _depth_of_pressure(contents: LogContents, topics: dict[str, Topic], clock: VehicleClock, scratch: Path) -> None:
    """Convert pressure to depth as the autopilot does, if the log has no depth."""
    if "pressure" not in topics:
        return
    pressure = topics.pop("pressure")
    if "depth" in topics:
        contents.unread[f"{pressure.name} (pressure)"] += pressure.count
        return
    ground = contents.parameters.get("BARO2_GND_PRESS", contents.parameters.get("GND_ABS_PRESS2", math.nan))
    gravity = contents.parameters.get("BARO_SPEC_GRAV", contents.parameters.get("GND_SPEC_GRAV", 1.0))
    if not (math.isfinite(ground) and 0.0 < gravity < 10.0):
        ground, gravity = _SEA_LEVEL, 1.0
        contents.remarks.append("The log has no BARO2_GND_PRESS: depth is from 101325 Pa at the surface.")
    scale = _SPECIFIC * gravity
    source = contents.sources["pressure", pressure.name]

    topic = clean(source, clock.times, lambda pressures: (pressures - ground) / scale, scratch)
    topics["depth"] = dataclasses.replace(topic, quantity="depth")


def default_rate(topics: Mapping[str, Topic]) -> float:
    """Return the lowest rate [Hz] of `RATES` that no state or command exceeds."""
    fast = max((t.rate for t in topics.values() if QUANTITIES[t.quantity].kind in ("state", "command")), default=0.0)
    fast = fast or max(topic.rate for topic in topics.values())
    return float(next((rate for rate in RATES if rate >= 0.98 * fast), RATES[-1]))
