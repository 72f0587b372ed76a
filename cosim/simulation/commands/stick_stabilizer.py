"""Stabilized manual control, as ArduSub's STABILIZE and ALT_HOLD: attitude, heading and optionally depth are kept."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from controller import VehicleState
from controller.quaternion import error, from_axis_angle, multiply, rotation_matrix
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

_CENTERED = 0.02  # fraction of full stick below which it counts as released
GREATEST_TILT = math.radians(30.0)  # rad, desired roll or pitch at full stick
# rad/s of a full stick at a pilot gain of 1, as ArduSub has it: 45 deg/s by ACRO_YAW_P of 4.5
YAW_RATE = math.radians(202.5)
CLIMB_RATE = 0.3  # m/s, vertical speed at full stick
_FARTHEST = math.radians(20.0), 0.3  # rad, m: bounds by which desired heading and depth may lead the vehicle's
_ATTITUDE, _DEPTH = 5.0, 1.5  # rad/s, frequencies of both loops; an ArduSub's loop of angles has 6 1/s
_INTEGRAL = 0.3  # 1/s, gain of the depth's integral
_NORTH, _EAST, _DOWN = np.eye(3)


class StickStabilizer:
    """Computes a wrench from sticks: surge and sway command forces, the others angles and rates; period [s]."""

    # It knows the vehicle's mass and inertia, with added mass, like a tuned autopilot, but no damping and no current.

    def __init__(self, vehicle: Vehicle, state: VehicleState, period: float, reach: Array) -> None:
        self._inertia: Final[Array] = np.diag(vehicle.inertia) + np.diag(vehicle.added_mass)[3:]
        self._mass: Final = float(vehicle.mass + vehicle.added_mass[2, 2])
        self._state, self._period, self._reach = state, period, reach
        self.begin()

    def begin(self) -> None:
        """Keep the present heading and depth from now on, and no other attitude."""
        self.attitude: Array | None = None  # quaternion that is kept in place of the sticks' attitude
        self._heading, self._depth = self._yaw(), float(self._state.position[2])
        self.target_depth: float | None = None  # m, to which the kept depth moves at the rate of a full stick
        self._integral = 0.0  # N, integral part of the force down

    def wrench(self, sticks: Array, gain: float, keep_depth: bool, rate_down: float | None = None) -> Array:
        """Return the wrench of a control period; sticks (6,), rate_down [m/s], returns (6,) [N, N m]."""
        if math.isnan(self._heading):  # there was no measurement when it was set
            self._heading = self._yaw()
        if math.isnan(self._depth):
            self._depth = float(self._state.position[2])
        wrench: Array = gain * sticks * self._reach
        wrench[3:] = self._moment(sticks, gain)
        if keep_depth or rate_down is not None:
            wrench[2] = 0.0
            stick = float(sticks[2])
            asked = stick * CLIMB_RATE if abs(stick) > _CENTERED else 0.0
            R = rotation_matrix(self._state.quaternion)
            wrench[:3] += R.T @ (self._heave(asked if rate_down is None else rate_down, R) * _DOWN)
        result: Array = np.clip(np.where(np.isfinite(wrench), wrench, 0.0), -self._reach, self._reach)
        return result

    def _moment(self, sticks: Array, gain: float) -> Array:
        rate, turn, target = np.zeros(3), float(sticks[5]), self.attitude
        if target is None:
            if abs(turn) > _CENTERED:
                rate[2] = gain * turn * YAW_RATE
                ahead = math.remainder(self._heading + rate[2] * self._period - self._yaw(), math.tau)
                self._heading = self._yaw() + min(max(ahead, -_FARTHEST[0]), _FARTHEST[0])
            tilt = multiply(
                from_axis_angle(_EAST, float(sticks[4]) * GREATEST_TILT),
                from_axis_angle(_NORTH, float(sticks[3]) * GREATEST_TILT),
            )
            target = multiply(from_axis_angle(_DOWN, self._heading), tilt)
        else:
            self._heading = self._yaw()  # kept once the attitude is free again
        angle = 2.0 * error(target, self._state.quaternion)[1:]
        moment: Array = -self._inertia * _ATTITUDE * (_ATTITUDE * angle + 2.0 * (self._state.velocity_body[3:] - rate))
        return moment

    def _heave(self, rate: float, R: Array) -> float:
        """Return the force down [N], world axes, for a rate of the depth [m/s]."""
        depth = float(self._state.position[2])
        if rate:
            self.target_depth = None
        elif self.target_depth is not None:
            rate = min(max((self.target_depth - self._depth) / self._period, -CLIMB_RATE), CLIMB_RATE)
        if rate:
            ahead = self._depth + rate * self._period - depth
            self._depth = depth + min(max(ahead, -_FARTHEST[1]), _FARTHEST[1])
        error_down = self._depth - depth
        force = self._mass * _DEPTH * _DEPTH * error_down
        max_heave = float(self._reach[2])
        if math.isfinite(force):
            self._integral = min(max(self._integral + _INTEGRAL * force * self._period, -max_heave), max_heave)
        speed = float(R[2] @ self._state.velocity_body[:3])
        return force + self._mass * _DEPTH * 2.0 * (rate - speed) + self._integral

    def _yaw(self) -> float:
        e0, e1, e2, e3 = self._state.quaternion
        return math.atan2(2.0 * (e0 * e3 + e1 * e2), 1.0 - 2.0 * (e2 * e2 + e3 * e3))
