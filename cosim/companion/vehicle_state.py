"""The state that an autopilot reports: the newest value of each quantity, and its age."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np

from controller.quaternion import from_axis_angle, multiply, rotation_matrix
from cosim.companion.clock_sync import ClockSync
from cosim.mavlink.wire.options import ProfileName
from cosim.simulation.signals import Array

_RATES = {  # Hz, requested rates of messages
    "HEARTBEAT": 5.0,  # mode and arming; a PX4 refuses, and sends one per second
    "CURRENT_MODE": 10.0,
    "ATTITUDE_QUATERNION": 50.0,
    "LOCAL_POSITION_NED": 50.0,
    "GLOBAL_POSITION_INT": 5.0,
    "SERVO_OUTPUT_RAW": 10.0,
    "RC_CHANNELS": 43.0,  # in step with our sticks at 50 Hz, it could always miss a pilot's between two of ours
    "SYS_STATUS": 2.0,
    "SCALED_PRESSURE": 10.0,
    "SCALED_PRESSURE2": 10.0,
    "DISTANCE_SENSOR": 5.0,
    "EKF_STATUS_REPORT": 2.0,
    "ESTIMATOR_STATUS": 2.0,
}
# messages of some autopilots: another one may answer a request for them with a text on every station
_SENDERS: dict[str, tuple[ProfileName, ...]] = {
    "CURRENT_MODE": ("px4", "generic"), "RC_CHANNELS": ("ardusub",), "EKF_STATUS_REPORT": ("ardusub", "generic"),
    "ESTIMATOR_STATUS": ("px4", "generic"),
}  # fmt: skip
_ARMED, _CRITICAL = 128, 5  # bit of HEARTBEAT.base_mode; MAV_STATE_CRITICAL: from it on a failsafe is active
_LOCAL_NED, _BODY_FRD = 1, 12  # MAV_FRAME
_RELATIVE, _ABSOLUTE = 8, 16  # estimator flags: horizontal position is relative, absolute
_DOWNWARDS = 25  # MAV_SENSOR_ROTATION_PITCH_270
_MAX_PREDICTION = 0.1  # s, of the state over its age
_RANGE_TIMEOUT = 2.0  # s, after which the range of a silent distance sensor is forgotten
_MILLI, _MICRO = 1e-3, 1e-6


class ReportedState:
    """The state of one autopilot, as its messages report it. Nothing is estimated here."""

    def __init__(self, vehicle_system: int | None = None) -> None:
        self._vehicle_system = vehicle_system  # None: the first autopilot that is heard
        self.system: int | None = None
        self.autopilot = 0
        # position [m] and velocity [m/s], NED, in the autopilot's own local frame
        self.position: Array = np.full(3, math.nan)
        self.velocity: Array = np.full(3, math.nan)  # m/s
        # attitude from body to world, scalar first; body rates [rad/s]
        self.quaternion: Array = np.array([1.0, 0.0, 0.0, 0.0])
        self.rates: Array = np.zeros(3)
        self.mode, self.is_armed, self.in_failsafe = -1, False, False
        # latitude and longitude [deg] and altitude above home [m]
        self.global_position: tuple[float, float, float] | None = None
        # absolute pressure [hPa], of the second sensor if there is one; NaN if none is reported
        self.pressure = self.battery = self.pilot_gain = math.nan
        self.ranges: dict[int, float] = {}  # m, of distance sensors, by MAV_SENSOR_ROTATION
        self._ranged_at: dict[int, float] = {}  # our times [s] of their last messages
        self.pulses: tuple[int, ...] = ()
        self.is_leaking = self.is_reckoned = self._is_absolute = False
        self.has_origin = False  # True once the autopilot has a global origin
        self.resets = 0  # ODOMETRY.reset_counter of the autopilot's estimate
        self.received_at = -math.inf  # our time [s] of the autopilot's last processed message
        self.message_counts: Counter[str] = Counter()  # counts of received messages, by name
        self.results: dict[int, int] = {}  # last MAV_RESULT of each command, by MAV_CMD number
        self.texts: list[str] = []
        self.sync = ClockSync()
        self._position_boot = self._global_boot = self.attitude_boot = math.nan
        self._position_at = self._attitude_at = -math.inf  # our time [s]
        self._second = False  # True if SCALED_PRESSURE2 is received: the sensor outside the hull

    def receive(self, system: int, component: int, message: Any, now: float) -> None:
        """Process a message that arrived at our time `now` [s]."""
        name = message.get_type()
        if self.system is None and name == "HEARTBEAT" and component == 1 and message.autopilot != 8:
            self.system = system if self._vehicle_system in (None, system) else None
        handler = getattr(self, f"_receive_{name.lower()}", None)
        if system != self.system or component != 1 or handler is None:
            return
        self.received_at = now
        self.message_counts[name] += 1
        handler(message, now)
        for rotation in self.ranges.keys() & {r for r, at in self._ranged_at.items() if now - at > _RANGE_TIMEOUT}:
            del self.ranges[rotation]

    def age(self, now: float) -> float:
        """Return the age of the older one of position and attitude [s]; infinite before both were received."""
        # It is computed from the autopilot's time stamps if the clocks are aligned, and is at least the time since
        # reception.
        ages = []
        for boot, received in ((self._position_boot, self._position_at), (self.attitude_boot, self._attitude_at)):
            stamped = now - (boot + self.sync.offset)
            ages.append(max(now - received, stamped if math.isfinite(stamped) else 0.0))
        return max(ages)

    @property
    def altitude(self) -> float:
        """Range downwards [m]; NaN if none is reported."""
        return self.ranges.get(_DOWNWARDS, math.nan)

    @property
    def updates(self) -> int:
        """Count of positions and attitudes so far."""
        return sum(self.message_counts[name] for name in ("LOCAL_POSITION_NED", "ATTITUDE_QUATERNION", "ODOMETRY"))

    def predict(self, now: float) -> tuple[Array, Array]:
        """Return position, shape (3,) [m, NED, local frame], and quaternion, shape (4,), predicted over their age."""
        # Velocity and rates are assumed constant, for at most 0.1 s.
        lead = min(self.age(now), _MAX_PREDICTION)
        if not math.isfinite(lead):
            return self.position.copy(), self.quaternion.copy()
        return self.position + lead * self.velocity, rotate(self.quaternion, lead * self.rates)

    @property
    def velocity_body(self) -> Array:
        """Linear and angular velocity, shape (6,) [m/s, rad/s], body frame."""
        linear: Array = rotation_matrix(self.quaternion).T @ self.velocity
        return np.concatenate([linear, self.rates])

    # ---- handlers of messages, by their names ----

    def _receive_heartbeat(self, m: Any, now: float) -> None:
        self.autopilot, self.mode = m.autopilot, m.custom_mode
        self.is_armed, self.in_failsafe = bool(m.base_mode & _ARMED), m.system_status >= _CRITICAL

    def _receive_current_mode(self, m: Any, now: float) -> None:
        self.mode = m.custom_mode

    def _receive_local_position_ned(self, m: Any, now: float) -> None:
        self._set_position((m.x, m.y, m.z), (m.vx, m.vy, m.vz), m.time_boot_ms * _MILLI, now)

    def _set_position(self, position: Any, velocity: Any, boot: float, now: float) -> None:
        self.position[:], self.velocity[:] = position, velocity
        self._position_boot, self._position_at = boot, now

    def _receive_attitude_quaternion(self, m: Any, now: float) -> None:
        rates = m.rollspeed, m.pitchspeed, m.yawspeed
        self._set_attitude((m.q1, m.q2, m.q3, m.q4), rates, m.time_boot_ms * _MILLI, now)

    def _set_attitude(self, quaternion: Any, rates: Any, boot: float, now: float) -> None:
        length = math.hypot(*quaternion)
        if length > 0.0:
            self.quaternion[:], self.rates[:] = np.divide(quaternion, length), rates
            self.attitude_boot, self._attitude_at = boot, now

    def _receive_odometry(self, m: Any, now: float) -> None:
        if (m.frame_id, m.child_frame_id) != (_LOCAL_NED, _BODY_FRD):
            return
        boot = m.time_usec * _MICRO
        self._set_attitude(m.q, (m.rollspeed, m.pitchspeed, m.yawspeed), boot, now)
        self._set_position((m.x, m.y, m.z), rotation_matrix(self.quaternion) @ (m.vx, m.vy, m.vz), boot, now)
        self.resets = m.reset_counter

    def _receive_global_position_int(self, m: Any, now: float) -> None:
        boot = m.time_boot_ms * _MILLI
        if boot < self._global_boot:  # it has restarted, and may have lost its origin
            self.global_position, self.has_origin = None, False
        self._global_boot = boot
        if m.lat or m.lon or self._is_absolute:  # an ArduSub without a position sends zeros
            self.global_position, self.has_origin = (m.lat * 1e-7, m.lon * 1e-7, m.relative_alt * _MILLI), True

    def _receive_gps_global_origin(self, m: Any, now: float) -> None:
        self.has_origin = True

    def _receive_scaled_pressure(self, m: Any, now: float) -> None:
        if not self._second:
            self.pressure = m.press_abs

    def _receive_scaled_pressure2(self, m: Any, now: float) -> None:
        self._second, self.pressure = True, m.press_abs

    def _receive_distance_sensor(self, m: Any, now: float) -> None:
        self.ranges.pop(m.orientation, None)
        self._ranged_at[m.orientation] = now
        if m.min_distance <= m.current_distance <= m.max_distance:
            self.ranges[m.orientation] = m.current_distance * 0.01

    def _receive_servo_output_raw(self, m: Any, now: float) -> None:
        if m.port == 0:
            self.pulses = tuple(getattr(m, f"servo{i}_raw") for i in range(1, 17))

    def _receive_sys_status(self, m: Any, now: float) -> None:
        self.battery = float(m.battery_remaining) if m.battery_remaining >= 0 else math.nan

    def _receive_named_value_float(self, m: Any, now: float) -> None:
        if m.name == "PilotGain":
            self.pilot_gain = m.value

    def _receive_ekf_status_report(self, m: Any, now: float) -> None:
        self._is_absolute = bool(m.flags & _ABSOLUTE)
        self.is_reckoned = bool(m.flags & _RELATIVE) and not self._is_absolute

    _receive_estimator_status = _receive_ekf_status_report

    def _receive_statustext(self, m: Any, now: float) -> None:
        self.texts.append(m.text)
        self.is_leaking |= "leak detected" in m.text.lower()

    def _receive_command_ack(self, m: Any, now: float) -> None:
        self.results[m.command] = m.result

    def _receive_timesync(self, m: Any, now: float) -> None:
        self.sync.add_answer(m.tc1, m.ts1, now)


def requested_rates(profile: ProfileName) -> dict[str, float]:
    """Return the rates [Hz] of the messages to request from an autopilot, by name."""
    return {name: rate for name, rate in _RATES.items() if profile in _SENDERS.get(name, (profile,))}


def rotate(quaternion: Array, rotation: Array) -> Array:
    """Rotate an attitude by a rotation vector [rad, body frame]."""
    angle = float(np.linalg.norm(rotation))
    return multiply(quaternion, from_axis_angle(rotation / angle, angle)) if angle > 0.0 else quaternion.copy()
