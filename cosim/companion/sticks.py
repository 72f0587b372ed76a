"""Stick inputs: their relation to the wrench, and the messages that carry them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from cosim.companion.companion_options import SticksBy
from cosim.mavlink.vehicle.ardusub_sticks import (
    CLIMB_DEAD_ZONE,
    LEAN_DEAD_ZONE,
    MAX_LEAN,
    YAW_DEAD_ZONE,
    MotorMixer,
    channel_pulses,
    invert_dead_zone,
)
from cosim.mavlink.vehicle.profile import Profile
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.commands.stick_stabilizer import YAW_RATE
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

PILOT_SPEED = 0.5  # m/s, depth rate of a full vertical stick in ALT_HOLD, if PILOT_SPEED_UP is not known
_FULL_YAW = math.radians(45.0)  # rad/s, yaw rate of a full stick at ACRO_YAW_P 1
_CENTI = 0.01  # m per cm, deg per hundredth of a degree
_FULL = 1000.0  # value of a full stick in MANUAL_CONTROL
_NEWTON_STEPS, _MIN_COMMAND = 3, 0.05  # minimum command of a thruster at which its force is linearized
_BISECTIONS = 8  # bisections of the fraction of the force that leaves room for the whole moments
_PITCH, _ROLL = 1, 2  # bits of MANUAL_CONTROL.enabled_extensions
_AXES = 6  # number of channels
_RELEASED, _LEFT_ALONE = 0, 0xFFFF  # values that release a channel, and leave it unchanged


@dataclass(frozen=True)
class StickScale:
    """Relation between sticks and wrench of a vehicle."""

    # (n, 6) Fraction of each thruster's maximum force, for a unit wrench along or about each body axis [1/N, 1/(N
    # m)]
    efforts: Array
    forces: Array  # (6, n) Wrench of each thruster's maximum force [N, N m], body frame
    # (n, 6) Command of each thruster, 1, 0 or -1, by a full stick of each axis at a gain of 1. For an autopilot that
    # allocates forces itself, both have a row for each axis in place of each thruster
    mixer: Array
    gain: float  # gain of the sticks of surge, sway, heave and yaw: the pilot gain; 1 for overridden channels
    scales_all: bool  # true if the gain applies to roll and pitch as well
    quadratic: bool  # true if a thruster's force is proportional to the square of its command
    dead_zones: float  # factor of the dead zones of rate sticks: the pilot gain; 0 without dead zones
    yaw_rate: float = YAW_RATE  # rates of full sticks: yaw [rad/s]; up, down [m/s]
    climb_rates: tuple[float, float] = (PILOT_SPEED, PILOT_SPEED)  # rates of full sticks: yaw [rad/s]; up, down [m/s]
    max_lean: float = MAX_LEAN  # angle of a full stick of roll or pitch [rad]
    throttle_gain: float = 1.0  # gain of the stick of heave beside the pilot gain

    def sticks(self, wrench: Array) -> Array:
        """Return the sticks that command a wrench, shape (6,), X Y Z K M N from -1 to 1; wrench (6,) [N, N m]."""
        # An autopilot adds the commands of all sticks to a thruster; a quadratic force is that of the sum. So each
        # thruster's force is converted to its command, and the commands to sticks. Where a thruster or a stick
        # saturates, surge, sway and heave are scaled down by one factor until the moments are whole: an ArduSub scales
        # forces and moments down together, and the vehicle would tilt.
        wrench = np.where(np.isfinite(wrench), wrench, 0.0)
        sticks = self._unlimited_sticks(wrench)
        if self.quadratic and self._is_saturated(sticks):
            low, high = 0.0, 1.0
            for _ in range(_BISECTIONS):
                middle = 0.5 * (low + high)
                sticks = self._unlimited_sticks(np.concatenate([middle * wrench[:3], wrench[3:]]))
                low, high = (low, middle) if self._is_saturated(sticks) else (middle, high)
            sticks = self._unlimited_sticks(np.concatenate([low * wrench[:3], wrench[3:]]))
        clipped: Array = np.clip(sticks / self._gains, -1.0, 1.0)
        return clipped

    def _unlimited_sticks(self, wrench: Array) -> Array:
        """Return the sticks times their gain, shape (6,), that command a wrench without limits."""
        # Fit the thrusters' commands by least squares; for quadratic forces, correct the wrench by Newton's method.
        efforts = self.efforts @ wrench
        if not self.quadratic:
            linear: Array = self._mixer_inverse @ efforts
            return linear
        result: Array = self._mixer_inverse @ np.copysign(np.sqrt(np.abs(efforts)), efforts)
        for _ in range(_NEWTON_STEPS):
            command = self.mixer @ result
            size = np.abs(command)
            slope = (self.forces * (2.0 * np.maximum(size, _MIN_COMMAND))) @ self.mixer
            residual = wrench - self.forces @ (command * size)
            result += np.linalg.lstsq(slope, residual, rcond=None)[0]
        return result

    def _is_saturated(self, sticks: Array) -> bool:
        """Return True if sticks times their gain exceed a thruster's or a stick's limit."""
        return bool(np.abs(self.mixer @ sticks).max() > 1.0 or np.abs(sticks / self._gains).max() > 1.0)

    @cached_property
    def _mixer_inverse(self) -> Array:
        return np.asarray(np.linalg.pinv(self.mixer), dtype=np.float64)

    @cached_property
    def _gains(self) -> Array:
        tilt = self.gain if self.scales_all else 1.0
        return np.array([self.gain, self.gain, self.gain * self.throttle_gain, tilt, tilt, self.gain])

    def pulses(self, sticks: Array) -> Array:
        """Return the pulses of channels 1 to 6 that sticks of X Y Z K M N command, shape (6,) [us]."""
        return np.array(channel_pulses((self._gains * sticks).tolist()), dtype=np.float64)

    def yaw_rate_stick(self, rate: float) -> float:
        """Return the yaw stick that commands a yaw rate [rad/s]; 0 for one that is not finite."""
        return self._rate_stick(rate / self.yaw_rate, YAW_DEAD_ZONE)

    def climb_stick(self, rate_down: float) -> float:
        """Return the heave stick that commands a depth rate [m/s]; 0 for one that is not finite."""
        return self._rate_stick(rate_down / self.climb_rates[rate_down > 0.0], CLIMB_DEAD_ZONE, self.throttle_gain)

    def with_rates(self, parameters: Mapping[str, float]) -> StickScale:
        """Return this scale with the rates and angles of an ArduSub's parameters, without missing ones and 0."""
        degrees = parameters.get("ATC_ANGLE_MAX", 0.0) or _CENTI * parameters.get("ANGLE_MAX", 0.0)
        yaw, up = parameters.get("ACRO_YAW_P", 0.0), abs(parameters.get("PILOT_SPEED_UP", 0.0))
        down = abs(parameters.get("PILOT_SPEED_DN", 0.0)) or up
        climb = _CENTI * up or self.climb_rates[0], _CENTI * down or self.climb_rates[1]
        return replace(
            self, yaw_rate=_FULL_YAW * yaw or self.yaw_rate, climb_rates=climb,
            max_lean=math.radians(degrees) or self.max_lean,
            throttle_gain=parameters.get("JS_THR_GAIN", 0.0) or 1.0,
        )  # fmt: skip

    def lean_sticks(self, angles: Array) -> Array:
        """Return the sticks of roll and pitch, shape (2,), that command these angles [rad] in STABILIZE."""
        return np.array(
            [invert_dead_zone(min(max(angle / self.max_lean, -1.0), 1.0), LEAN_DEAD_ZONE) for angle in angles.tolist()]
        )

    def _rate_stick(self, part: float, dead_zone: float, gain: float = 1.0) -> float:
        if not math.isfinite(part):
            return 0.0
        deflection = invert_dead_zone(part, dead_zone * self.dead_zones)
        return min(max(deflection / (gain * self.gain), -1.0), 1.0)


def make_stick_scale(vehicle: Vehicle, profile: Profile, pilot_gain: float, sticks_by: SticksBy) -> StickScale:
    """Return the scale of the sticks of a vehicle."""
    gain = pilot_gain if sticks_by == "manual-control" else 1.0
    max_wrench = greatest_wrench(vehicle)
    if profile.name != "ardusub":  # the autopilot allocates the axes to the thrusters itself
        efforts = np.diag(np.divide(1.0, max_wrench, out=np.zeros(6), where=max_wrench > 0.0))
        return StickScale(efforts, np.diag(max_wrench), np.eye(6), gain, True, False, 0.0)
    mixer = MotorMixer(vehicle)
    forces = vehicle.thruster_matrix * mixer.max_forces
    efforts = mixer.commands @ np.linalg.pinv(forces @ mixer.commands)
    return StickScale(efforts, forces, mixer.commands, gain, False, mixer.is_quadratic, pilot_gain)


def make_manual_control(mavlink: Any, system: int, profile: Profile, sticks: Array, all_axes: bool) -> Any:
    """Return MANUAL_CONTROL; with `all_axes` it includes roll and pitch."""
    surge, sway, heave, roll, pitch, yaw = sticks.tolist()
    center = profile.centered_stick
    x, y, r = (round(_FULL * part) for part in (surge, sway, yaw))
    z = round(center - (_FULL - center) * heave)
    message = mavlink.MAVLink_manual_control_message(system, x, y, z, r, 0)
    if all_axes:
        message.enabled_extensions = _PITCH | _ROLL
        full = profile.full_tilt_stick
        message.s, message.t = round(full * pitch), round(full * roll)
    return message


def override_channels(mavlink: Any, system: int, sticks: Array | None) -> Any:
    """Return RC_CHANNELS_OVERRIDE for sticks of X Y Z K M N, shape (6,); None releases the channels to the radio."""
    pulses = [_RELEASED] * _AXES if sticks is None else map(round, channel_pulses(sticks.tolist()))
    return mavlink.MAVLink_rc_channels_override_message(system, 1, *pulses, _LEFT_ALONE, _LEFT_ALONE)
