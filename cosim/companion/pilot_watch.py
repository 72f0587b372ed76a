"""Sticks of a pilot: in messages of other stations, and on any wiring in the channels that an ArduSub reports."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

import numpy as np

from cosim.companion.vehicle_state import ReportedState
from cosim.mavlink.vehicle.ardusub_sticks import CENTER
from cosim.mavlink.vehicle.profile import find_profile
from cosim.mavlink.wire.manual_control import decode_sticks
from cosim.simulation.signals import Array

_DEFLECTED = 0.05  # of a full stick, above which it counts
_TOLERANCE = 25.0  # us, difference of a channel's pulse above which it counts
_AXES, _UNUSED = 6, 0xFFFF  # channels of sticks; value of an unused one, as 0
_ARDUPILOT = 3  # MAV_AUTOPILOT; others report the channels of a radio alone
_WINDOW = 1.5  # s, time in which our sticks appear in the reported channels
_REST_WINDOW = 5.0  # s, time before our first sticks in which channels show their rest


class PilotWatch:
    """Finds deflected sticks that are not the companion's."""

    def __init__(self, identity: tuple[int, int]) -> None:
        self._identity = identity
        self.seen_at = -math.inf  # our time [s] of the last ones
        self._sent: deque[tuple[float, Array]] = deque()  # our times [s] and pulses [us] of our sticks
        self._before: deque[tuple[float, Array]] = deque()  # as reported before our first sticks
        self._rest: Array = np.full(_AXES, CENTER)  # us, of these the nearest to the center: those of a radio, or none

    def record_sent(self, pulses: Array, now: float) -> None:
        """Store the pulses [us] of channels 1 to 6, shape (6,), that our sticks command at our time `now` [s]."""
        if not self._sent and self._before:
            reported = np.array([pulses for _, pulses in self._before])
            self._rest = reported[np.abs(reported - CENTER).argmin(axis=0), np.arange(_AXES)]
        self._sent.append((now, pulses))
        while len(self._sent) > 1 and now - self._sent[1][0] > _WINDOW:  # the one before it still acts at its start
            self._sent.popleft()

    def receive(self, system: int, component: int, message: Any, reported: ReportedState, now: float) -> None:
        """Process a message that arrived at our time `now` [s]."""
        match message.get_type():
            case "MANUAL_CONTROL":
                target, is_deflected = message.target, _is_deflected(message, reported.autopilot)
            case "RC_CHANNELS_OVERRIDE":
                is_deflected = bool((np.abs(_pulses(message) - CENTER) > _TOLERANCE).any())
                target = message.target_system
            case "RC_CHANNELS" if (system, component, reported.autopilot) == (reported.system, 1, _ARDUPILOT):
                target, is_deflected = 0, self._has_foreign(_pulses(message), now)
            case _:
                return
        if is_deflected and target in (0, reported.system) and (system, component) != self._identity:
            self.seen_at = now

    def _has_foreign(self, pulses: Array, now: float) -> bool:
        """Return True if a channel is off its rest and outside the range of our recent sticks."""
        if not self._sent:
            self._before.append((now, pulses))
            while now - self._before[0][0] > _REST_WINDOW:
                self._before.popleft()
            return False
        ours = np.array([np.full(_AXES, CENTER), *(pulses for _, pulses in self._sent)])
        outside = np.maximum(ours.min(axis=0) - pulses, pulses - ours.max(axis=0))
        return bool(((outside > _TOLERANCE) & (np.abs(pulses - self._rest) > _TOLERANCE)).any())


def _pulses(message: Any) -> Array:
    """Return the pulses of channels 1 to 6, shape (6,) [us]; the center for unused ones."""
    pulses = np.array([getattr(message, f"chan{i}_raw") for i in range(1, _AXES + 1)], dtype=float)
    return np.where((pulses > 0.0) & (pulses < _UNUSED), pulses, CENTER)


def _is_deflected(message: Any, autopilot: int) -> bool:
    """Return True if a stick of MANUAL_CONTROL is deflected from its rest position."""
    profile = find_profile(autopilot)
    sticks = decode_sticks(message, profile.centered_stick, profile.full_tilt_stick)
    return any(abs(stick) > _DEFLECTED for stick in sticks)
