"""Sticks: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE."""

from __future__ import annotations

from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.scenario.tables import Vector6
from cosim.simulation.commands.commands import STICK_MODES, ManualControl

_FULL = 1000.0
_INVALID = 0x7FFF
_TIMEOUT = 3.0  # s of the wall clock
_PITCH, _ROLL = 1, 2  # enabled_extensions
_CENTER, _SWING = 1500, 400  # us of a channel
_CHANNELS = 6  # pitch, roll, up, yaw, forward, right, in ArduSub's order
_RELEASED, _IGNORED = 0, 0xFFFF  # values that release a channel, and leave it unchanged
_NEUTRAL: Vector6 = (0.0,) * 6


class Manual(Service):
    """Convert sticks to fractions of the greatest wrench, in the modes of manual control."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self.messages = {"MANUAL_CONTROL": self._manual_control, "RC_CHANNELS_OVERRIDE": self._override}
        self._heard: float | None = None
        self._state = (context.armed, context.mode)

    def restart(self) -> None:
        """Release the sticks."""
        self._heard = None

    def on_snapshot(self) -> None:
        """Reset the sticks to neutral, as the command handler does, when the mode changes or the vehicle is armed."""
        state = self.context.armed, self.context.mode
        if state != self._state:
            self._state, self.context.sticks = state, _NEUTRAL

    def tick(self) -> None:
        """Release the sticks after 3 s without a message."""
        context = self.context
        if self._heard is None or context.now - self._heard < _TIMEOUT:
            return
        self._heard = None
        if context.mode_ahead in STICK_MODES:
            self._submit(_NEUTRAL)
            context.say("Lost manual control", context.mavlink.MAV_SEVERITY_CRITICAL, "sticks", _TIMEOUT)

    def _manual_control(self, sender: Sender, message: Any) -> None:
        if message.target == self.context.options.system_id:
            self._take(sender, self._wrench(message))

    def _override(self, sender: Sender, message: Any) -> None:
        pulses = [getattr(message, f"chan{i}_raw") for i in range(1, _CHANNELS + 1)]
        surge, sway, heave, roll, pitch, yaw = self.context.sticks
        before = pitch, roll, -heave, yaw, surge, sway
        pitch, roll, up, yaw, surge, sway = (
            old if pulse == _IGNORED else 0.0 if pulse == _RELEASED else _part((pulse - _CENTER) / _SWING)
            for pulse, old in zip(pulses, before, strict=True)
        )
        self._take(sender, (surge, sway, -up + 0.0, roll, pitch, yaw))

    def _take(self, sender: Sender, sticks: Vector6) -> None:
        context = self.context
        if not context.accepts_commands:
            context.submit()
            return
        if context.mode_ahead not in STICK_MODES:
            return
        if not context.operator.may_steer(sender.system, context.now):
            context.reject("another station has the vehicle in hand", "active gcs")
            return
        self._heard = context.now
        self._submit(sticks)

    def _submit(self, sticks: Vector6) -> None:
        context = self.context
        if sticks == context.sticks:
            return
        if context.submit(ManualControl(self._parts(sticks))) == context.mavlink.MAV_RESULT_ACCEPTED:
            context.sticks = sticks

    def _parts(self, sticks: Vector6) -> Vector6:
        """Return the fractions of the greatest wrench that the sticks command, before the pilot gain.

        ArduSub commands its thrusters by gain times stick, and their force is proportional to the square of that.
        """
        context, table = self.context, self.context.scenario.vehicle.autopilot
        if context.profile.name != "ardusub" or table is None or table.curve != "quadratic":
            return sticks
        gain = context.settings["commands.pilot_gain"]
        scales = (gain, gain, gain, 1.0 / gain, 1.0 / gain, gain)  # the gain does not apply to roll and pitch
        squared = 6 if context.mode_ahead == "manual" else 3  # in other modes the last three command angles and rates
        x, y, z, k, m, n = (
            scale * s * abs(s) if i < squared else s for i, (scale, s) in enumerate(zip(scales, sticks, strict=True))
        )
        return x, y, z, k, m, n

    def _wrench(self, message: Any) -> Vector6:
        """Return X Y Z K M N from -1 to 1; the vertical stick is positive up, Z is positive down."""
        center = self.context.profile.centred_stick
        up = 0.0 if message.z == _INVALID else _part((message.z - center) / (_FULL - center))
        full = self.context.profile.full_tilt_stick
        roll = _axis(message.t, full) if message.enabled_extensions & _ROLL else 0.0
        pitch = _axis(message.s, full) if message.enabled_extensions & _PITCH else 0.0
        return _axis(message.x), _axis(message.y), -up + 0.0, roll, pitch, _axis(message.r)


def _axis(value: int, full: float = _FULL) -> float:
    return 0.0 if value == _INVALID else _part(value / full)


def _part(value: float) -> float:
    return max(-1.0, min(1.0, value))
