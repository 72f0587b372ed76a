"""A MAVLink link beside the lockstep: receives the autopilot's estimate, and sends the measurements of a DVL."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from controller.law import Diagnostic
from cosim.companion.vehicle_state import ReportedState
from cosim.errors import TelemetryError
from cosim.mavlink.vehicle.row_layout import quaternion_to_euler
from cosim.mavlink.wire.dialect import dialect, make_heartbeat, make_rate_requests
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.ground_end import GroundLink, Identity
from cosim.simulation.signals import Array
from cosim.sitl.motion import Motion

IDENTITY: Identity = (1, 197)  # MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY of the vehicle: no ground station
ESTIMATE = (
    *(Diagnostic(f"estimate.{a}", "m", "Position estimate of the autopilot, in its own frame") for a in "xyz"),
    *(Diagnostic(f"estimate.v{a}", "m/s", "Velocity estimate of the autopilot, NED") for a in "xyz"),
    *(Diagnostic(f"estimate.{a}", "rad", "Attitude estimate of the autopilot") for a in ("roll", "pitch", "yaw")),
    Diagnostic("mode", "", "Custom mode of the autopilot's heartbeat"),
    Diagnostic("armed", "", "Armed state of the autopilot"),
)

_RATES = {"HEARTBEAT": 5.0, "ATTITUDE_QUATERNION": 50.0, "LOCAL_POSITION_NED": 50.0}  # Hz
_RECEIVE_PERIOD = 0.005  # s of simulated time between two readings of the link
_REQUEST_PERIOD, _HEARTBEAT_PERIOD = 10.0, 1.0  # s of simulated time
_MICRO = 1e6


@dataclass(frozen=True)
class DvlOptions:
    """Rate, latency and dropout of the velocity over ground, sent as VISION_POSITION_DELTA."""

    rate: float = 8.0  # Hz
    latency: float = 0.1  # s, between the end of an interval and its message
    dropout: float = 0.0  # fraction of lost messages, 0 to 1
    seed: int = 1  # seed of the random losses


class Dvl:
    """Integrate the DVL's velocity and the gyro over each interval."""

    def __init__(self, options: DvlOptions) -> None:
        self._options = options
        self._random = np.random.default_rng(options.seed)
        self._rotation: Array = np.zeros(3)
        self._displacement: Array = np.zeros(3)
        self._start = self._last = math.nan
        self._due: deque[tuple[float, Any]] = deque()

    def integrate(self, motion: Motion) -> list[Any]:
        """Integrate the motion; return the deltas due now: time and interval [us], rotation [rad], displacement [m]."""
        now = motion.time
        if not self._last <= now:
            self._start = self._last = now
        self._rotation += (now - self._last) * np.array(motion.gyro)
        self._displacement += (now - self._last) * np.array(motion.dvl)
        self._last = now
        interval = now - self._start
        if interval >= 1.0 / self._options.rate - 1e-9:
            rotation, displacement = tuple(self._rotation.tolist()), tuple(self._displacement.tolist())
            if self._random.random() >= self._options.dropout:
                delta = round(now * _MICRO), round(interval * _MICRO), rotation, displacement
                self._due.append((now + self._options.latency, delta))
            self._rotation[:] = self._displacement[:] = 0.0
            self._start = now
        return [self._due.popleft()[1] for _ in range(sum(time <= now for time, _ in self._due))]


class SitlLink:
    """MAVLink link to the autopilot that flies the plant."""

    def __init__(self, endpoint: Endpoint, dvl: DvlOptions | None = None) -> None:
        if endpoint.kind == "tlog":
            raise TelemetryError(f"endpoint {endpoint.text!r}: expected a network or a serial device, not a file")
        self._time = 0.0  # s, simulated: the load of the machine changes neither connections nor requests
        self._link, self._mavlink = GroundLink(endpoint, identity=IDENTITY, clock=lambda: self._time), dialect()
        self._reported = ReportedState()
        self._dvl = None if dvl is None else Dvl(dvl)
        self.estimate: Array = np.full(len(ESTIMATE), math.nan)
        self._received_at = self._requested_at = self._heartbeat_at = -math.inf

    @property
    def is_armed(self) -> bool:
        """True if the autopilot was armed in its last heartbeat."""
        return self._reported.is_armed

    def close(self) -> None:
        """Close the link. May be called twice."""
        self._link.close()

    def exchange(self, motion: Motion) -> None:
        """Send the DVL's measurements at an instant, and receive messages at intervals."""
        m = self._mavlink
        if self._dvl is not None:
            for stamp, interval, rotation, displacement in self._dvl.integrate(motion):
                self._link.send(m.MAVLink_vision_position_delta_message(stamp, interval, rotation, displacement, 100.0))
        if 0.0 <= motion.time - self._received_at < _RECEIVE_PERIOD:
            return
        if motion.time < self._received_at:  # the autopilot has restarted
            self._requested_at = self._heartbeat_at = -math.inf
        self._received_at = self._time = now = motion.time
        reported = self._reported
        for received in self._link.receive(0.0):
            reported.receive(received.system, received.component, received.message, now)
        self._request_streams(now)
        self.estimate[:3], self.estimate[3:6] = reported.position, reported.velocity
        if math.isfinite(reported.age(now)):
            self.estimate[6:9] = quaternion_to_euler(reported.quaternion.tolist())
        self.estimate[9:] = reported.mode, reported.is_armed

    def _request_streams(self, now: float) -> None:
        m, system = self._mavlink, self._reported.system
        if now - self._heartbeat_at >= _HEARTBEAT_PERIOD:
            self._heartbeat_at = now
            self._link.send(make_heartbeat(m, m.MAV_TYPE_ONBOARD_CONTROLLER, m.MAV_STATE_ACTIVE))
        if system is not None and now - self._requested_at >= _REQUEST_PERIOD:
            self._requested_at = now
            for request in make_rate_requests(m, system, _RATES):
                self._link.send(request)
