"""Set-points of velocity and attitude for which an autopilot's inner loops produce the acceleration of a wrench."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from controller.quaternion import from_axis_angle, multiply, rotation_matrix
from cosim.companion.vehicle_state import ReportedState
from cosim.mavlink.vehicle.row_layout import quaternion_to_euler
from cosim.mavlink.wire.thrust_body import THRUST_BODY_SET, make_attitude_target
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

MAX_LAW_SPEED = 0.5  # m/s, of a law that steers by velocity: a velocity loop brakes later than thrusters
_MAX_VELOCITY, _MAX_YAW_RATE = 0.8, 0.6  # m/s, rad/s, of set-points
_OBSERVER_FREQUENCY = 1.5  # rad/s, natural frequency of the observer
_HOLD_FREQUENCY = 0.6  # rad/s, natural frequency of the critically damped position hold
_RATE_LAG, _ANGLE_LAG = 0.3, 0.3  # s, lags of an autopilot's rate loop and angle loop
_MAX_LEAD, _MAX_TILT = 0.35, 0.1  # rad, lead of set-points of angles; roll and pitch
_ANGLE_P, _RATE_P, _RATE_I = 6.0, 0.135, 0.09  # defaults of ATC_ANG_PIT_P [1/s], ATC_RAT_PIT_P [s], ATC_RAT_PIT_I
_MAX_LEAN = 0.5  # rad
_NORTH, _EAST, _DOWN = np.eye(3)
_VELOCITY_ONLY, _YAW_RATE_IGNORED = 0b010111000111, 1 << 11  # type_mask of positions and velocities
_RATES_IGNORED, _THRUST_IGNORED = 0b111, 1 << 6  # type_mask of attitudes
_LOCAL_NED = 1  # MAV_FRAME_LOCAL_NED


class TurnLead:
    """Convert a moment to a set-point of yaw rate or attitude."""

    # An angle loop around a rate loop commands the rate (set-point - angle) / lag, and accelerates by (commanded rate -
    # rate) / rate lag. So a set-point that leads the angle by lag (rate + rate lag a) gives the acceleration a.

    def __init__(self, vehicle: Vehicle) -> None:
        self._inertia: Array = np.diag(vehicle.inertia) + np.diag(vehicle.added_mass)[3:]

    def rates(self, wrench: Array, state: ReportedState) -> Array:
        """Return the set-point of body rates, shape (3,) [rad/s]; the present rate where a moment is not finite."""
        moment = np.where(np.isfinite(wrench[3:]), wrench[3:], 0.0)
        result: Array = state.rates + _RATE_LAG * moment / self._inertia
        return result

    def yaw_rate(self, wrench: Array, state: ReportedState) -> float:
        """Return the set-point of the yaw rate [rad/s], at most 0.6 rad/s."""
        return min(max(float(self.rates(wrench, state)[2]), -_MAX_YAW_RATE), _MAX_YAW_RATE)

    def attitude(self, wrench: Array, state: ReportedState) -> Array:
        """Return the set-point of the attitude, a quaternion (4,), within 0.35 rad of the present one."""
        # Roll and pitch are at most 0.1 rad: the autopilot levels the vehicle itself, and the law's moments against
        # weight, drag and eccentric thrusters do not mean a tilt.
        roll, pitch, yaw = np.clip(_ANGLE_LAG * self.rates(wrench, state), -_MAX_LEAD, _MAX_LEAD)
        now = quaternion_to_euler(state.quaternion.tolist())
        tilt = [
            min(max(angle + lead, -_MAX_TILT), _MAX_TILT) for angle, lead in zip(now[:2], (roll, pitch), strict=True)
        ]
        heading = from_axis_angle(_DOWN, now[2] + yaw)
        result: Array = multiply(heading, multiply(from_axis_angle(_EAST, tilt[1]), from_axis_angle(_NORTH, tilt[0])))
        return result


class LevelLead:
    """Convert the moments that tilt a vehicle to lean angles of an ArduSub's attitude loop."""

    # Surge and sway tilt a vehicle whose horizontal thrusters are eccentric, and so does Munk's moment. Both are known
    # before the tilt. The loop commands the rate P_a (lean - angle), and the thrusters u = P e + I integral(e) of its
    # error e. So a lean u/(P_a P), which washes out in P/I seconds, gives the command u while the angle is zero.
    #
    # The leans are feed-forward alone: they depend on neither angles nor rates, and not on a law's moments. A law's
    # attitude loop around the autopilot's, delayed by the link, would only take margin. A law that adapts its restoring
    # moments would even find the stiffness of the autopilot's loop in place of the vehicle's, and cancel it.

    def __init__(self, vehicle: Vehicle) -> None:
        self._added: Array = vehicle.added_mass[:3, :3]
        self._settled: Array = np.zeros(2)
        self.set_gains({})

    def moments(self, velocity: Array) -> Array:
        """Return the moments about roll and pitch, shape (2,) [N m], that cancel Munk's, v x (M_A v)."""
        # Units of arguments: velocity [m/s]
        speed = np.where(np.isfinite(velocity), velocity, 0.0)
        result: Array = np.cross(speed, self._added @ speed)[:2]
        return result

    def set_gains(self, parameters: Mapping[str, float]) -> None:
        """Set the gains of both axes to those of pitch in an ArduSub's parameters; missing ones are its defaults."""
        self._rate_p = parameters.get("ATC_RAT_PIT_P", 0.0) or _RATE_P
        self._gain = self._rate_p * (parameters.get("ATC_ANG_PIT_P", 0.0) or _ANGLE_P)
        self._washout = parameters.get("ATC_RAT_PIT_I", _RATE_I) / self._rate_p  # 1/s

    def restart(self) -> None:
        """Forget the integral, after another controller has steered."""
        self._settled[:] = 0.0

    def angles(self, command: Array, period: float) -> Array:
        """Return roll and pitch, shape (2,) [rad], of at most 0.5 rad; period [s]."""
        self._settled += min(1.0, period * self._washout) * (command - self._settled)
        angles: Array = np.clip((command - self._settled) / self._gain, -_MAX_LEAN, _MAX_LEAN)
        return angles


class VelocityLead:
    """Convert a wrench to a set-point of velocity; lag, vertical_lag [s]."""

    # A first-order loop accelerates by (set-point - v) / lag + d. So the set-point v + lag (a - d) gives the
    # acceleration a of the wrench, by mass, added mass and damping. A Luenberger observer estimates d, which includes
    # current, drag and the missing integral action of a loop, from set-points and measured velocities.

    def __init__(self, vehicle: Vehicle, lag: float, vertical_lag: float) -> None:
        self._mass: Array = vehicle.mass + np.diag(vehicle.added_mass)[:3]
        self._linear, self._quadratic = vehicle.linear_damping[:3], vehicle.quadratic_damping[:3]
        self._lag: Array = np.array([lag, lag, vertical_lag])
        self._last_set_point: Array | None = None  # last set-point [m/s, NED]
        self._expected: Array = np.zeros(3)  # velocity estimate of the observer [m/s, NED]
        self._disturbance: Array = np.zeros(3)  # d [m/s2]

    def restart(self) -> None:
        """Reset the observer, after another controller has steered."""
        self._last_set_point, self._disturbance = None, np.zeros(3)

    def velocity(self, wrench: Array, state: ReportedState, period: float) -> Array:
        """Return the velocity [m/s, NED], shape (3,), of at most 0.8 m/s; wrench (6,) [N, N m], period [s]."""
        speed = state.velocity_body[:3]
        force = np.where(np.isfinite(wrench[:3]), wrench[:3], 0.0)
        drag = (self._linear + self._quadratic * np.abs(speed)) * speed
        acceleration: Array = rotation_matrix(state.quaternion) @ ((force - drag) / self._mass)
        return self._set_point(acceleration, state, period)

    def hold(self, back: Array, speed_down: float, state: ReportedState, period: float) -> Array:
        """Return the velocity [m/s, NED], shape (3,), that holds a horizontal position during a descent."""
        # Units of arguments: back [m, NE]; speed_down [m/s]; period [s]
        # The observer makes up for a current.
        acceleration = np.zeros(3)
        acceleration[:2] = _HOLD_FREQUENCY**2 * back - 2.0 * _HOLD_FREQUENCY * state.velocity[:2]
        velocity = self._set_point(acceleration, state, period)
        velocity[2] = speed_down
        return velocity

    def _set_point(self, acceleration: Array, state: ReportedState, period: float) -> Array:
        """Return the velocity set-point [m/s, NED] that gives an acceleration [m/s2, NED]."""
        self._observe(state.velocity, period)
        velocity: Array = state.velocity + self._lag * (acceleration - self._disturbance)
        speed = float(np.linalg.norm(velocity))
        if not math.isfinite(speed):
            self.restart()
            return np.zeros(3)
        self._last_set_point = velocity * min(1.0, _MAX_VELOCITY / speed) if speed > 0.0 else velocity
        return self._last_set_point

    def _observe(self, velocity: Array, period: float) -> None:
        if self._last_set_point is None:
            self._expected = velocity.copy()
            return
        error = velocity - self._expected
        acceleration = (self._last_set_point - self._expected) / self._lag + self._disturbance
        self._expected = self._expected + period * (acceleration + 2.0 * _OBSERVER_FREQUENCY * error)
        limit = _MAX_VELOCITY / self._lag
        self._disturbance = np.clip(self._disturbance + period * _OBSERVER_FREQUENCY**2 * error, -limit, limit)


def make_velocity_target(mavlink: Any, system: int, velocity: Array, yaw_rate: float | None) -> Any:
    """Return SET_POSITION_TARGET_LOCAL_NED with a velocity [m/s, NED] and, unless None, a yaw rate [rad/s]."""
    x, y, z = velocity.tolist()
    mask = _VELOCITY_ONLY | (_YAW_RATE_IGNORED if yaw_rate is None else 0)
    zeros = (0.0,) * 3
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, system, 1, _LOCAL_NED, mask, *zeros, x, y, z, *zeros, 0.0, yaw_rate or 0.0
    )


def make_attitude_message(mavlink: Any, system: int, attitude: Array, force: Array | None) -> Any:
    """Return SET_ATTITUDE_TARGET; attitude (4,), force (3,) [-]."""
    mask = _RATES_IGNORED | (_THRUST_IGNORED if force is None else THRUST_BODY_SET)
    fields = 0, system, 1, mask, attitude.tolist(), 0.0, 0.0, 0.0, 0.0
    if force is None:
        return mavlink.MAVLink_set_attitude_target_message(*fields)
    ahead, right, down = force.tolist()
    return make_attitude_target(mavlink, *fields, thrust_body=(ahead, right, down))
