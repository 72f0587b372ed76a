"""How the law's wrench reaches an autopilot: as sticks, or as a velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from controller.quaternion import rotation_matrix
from cosim.companion.vehicle_state import ReportedState
from cosim.mavlink.vehicle.profile import Profile
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.commands.commands import Mode
from cosim.simulation.commands.stick_stabilizer import YAW_RATE
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

SteerBy = Literal["sticks", "wrench", "velocity"]
STEER_BY: tuple[SteerBy, ...] = get_args(SteerBy)
STEERED_IN: dict[SteerBy, Mode] = {"sticks": "stabilize", "wrench": "manual", "velocity": "reach"}

_FULL = 1000.0
_PITCH, _ROLL = 1, 2  # enabled_extensions
_VELOCITY_ONLY, _YAW_RATE_IGNORED = 0b010111000111, 1 << 11  # type_mask
_LOCAL_NED = 1
_MOSTLY = 0.6  # of the greatest part that a thruster has in an axis, from which on it works for that axis
_YAW_LAG = 0.3  # s, of an autopilot's rate loop
FASTEST = 0.5  # m/s, of the law that steers by velocity: a loop that it asks through brakes later than thrusters do
_FASTEST_ASKED, _FASTEST_TURN = 0.8, 0.6  # m/s, rad/s, that are asked for
_OBSERVED = 1.5  # rad/s, of both poles of the observer of what a velocity loop does beside its lag
_NEUTRAL: Array = np.zeros(6)


@dataclass(frozen=True)
class StickScale:
    """What full sticks give.

    Attributes
    ----------
    efforts : ndarray, shape (n, 6)
        Each thruster's part of its greatest force for a wrench along or about each body axis [1/N, 1/(N m)].
    mixer : ndarray, shape (n, 6)
        What a full stick of each axis, at a gain of 1, asks of each thruster: 1, 0 or -1 of its greatest force. Of an
        autopilot that allocates forces by itself, both are of axes instead of thrusters.
    gain : float
        The pilot's: what scales the sticks of surge, sway, heave and yaw.
    scales_all : bool
        Whether it scales those of roll and pitch, too.
    quadratic : bool
        Whether a thruster's force goes with the square of what the autopilot asks of it.
    yaw_inertia : float
        With the added one [kg m2].
    """

    efforts: Array
    mixer: Array
    gain: float
    scales_all: bool
    quadratic: bool
    yaw_inertia: float

    def sticks(self, wrench: Array) -> Array:
        """Return the sticks that ask for a wrench, shape (6,), X Y Z K M N from -1 to 1.

        An autopilot adds what all sticks ask of a thruster, and where its force goes with the square, it goes with the
        square of that sum. So each thruster's force is turned into what it is to be asked for, and that into sticks.

        Parameters
        ----------
        wrench : ndarray, shape (6,)
            [N, N m], body frame; what is not finite asks for nothing.
        """
        share = self.efforts @ np.where(np.isfinite(wrench), wrench, 0.0)
        if self.quadratic:
            share = np.copysign(np.sqrt(np.abs(share)), share)
        asked = np.linalg.lstsq(self.mixer, share, rcond=None)[0]
        asked[[0, 1, 2, 5]] /= self.gain
        if self.scales_all:
            asked[3:5] /= self.gain
        clipped: Array = np.clip(asked, -1.0, 1.0)
        return clipped

    def yaw_rate_stick(self, moment: float, rate: float) -> float:
        """Return the yaw stick by which an autopilot that keeps a rate of turn does what a moment would.

        Parameters
        ----------
        moment : float
            About the body's vertical axis [N m].
        rate : float
            Of turn now [rad/s].
        """
        asked = rate + _YAW_LAG * moment / self.yaw_inertia
        return min(max(asked / (self.gain * YAW_RATE), -1.0), 1.0) if math.isfinite(asked) else 0.0


def scale_of(vehicle: Vehicle, profile: Profile, gain: float) -> StickScale:
    """Return what full sticks give of a vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        Its thrusters' limits count, and as ArduSub the curve of its table ``autopilot``.
    profile : Profile
        Which autopilot it is.
    gain : float
        The pilot's, above 0 to 1.
    """
    reach = greatest_wrench(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)
    table = vehicle.autopilot
    quadratic = profile.name == "ardusub" and table is not None and table.curve == "quadratic"
    yaw_inertia = float(vehicle.inertia[2, 2] + vehicle.added_mass[5, 5])
    if profile.name != "ardusub":  # it brings each axis to the thrusters by itself
        share = np.diag(np.divide(1.0, reach, out=np.zeros(6), where=reach > 0.0))
        return StickScale(share, np.eye(6), gain, True, quadratic, yaw_inertia)
    matrix = vehicle.thruster_matrix
    mixer = np.where(np.abs(matrix) > _MOSTLY * np.abs(matrix).max(axis=1, keepdims=True), np.sign(matrix), 0.0).T
    most = 0.5 * (vehicle.thrust_max - vehicle.thrust_min)
    made = (matrix * most) @ mixer  # by full sticks, one axis a column, with what comes along in others
    return StickScale(mixer @ np.linalg.pinv(made), mixer, gain, False, quadratic, yaw_inertia)


def manual_control(mavlink: Any, system: int, profile: Profile, sticks: Array, all_axes: bool) -> Any:
    """Return MANUAL_CONTROL; roll and pitch are in it where `all_axes` are steered."""
    surge, sway, heave, roll, pitch, yaw = sticks.tolist()
    center = profile.centred_stick
    x, y, r = (round(_FULL * part) for part in (surge, sway, yaw))
    z = round(center - (_FULL - center) * heave)
    message = mavlink.MAVLink_manual_control_message(system, x, y, z, r, 0)
    if all_axes:
        message.enabled_extensions = _PITCH | _ROLL
        full = profile.full_tilt_stick
        message.s, message.t = round(full * pitch), round(full * roll)
    return message


def neutral(mavlink: Any, system: int, profile: Profile) -> Any:
    """Return MANUAL_CONTROL with all sticks at rest."""
    return manual_control(mavlink, system, profile, _NEUTRAL, all_axes=False)


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
        self._yaw_inertia = float(vehicle.inertia[2, 2] + vehicle.added_mass[5, 5])
        self._asked: Array | None = None  # last [m/s, NED]
        self._expected: Array = np.zeros(3)  # velocity as the observer has it
        self._beside: Array = np.zeros(3)  # d [m/s2]

    def restart(self) -> None:
        """Forget what the loop does: something else steers."""
        self._asked, self._beside = None, np.zeros(3)

    def yaw_rate(self, wrench: Array, state: ReportedState) -> float:
        """Return the rate of yaw [rad/s], of at most 0.6 rad/s, by which a rate loop turns as the wrench would."""
        asked = float(state.rates[2]) + _YAW_LAG * float(wrench[5]) / self._yaw_inertia
        return min(max(asked, -_FASTEST_TURN), _FASTEST_TURN) if math.isfinite(asked) else 0.0

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
