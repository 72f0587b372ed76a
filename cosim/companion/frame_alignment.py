"""Offset of the autopilot's local frame in the scene. Nothing is steered before it is known."""

# An EKF has its origin where the vehicle was when the filter set it, not at the scene's origin.

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from cosim.companion.vehicle_state import ReportedState
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.scenario.region_tables import Vector3
from cosim.simulation.signals import Array

_SAMPLES = 10  # consecutive samples of the offset that must agree before it is known
_SPREAD = 0.15  # m, maximum standard deviation of each coordinate among them
_GRAVITY = 9.80665  # m/s2
_MIN_JUMP = 0.3  # m, change between two positions that the velocity does not explain, above which it is a jump
_SMOOTHING = 0.1  # weight of a new sample in the exponential mean of the drift


@dataclass(frozen=True)
class SceneOrigin:
    """The user's definition of the scene's origin.

    Give either the latitude and longitude of the scene's origin, and the offset is computed from the vehicle's
    GLOBAL_POSITION_INT and pressure; or the surveyed position of the autopilot's local origin in the scene.

    Examples
    --------
    >>> import cosim
    >>> cosim.SceneOrigin(surveyed=(0.9, -1.6, 1.9)).density
    1000.0
    """

    geodetic: tuple[float, float] | None = None  # deg, latitude and longitude of the scene's origin
    surveyed: Vector3 | None = None  # m, NED, position of the autopilot's local origin in the scene
    surface_pressure: float = 1013.25  # hPa, air pressure at the surface
    density: float = 1000.0  # kg/m3, density of the water; ArduSub's is 1000 times BARO_SPEC_GRAV, by default 1


class FrameAlignment:
    """Estimates the offset between the autopilot's local frame and the scene, and monitors it for jumps and drift."""

    def __init__(self, origin: SceneOrigin) -> None:
        self._origin = origin
        self._frame = None if origin.geodetic is None else LocalFrame(*origin.geodetic)
        self._samples: deque[Array] = deque(maxlen=_SAMPLES)
        # position of the autopilot's local origin in the scene [m, NED]; None until it is known
        self.offset: Array | None = None if origin.surveyed is None else np.array(origin.surveyed, dtype=float)
        # maximum jump of the position since the frame is known [m], without the motion that the velocity explains
        self.jump = self.reckoned = 0.0
        self._reference: Array | None = None  # first mean offset, which later samples are compared with
        self._drift: Array = np.zeros(3)
        self._processed = 0, 0  # counts of the processed messages: local position, second source
        self._before: tuple[Array, Array, float, int] | None = None

    def update(self, state: ReportedState, now: float) -> None:
        """Update the alignment from the messages received since the last call; `now` is our time [s]."""
        if not np.isfinite(state.position).all():
            return
        counts, before = state.message_counts, self._processed
        # the pressure is that of SCALED_PRESSURE2 once one was received
        pressure = counts["SCALED_PRESSURE2"] or counts["SCALED_PRESSURE"]
        second = counts["GLOBAL_POSITION_INT"] if self._frame is not None else pressure
        self._processed = counts["LOCAL_POSITION_NED"] + counts["ODOMETRY"], second
        if self.offset is not None and self._processed[0] != before[0]:
            self._check_jump(state, now)
        sample = self._sample(state) if self._processed[1] != before[1] else None
        if sample is None:
            return
        if self._reference is None:
            self._samples.append(sample)
            agree = self.offset is not None or np.max(np.std(self._samples, axis=0)) < _SPREAD
            if len(self._samples) == _SAMPLES and agree:
                self._reference = np.mean(self._samples, axis=0)
                self.offset = self._reference if self.offset is None else self.offset
        else:
            error = np.where(np.isfinite(sample), sample - self._reference, 0.0)
            self._drift += _SMOOTHING * (error - self._drift)

    @property
    def drift(self) -> float:
        """Smoothed change of the offset by global position and pressure since it was first known [m]."""
        return float(np.linalg.norm(self._drift))

    def to_scene(self, position: Array) -> Array:
        """Return a position of the autopilot's local frame in the scene's [m, NED]; NaN before that is known."""
        result: Array = position + self.offset if self.offset is not None else np.full(3, math.nan)
        return result

    def missing(self, state: ReportedState) -> str:
        """Return the missing inputs of the alignment as text; empty once the frame is known."""
        if self.offset is not None:
            return ""
        if self._frame is None:
            return "the scene's origin: give --scene-origin or --surveyed-origin"
        if not np.isfinite(state.position).all():
            return "LOCAL_POSITION_NED"
        if state.global_position is None:
            return (
                "GLOBAL_POSITION_INT: the autopilot has no global position; give --global-origin, or survey its origin"
            )
        if math.isnan(state.pressure):
            return "SCALED_PRESSURE or SCALED_PRESSURE2"
        return f"{_SAMPLES} global positions that agree within {_SPREAD:g} m with the local ones"

    def restart(self) -> None:
        """Estimate the frame again from the vehicle's messages; a surveyed frame stays, with its jumps and drift."""
        if self._origin.surveyed is not None:
            return
        self.offset = self._reference = None
        self._samples.clear()
        self.jump, self.reckoned, self._drift, self._before = 0.0, 0.0, np.zeros(3), None

    def _sample(self, state: ReportedState) -> Array | None:
        """Return the offset by the second sources, global position and pressure, shape (3,) [m, NED]."""
        # A surveyed frame needs its depth alone; north and east are NaN without a global position. None if a needed
        # coordinate is missing.
        depth = (state.pressure - self._origin.surface_pressure) * 100.0 / (self._origin.density * _GRAVITY)
        north = east = math.nan
        if self._frame is not None and state.global_position is not None:
            north, east, _ = self._frame.to_local(*state.global_position[:2], 0.0)
        sample: Array = np.array([north, east, depth]) - state.position
        required = sample[2:] if self._origin.surveyed is not None else sample
        return sample if np.isfinite(required).all() else None

    def _check_jump(self, state: ReportedState, now: float) -> None:
        before = self._before
        self._before = state.position.copy(), state.velocity.copy(), now, state.resets
        if before is None:
            return
        position, velocity, time, resets = before
        expected = 0.5 * (velocity + state.velocity) * (now - time)
        self.reckoned += float(np.linalg.norm((state.position - position)[:2])) if state.is_reckoned else 0.0
        jump = float(np.linalg.norm(state.position - position - np.nan_to_num(expected)))
        if jump > _MIN_JUMP or resets != state.resets:
            self.jump = max(self.jump, jump)
