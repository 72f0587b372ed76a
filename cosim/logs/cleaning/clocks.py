"""The clocks of a log: jumps of the writer's clock, and the alignment of the vehicle's clock with it."""

from __future__ import annotations

import math

import numpy as np

from cosim.logs.cleaning.sample_times import is_shuffled
from cosim.simulation.signals import Array

_MAX_STEP_BACK = 1.0  # s; a step back by more is a jump, not a message out of order
_MAX_AHEAD = 3600.0  # s; a step ahead by more is a jump, not a pause
_PAUSE = 1.0  # s, assumed duration of a jump
_WINDOW = 60.0  # s of the vehicle's clock, in which only the message of smallest delay is used
_PART = 2**14  # readings that are converted at once
_MAX_LISTED = 12  # jumps that are listed
_MAX_DRIFT = 5e-4  # relative drift above which a fit is discarded


class Clock:
    """Convert readings of a clock that jumps to rising times; each jump becomes a pause of one second."""

    # A reading that no other one confirms is no jump but damage. Of a bag whose topics are stored one after the other,
    # each topic has readings that rise.

    def __init__(self) -> None:
        self.jumps: list[tuple[float, float]] = []  # converted time [s] and size [s] of each jump
        self._shift, self._last, self._unconfirmed = 0.0, math.nan, math.nan
        self._last_of: dict[str, float] = {}  # s, last time of each topic

    def time(self, reading: float, topic: str = "") -> float:
        """Return the time [s] of a clock reading [s], NaN for NaN and the first one of a jump, in the log's order."""
        if not math.isfinite(reading):
            return math.nan
        if not -_MAX_STEP_BACK <= reading + self._shift - self._last_of.get(topic, reading + self._shift) <= _MAX_AHEAD:
            if not -_MAX_STEP_BACK <= reading - self._unconfirmed <= _MAX_AHEAD:
                self._unconfirmed = reading
                return math.nan
            step = self._unconfirmed + self._shift - self._last
            self._shift += _PAUSE - step
            self.jumps.append((self._unconfirmed + self._shift, step))
        time = reading + self._shift
        self._last = time if math.isnan(self._last) else max(time, self._last)
        self._last_of[topic] = max(time, self._last_of.get(topic, time))
        return time

    def times(self, readings: Array) -> Array:
        """Return the times [s] of clock readings [s], shape (n,); those of readings out of order are as they are."""
        if is_shuffled(readings[np.isfinite(readings)]):
            return readings
        times = np.empty(len(readings))
        for first in range(0, len(readings), _PART):  # lists of numbers take four times the memory
            part = slice(first, first + _PART)
            times[part] = [self.time(reading) for reading in readings[part].tolist()]
        return times

    def remarks(self, name: str) -> list[str]:
        """Return a sentence for each jump of a clock with a name."""
        if len(self.jumps) > _MAX_LISTED:
            return [f"{name} jumps {len(self.jumps)} times: each is taken as a pause of 1 s."]
        return [f"{name} jumps by {step:+.4g} s: it is taken as a pause of 1 s." for _, step in self.jumps]

    def is_behind(self, reading: float) -> bool:
        """Return True if a reading [s] would be taken for a jump back."""
        return reading + self._shift < self._last - _MAX_STEP_BACK


class VehicleClock:
    """Convert stamps of the vehicle's own clock to the clock of the log's writer."""

    # A message is late, never early: in each minute, the message of smallest delay gives the offset of the clocks. A
    # line through these gives the drift. A stamp that steps back is a restart of the vehicle.

    def __init__(self) -> None:
        self._last = -math.inf
        self.restarts: list[float] = []  # times of restarts on the writer's clock [s]
        # before the first restart and after each: stamp and offset [s] of the message of smallest delay, by minute
        self._offsets: list[dict[int, tuple[float, float]]] = [{}]
        self._lines: list[tuple[float, float]] | None = None

    def put(self, stamp: float, written: float) -> None:
        """Add a stamp [s] and its time of writing [s], in the order of the log."""
        if stamp < self._last - _MAX_STEP_BACK:
            self.restarts.append(written)
            self._offsets.append({})
            self._last = stamp
        self._last = max(self._last, stamp)
        minutes, minute = self._offsets[-1], int(stamp // _WINDOW)
        offset = written - stamp
        if minute not in minutes or offset < minutes[minute][1]:
            minutes[minute] = (stamp, offset)

    def times(self, stamps: Array, written: Array) -> Array:
        """Return times [s] on the writer's clock, shape (n,), of stamps [s]; for NaN, the time of writing."""
        if self._lines is None:
            self._lines = [_line(minutes) for minutes in self._offsets]
        lines = np.array(self._lines)
        drift, offset = lines[np.searchsorted(self.restarts, written, "right")].T
        return np.where(np.isnan(stamps), written, stamps * (1.0 + drift) + offset)

    def summary(self) -> str:
        """Return a sentence about the alignment of the clocks; empty without stamps."""
        if not any(self._offsets):
            return ""
        drift = _line(self._offsets[0])[0]
        drifts = f", drift {drift * 1e6:+.0f} ppm" if drift else ""
        return f"the vehicle's clock is put on that of the log's writer by its fastest message of each minute{drifts}"


def _line(minutes: dict[int, tuple[float, float]]) -> tuple[float, float]:
    """Return drift and offset [s] of a clock from the smallest offset of each minute."""
    if not minutes:
        return 0.0, 0.0
    stamps, offsets = np.array(sorted(minutes.values())).T
    if len(stamps) >= 3:
        drift, _ = np.polyfit(stamps - stamps.mean(), offsets, 1)
        if abs(drift) < _MAX_DRIFT:
            return float(drift), float((offsets - drift * stamps).min())
    return 0.0, float(offsets.min())
