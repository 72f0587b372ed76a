"""Set-points of velocity and attitude: what an autopilot's inner loops are to be asked for to do as a wrench would."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from controller.quaternion import from_axis_angle, multiply, rotation_matrix
from cosim.companion.vehicle_state import ReportedState
from cosim.mavlink.vehicle.layout import euler_of
from cosim.mavlink.wire.thrust_body import THRUST_BODY_SET, with_thrust_body
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

FASTEST = 0.5  # m/s, of the law that steers by velocity: a loop that it asks through brakes later than thrusters do
_FASTEST_ASKED, _FASTEST_TURN = 0.8, 0.6  # m/s, rad/s, that are asked for
_OBSERVED = 1.5  # rad/s, of both poles of the observer of what a velocity loop does beside its lag
_RATE_LAG, _ANGLE_LAG = 0.3, 0.3  # s, of an autopilot's loops of rate and angle
_FARTHEST, _TILT = 0.35, 0.1  # rad, by which angles that are asked for lead the present ones; greatest roll and pitch
_NORTH, _EAST, _DOWN = np.eye(3)
_VELOCITY_ONLY, _YAW_RATE_IGNORED = 0b010111000111, 1 << 11  # type_mask of positions and velocities
_RATES_IGNORED, _THRUST_IGNORED = 0b111, 1 << 6  # of attitudes
_LOCAL_NED = 1


class TurnLead:
    """Turns a moment into the rate of yaw, or the attitude, that an autopilot is to be asked for.

    An angle loop around a rate loop asks for the rate (asked - angle) / lag, and accelerates by (rate asked - rate) /
    rate lag. So an angle that leads by lag (rate + rate lag a) asks for the acceleration a of the moment.

    Parameters
    ----------
    vehicle : Vehicle
        Whose inertia, with the added one, counts.
    """

    def __init__(self, vehicle: Vehicle) -> None:
        self._inertia: Array = np.diag(vehicle.inertia) + np.diag(vehicle.added_mass)[3:]

    def rates(self, wrench: Array, state: ReportedState) -> Array:
        """Return body rates, shape (3,) [rad/s], to be asked for; the present ones where a moment is not finite."""
        moment = np.where(np.isfinite(wrench[3:]), wrench[3:], 0.0)
        result: Array = state.rates + _RATE_LAG * moment / self._inertia
        return result

    def yaw_rate(self, wrench: Array, state: ReportedState) -> float:
        """Return the rate of yaw [rad/s], of at most 0.6 rad/s."""
        return min(max(float(self.rates(wrench, state)[2]), -_FASTEST_TURN), _FASTEST_TURN)

    def attitude(self, wrench: Array, state: ReportedState) -> Array:
        """Return the attitude as a quaternion, shape (4,), at most 0.35 rad from the present one in each angle.

        Roll and pitch are at most 0.1 rad: the autopilot rights the vehicle by itself, and what the law's moments do
        against weight, drag and thrusters beside the center is none of a tilt that is asked for.
        """
        roll, pitch, yaw = np.clip(_ANGLE_LAG * self.rates(wrench, state), -_FARTHEST, _FARTHEST)
        now = euler_of(state.quaternion.tolist())
        asked = [min(max(angle + lead, -_TILT), _TILT) for angle, lead in zip(now[:2], (roll, pitch), strict=True)]
        heading = from_axis_angle(_DOWN, now[2] + yaw)
        result: Array = multiply(heading, multiply(from_axis_angle(_EAST, asked[1]), from_axis_angle(_NORTH, asked[0])))
        return result


class VelocityLead:
    """Turns a wrench into the velocity that an inner loop is to be asked for.

    A first-order loop accelerates by (asked - v) / lag + d. So v + lag (a - d) asks for the acceleration a that the
    wrench would give the vehicle, by its mass, added mass and damping. A Luenberger observer finds d, of which current,
    drag and a loop without integral action are parts, from what was asked for and what the velocity did.

    Parameters
    ----------
    vehicle : Vehicle
        Whose model counts.
    lag, vertical_lag : float
        Of the autopilot's velocity loop [s], horizontally and vertically.
    """

    def __init__(self, vehicle: Vehicle, lag: float, vertical_lag: float) -> None:
        self._mass: Array = vehicle.mass + np.diag(vehicle.added_mass)[:3]
        self._linear, self._quadratic = vehicle.linear_damping[:3], vehicle.quadratic_damping[:3]
        self._lag: Array = np.array([lag, lag, vertical_lag])
        self._asked: Array | None = None  # last [m/s, NED]
        self._expected: Array = np.zeros(3)  # velocity as the observer has it
        self._beside: Array = np.zeros(3)  # d [m/s2]

    def restart(self) -> None:
        """Forget what the loop does: something else steers."""
        self._asked, self._beside = None, np.zeros(3)

    def velocity(self, wrench: Array, state: ReportedState, period: float) -> Array:
        """Return the velocity [m/s, NED], shape (3,), of at most 0.8 m/s.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            [N, N m], body frame; what is not finite asks for nothing.
        state : ReportedState
            Of the vehicle now.
        period : float
            Since the last call [s].
        """
        speed = state.velocity_body[:3]
        force = np.where(np.isfinite(wrench[:3]), wrench[:3], 0.0)
        drag = (self._linear + self._quadratic * np.abs(speed)) * speed
        wanted = rotation_matrix(state.quaternion) @ ((force - drag) / self._mass)
        self._observe(state.velocity, period)
        asked: Array = state.velocity + self._lag * (wanted - self._beside)
        length = float(np.linalg.norm(asked))
        if not math.isfinite(length):
            self.restart()
            return np.zeros(3)
        self._asked = asked * min(1.0, _FASTEST_ASKED / length) if length > 0.0 else asked
        return self._asked

    def _observe(self, velocity: Array, period: float) -> None:
        if self._asked is None:
            self._expected = velocity.copy()
            return
        error = velocity - self._expected
        acceleration = (self._asked - self._expected) / self._lag + self._beside
        self._expected = self._expected + period * (acceleration + 2.0 * _OBSERVED * error)
        most = _FASTEST_ASKED / self._lag
        self._beside = np.clip(self._beside + period * _OBSERVED**2 * error, -most, most)


def velocity_target(mavlink: Any, system: int, velocity: Array, yaw_rate: float | None) -> Any:
    """Return SET_POSITION_TARGET_LOCAL_NED with a velocity [m/s, NED] and a rate of yaw [rad/s], if there is one."""
    x, y, z = velocity.tolist()
    mask = _VELOCITY_ONLY | (_YAW_RATE_IGNORED if yaw_rate is None else 0)
    zeros = (0.0,) * 3
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, system, 1, _LOCAL_NED, mask, *zeros, x, y, z, *zeros, 0.0, yaw_rate or 0.0
    )


def attitude_target(mavlink: Any, system: int, attitude: Array, force: Array | None) -> Any:
    """Return SET_ATTITUDE_TARGET.

    Parameters
    ----------
    mavlink : module
        The dialect.
    system : int
        System id of the autopilot.
    attitude : ndarray, shape (4,)
        Quaternion from body to world, scalar first.
    force : ndarray, shape (3,), optional
        Fractions of the greatest force along each body axis [-], for PX4; None: the sticks command the force.
    """
    mask = _RATES_IGNORED | (_THRUST_IGNORED if force is None else THRUST_BODY_SET)
    fields = 0, system, 1, mask, attitude.tolist(), 0.0, 0.0, 0.0, 0.0
    if force is None:
        return mavlink.MAVLink_set_attitude_target_message(*fields)
    ahead, right, down = force.tolist()
    return with_thrust_body(mavlink, *fields, thrust_body=(ahead, right, down))
