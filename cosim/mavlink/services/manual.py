"""Sticks: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE."""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.ardusub_sticks import (
    CENTER,
    CLIMB_DEAD_ZONE,
    LEAN_DEAD_ZONE,
    MAX_LEAN,
    YAW_DEAD_ZONE,
    MotorMixer,
    apply_dead_zone,
    channel_pulses,
    channel_sticks,
)
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.mavlink.wire.manual_control import decode_sticks
from cosim.scenario.region_tables import Vector6
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.commands.commands import STICK_MODES, ManualControl, Mode
from cosim.simulation.commands.stick_stabilizer import GREATEST_TILT

_TIMEOUT = 3.0  # s of the wall clock
_CHANNELS = 6
_RELEASED, _IGNORED = 0, 0xFFFF  # values of a channel that is released, and of one that stays unchanged
# number of axes, from surge on, whose sticks command forces; those of the others command rates or angles
_FORCE_AXES: dict[Mode, int] = {"manual": 6, "stabilize": 3, "depth_hold": 2}
_NEUTRAL: Vector6 = (0.0,) * 6


class ManualControlService(Service):
    """Convert sticks to fractions of the maximum wrench, in the modes of manual control."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        vehicle = context.scenario.vehicle
        max_wrench = greatest_wrench(vehicle)
        self._mixer = None if vehicle.autopilot is None else MotorMixer(vehicle)
        self._reciprocal = np.divide(1.0, max_wrench, out=np.zeros(6), where=max_wrench > 0.0)
        self._received_at: float | None = None
        self._state = (context.armed, context.mode)

    def restart(self) -> None:
        """Release the sticks."""
        self._received_at = None

    def on_snapshot(self) -> None:
        """Reset the sticks to neutral, as the command handler does, when the mode changes or the vehicle is armed."""
        state = self.context.armed, self.context.mode
        if state != self._state:
            self._state, self.context.sticks = state, _NEUTRAL

    def tick(self) -> None:
        """Release the sticks after 3 s without a message."""
        context = self.context
        if self._received_at is None or context.now - self._received_at < _TIMEOUT:
            return
        self._received_at = None
        if context.mode_ahead in STICK_MODES:
            self._submit(_NEUTRAL, by_gain=True)
            context.send_text("Lost manual control", "CRITICAL", "sticks", _TIMEOUT)

    def _receive_manual_control(self, sender: Sender, message: Any) -> None:
        context, profile = self.context, self.context.profile
        if message.target == context.options.system_id:
            sticks = decode_sticks(message, profile.centered_stick, profile.full_tilt_stick)
            if profile.name == "ardusub":  # its gain leaves roll and pitch alone
                x, y, z, k, m, n = sticks
                gain = context.settings["commands.pilot_gain"]
                sticks = gain * x, gain * y, gain * z, k, m, gain * n
            self._apply(sender, sticks, by_gain=profile.name != "ardusub")

    def _receive_rc_channels_override(self, sender: Sender, message: Any) -> None:
        pulses = [getattr(message, f"chan{i}_raw") for i in range(1, _CHANNELS + 1)]
        before = channel_pulses(self.context.sticks)
        pulses = [
            old if pulse == _IGNORED else CENTER if pulse == _RELEASED else pulse
            for pulse, old in zip(pulses, before, strict=True)
        ]
        self._apply(sender, channel_sticks(pulses), by_gain=False)

    def _apply(self, sender: Sender, sticks: Vector6, by_gain: bool) -> None:
        context = self.context
        if context.accepts_commands and context.mode_ahead not in STICK_MODES:
            return
        if not self.accept_control(sender):
            return
        self._received_at = context.now
        self._submit(sticks, by_gain)

    def _submit(self, sticks: Vector6, by_gain: bool) -> None:
        context = self.context
        if sticks == context.sticks:
            return
        if context.submit(ManualControl(self._wrench_fractions(sticks), by_gain)) == Result.ACCEPTED:
            context.sticks = sticks

    def _wrench_fractions(self, sticks: Vector6) -> Vector6:
        """Return the fractions of the maximum wrench that sticks command; an ArduSub's include the pilot gain."""
        # ArduSub commands its thrusters by them, and their force is proportional to the square of the sum.
        context, mode = self.context, self.context.mode_ahead
        if context.profile.name != "ardusub":
            return sticks
        gain = context.settings["commands.pilot_gain"]
        is_force, parts = np.arange(len(sticks)) < _FORCE_AXES[mode], np.array(sticks)
        if self._mixer is not None:
            parts[is_force] = (self._mixer.wrench(np.where(is_force, parts, 0.0)) * self._reciprocal)[is_force]
        if mode != "manual":  # beyond a dead zone, a rate of turn and angles
            parts[5] = apply_dead_zone(parts[5], gain * YAW_DEAD_ZONE)
            parts[3:5] = [
                apply_dead_zone(part, LEAN_DEAD_ZONE) * MAX_LEAN / GREATEST_TILT for part in parts[3:5].tolist()
            ]
        if mode == "depth_hold":  # likewise of the depth
            parts[2] = apply_dead_zone(parts[2], gain * CLIMB_DEAD_ZONE)
        x, y, z, k, m, n = np.clip(parts, -1.0, 1.0).tolist()
        return x, y, z, k, m, n
