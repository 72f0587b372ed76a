"""The heading of an autopilot's estimate: its leaps, and the dive on which an ArduSub aligns it."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable

import numpy as np

from controller.quaternion import from_axis_angle, multiply
from cosim.companion.vehicle_state import ReportedState
from cosim.simulation.signals import Array

log = logging.getLogger(__name__)

_GAP = 0.2  # s, between two attitudes, beyond which their rates do not explain the turn
_ALIGNED = "yaw alignment complete"  # of an ArduSub's text, with "in-flight" before it
_IN_WATER = "in-flight"
_RATE, _FASTEST = 0.5, 0.25  # 1/s of what is left of the way; m/s, greatest speed of the dive
_NEAR, _STILL = 0.05, 0.05  # m, m/s, at which the vehicle has arrived
_FLYING, _QUIET = 6.0, 1.0  # s, since arming and since the last alignment, after which none follows
_PATIENCE = 3.0  # s at the depth without the text, or above it without a way down
_ROOM, _STRIDE = 0.3, 0.1  # m, least clearance on the way down; between two places where it is computed


class HeadingWatch:
    """Finds leaps of the reported heading: turns about the vertical that the reported rates do not explain.

    Attributes
    ----------
    leap : float
        Greatest leap [rad] since the last `restart`.
    """

    def __init__(self) -> None:
        self.leap = 0.0
        self._before: tuple[float, Array, Array] | None = None

    def restart(self) -> None:
        """Forget past leaps."""
        self.leap = 0.0

    def update(self, state: ReportedState) -> None:
        """Take the attitude that was reported last; one that was taken before changes nothing."""
        at, before = state.attitude_boot, self._before
        if not math.isfinite(at) or (before is not None and at == before[0]):
            return
        self._before = at, state.quaternion.copy(), state.rates.copy()
        if before is None or not 0.0 < at - before[0] <= _GAP:
            return
        turned = 0.5 * (at - before[0]) * (before[2] + state.rates)
        angle = float(np.linalg.norm(turned))
        expected = multiply(before[1], from_axis_angle(turned / angle, angle)) if angle > 0.0 else before[1]
        e0, _, _, e3 = multiply(state.quaternion, expected * (1.0, -1.0, -1.0, -1.0)).tolist()
        self.leap = max(self.leap, abs(2.0 * math.atan(e3 / e0)) if e0 else math.pi)


class LevelDive:
    """The dive of an ArduSub that has just been armed.

    An ArduSub aligns its heading anew with each sample of its magnetometer, from 0.5 m below where it was armed, until
    it takes itself for flying, 5 s after arming. Where it moves or tilts with the last one, the heading is off by some
    degrees from then on. So it first dives, level and slowly, where it stands, and waits for the end of that. A vehicle
    that was armed before it was first heard is left alone.

    Parameters
    ----------
    depth : float
        Of the dive [m], below where it was armed; 0 for none.

    Attributes
    ----------
    clearance : callable, optional
        Returns the least clearance of hard regions [m] at a position of the autopilot's local frame.
    outside : float
        By which hard regions are violated now, beyond what they were where the dive began [m].
    """

    def __init__(self, depth: float) -> None:
        self._depth = depth
        self.clearance: Callable[[Array], float] | None = None
        self.outside = 0.0
        self._was_disarmed = False
        self._armed_at: float | None = None  # m, down
        self._since = self._aligned = math.inf  # our time [s] of arming, and of the last alignment
        self._begun: tuple[float, float] | None = None  # our time [s]; clearance there [m]
        self._arrived: float | None = None
        self._is_done = False
        self._texts = 0  # of the autopilot, that were read

    def update(self, state: ReportedState, now: float) -> None:
        """Take what the autopilot reports."""
        texts, self._texts = state.texts[self._texts :], len(state.texts)
        if not state.is_armed:
            self._was_disarmed = state.system is not None
            self._armed_at = self._begun = self._arrived = None
            self._is_done, self._aligned = False, math.inf
        elif self._armed_at is None and self._was_disarmed and math.isfinite(state.position[2]):
            self._armed_at, self._since = float(state.position[2]), now
        if self._armed_at is None:
            return
        is_near = self._left(state) < _NEAR and abs(state.velocity[2]) < _STILL
        if self._arrived is None and is_near:
            self._arrived = now
        if any(_IN_WATER in text and _ALIGNED in text for text in texts):
            self._aligned = now
        if self._arrived is not None and now - self._since > _FLYING:
            quiet = now - self._aligned > _QUIET  # False where there was no alignment
            self._is_done |= quiet or (math.isinf(self._aligned) and now - self._arrived > _PATIENCE)

    def is_needed(self, state: ReportedState, now: float) -> bool:
        """Return True while the vehicle is to dive; a dive without room is left out, with a warning."""
        if self._depth <= 0.0 or self._armed_at is None or self._is_done:
            return False
        if self._begun is None:
            here = math.inf if self.clearance is None else self.clearance(state.position)
            if not self._has_room(state, min(here, _ROOM)):
                log.warning("no room to dive by %g m: the heading is not aligned before steering", self._left(state))
                self._is_done = True
                return False
            self._begun = now, here
        if self.clearance is not None:
            self.outside = max(0.0, min(0.0, self._begun[1]) - self.clearance(state.position))
        return True

    def seconds(self, now: float) -> float:
        """Return for how long it dives [s]; 0 where it does not."""
        return 0.0 if self._begun is None or self._is_done else now - self._begun[0]

    def is_stuck(self, state: ReportedState, now: float) -> bool:
        """Return True if it has not come down by 5 cm in 3 s: the autopilot's mode does not follow the stick."""
        return self.seconds(now) > _PATIENCE and self._left(state) > self._depth - _NEAR

    def speed(self, state: ReportedState) -> float:
        """Return the speed down to be asked for now [m/s]; one that is too deep already stays there."""
        return min(max(_RATE * self._left(state), 0.0), _FASTEST)

    def _left(self, state: ReportedState) -> float:
        assert self._armed_at is not None
        return self._armed_at + self._depth - float(state.position[2])

    def _has_room(self, state: ReportedState, least: float) -> bool:
        if self.clearance is None:
            return True
        way = np.arange(0.0, max(0.0, self._left(state)) + _STRIDE, _STRIDE)
        return all(self.clearance(state.position + np.array([0.0, 0.0, down])) >= least for down in way.tolist())
