"""The autopilot's heading estimate: detection of its leaps, and the dive during which an ArduSub aligns it."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable

import numpy as np

from controller.quaternion import multiply
from cosim.companion.vehicle_state import ReportedState, rotate
from cosim.simulation.signals import Array

log = logging.getLogger(__name__)

_MAX_GAP = 0.2  # s, between two attitudes; over longer ones their rates do not predict the turn
_ALIGNED = "in-flight", "yaw alignment complete"  # parts of ArduSub's STATUSTEXT after an alignment
_GAIN, _MAX_SPEED = 0.5, 0.25  # 1/s, gain from remaining depth to speed; m/s, maximum speed of the dive
_DEPTH_TOLERANCE, _SPEED_TOLERANCE = 0.05, 0.05  # m, m/s, below which the vehicle has reached the depth
_MIN_DIVE_TIME = 6.0  # s, from arming to the earliest end of the dive
_SETTLING_TIME = 1.0  # s, from the last alignment to the earliest end of the dive
_DIVE_TIMEOUT = 3.0  # s, to wait at the depth for the text, or for the descent to begin
_MIN_CLEARANCE, _SPACING = 0.3, 0.1  # m, required on the path down; m, between the points where it is computed


class HeadingWatch:
    """Finds leaps of the reported heading: turns about the vertical that the reported rates do not explain."""

    def __init__(self) -> None:
        self.leap = 0.0  # maximum leap since the last `restart` [rad]
        self._before: tuple[float, Array, Array] | None = None

    def restart(self) -> None:
        """Forget past leaps."""
        self.leap = 0.0

    def update(self, state: ReportedState) -> None:
        """Compare the last reported attitude with the one before; nothing changes without a new one."""
        time, before = state.attitude_boot, self._before
        if not math.isfinite(time) or (before is not None and time == before[0]):
            return
        self._before = time, state.quaternion.copy(), state.rates.copy()
        if before is None or not 0.0 < time - before[0] <= _MAX_GAP:
            return
        expected = rotate(before[1], 0.5 * (time - before[0]) * (before[2] + state.rates))
        e0, _, _, e3 = multiply(state.quaternion, expected * (1.0, -1.0, -1.0, -1.0)).tolist()
        self.leap = max(self.leap, abs(2.0 * math.atan(e3 / e0)) if e0 else math.pi)


class LevelDive:
    """The dive of an ArduSub that has just been armed; depth [m]."""

    # Once it is 0.5 m deeper than where it was armed, an ArduSub aligns its heading with each sample of its
    # magnetometer, until 5 s after arming. If it moves or tilts during the last alignment, its heading is off by some
    # degrees from then on. So it first dives level, slowly and on the spot, until no alignment follows. A vehicle that
    # was armed before its first message does not dive.

    def __init__(self, depth: float) -> None:
        self._depth = depth
        # returns the minimum clearance of hard regions [m] at a position in the autopilot's local frame
        self.clearance: Callable[[Array], float] | None = None
        self.outside = 0.0  # violation of hard regions now, less that at the start of the dive [m]; 0 or more
        self._was_disarmed = False
        self._armed_depth: float | None = None  # m, depth at arming
        self._armed_at = self._aligned_at = math.inf  # our time [s] of arming, and of the last alignment
        self._begun: tuple[float, float] | None = None  # start of the dive: our time [s]; clearance then [m]
        self._start: Array = np.zeros(2)  # m, NE, horizontal position at the start of the dive
        self._arrived_at: float | None = None
        self._is_done = False
        self._texts_read = 0  # number of the autopilot's texts that were processed

    def update(self, state: ReportedState, now: float) -> None:
        """Update the progress of the dive from the reported state; `now` is our time [s]."""
        texts, self._texts_read = state.texts[self._texts_read :], len(state.texts)
        if not state.is_armed:
            self._was_disarmed = state.system is not None
            self._armed_depth = self._begun = self._arrived_at = None
            self._is_done, self._aligned_at = False, math.inf
        elif self._armed_depth is None and self._was_disarmed and math.isfinite(state.position[2]):
            self._armed_depth, self._armed_at = float(state.position[2]), now
        if self._armed_depth is None:
            return
        is_near = self._depth_left(state) < _DEPTH_TOLERANCE and abs(state.velocity[2]) < _SPEED_TOLERANCE
        if self._arrived_at is None and is_near:
            self._arrived_at = now
        if any(all(part in text for part in _ALIGNED) for text in texts):
            self._aligned_at = now
        if self._arrived_at is not None and now - self._armed_at > _MIN_DIVE_TIME:
            is_settled = now - self._aligned_at > _SETTLING_TIME  # False where there was no alignment
            self._is_done |= is_settled or (math.isinf(self._aligned_at) and now - self._arrived_at > _DIVE_TIMEOUT)

    def is_needed(self, state: ReportedState, now: float) -> bool:
        """Return True while the vehicle must dive. Warn, and skip the dive, if hard regions are too near."""
        if self._depth <= 0.0 or self._armed_depth is None or self._is_done:
            return False
        if self._begun is None:
            here = math.inf if self.clearance is None else self.clearance(state.position)
            if not self._is_path_clear(state, min(here, _MIN_CLEARANCE)):
                text = "no dive: a hard region is too near within %g m below; the heading may be off"
                log.warning(text, self._depth_left(state))
                self._is_done = True
                return False
            self._begun, self._start = (now, here), state.position[:2].copy()
        if self.clearance is not None:
            self.outside = max(0.0, min(0.0, self._begun[1]) - self.clearance(state.position))
        return True

    def time_diving(self, now: float) -> float:
        """Return the time since the dive began [s]; 0 while there is none."""
        return 0.0 if self._begun is None or self._is_done else now - self._begun[0]

    def is_stuck(self, state: ReportedState, now: float) -> bool:
        """Return True if the vehicle is less than 5 cm deeper after 3 s: the mode does not follow the stick."""
        return self.time_diving(now) > _DIVE_TIMEOUT and self._depth_left(state) > self._depth - _DEPTH_TOLERANCE

    def speed_down(self, state: ReportedState) -> float:
        """Return the downward speed to command now [m/s]; 0 for a vehicle that is too deep."""
        return min(max(_GAIN * self._depth_left(state), 0.0), _MAX_SPEED)

    def vector_back(self, state: ReportedState) -> Array:
        """Return the horizontal vector from the vehicle to where the dive began, shape (2,) [m, NE]."""
        return self._start - state.position[:2]

    def _depth_left(self, state: ReportedState) -> float:
        assert self._armed_depth is not None
        return self._armed_depth + self._depth - float(state.position[2])

    def _is_path_clear(self, state: ReportedState, min_clearance: float) -> bool:
        if self.clearance is None:
            return True
        depths = np.arange(0.0, max(0.0, self._depth_left(state)) + _SPACING, _SPACING)
        points = [state.position + np.array([0.0, 0.0, down]) for down in depths.tolist()]
        return all(self.clearance(point) >= min_clearance for point in points)
