"""Arming, modes, pause and restart."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.services.service import CommandRequest, Service
from cosim.mavlink.vehicle.profile import MODE_TABLE, is_custom
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.simulation.commands.commands import Arm, Command, Mode, Reset, SetMode, SetTarget

_FORCE = 20190226  # PREFLIGHT_REBOOT_SHUTDOWN, parameter 6
_MODES_BY_STANDARD: dict[int, Mode] = {entry.standard: mode for mode, entry in MODE_TABLE.items() if entry.standard}


class ModeCommands(Service):
    """Commands that arm, disarm, restart, or change the mode."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        m = context.mavlink
        self._paused_from: Mode = "reach"
        self.messages = {"SET_MODE": self._set_mode}
        self.commands = {
            m.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            m.MAV_CMD_DO_SET_MODE: self._command_mode,
            m.MAV_CMD_DO_SET_STANDARD_MODE: self._standard_mode,
            m.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN: self._reboot,
            m.MAV_CMD_NAV_LOITER_UNLIM: lambda request: self._steer(request.sender, "hold"),
            m.MAV_CMD_NAV_LAND: lambda request: self._steer(request.sender, "surface"),
            m.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda request: self._return_home(request.sender),
            m.MAV_CMD_OVERRIDE_GOTO: self._goto,
            m.MAV_CMD_DO_PAUSE_CONTINUE: self._pause,
        }

    def _submit(self, sender: Sender, *commands: Command) -> int:
        result = self.context.submit(*commands)
        if result == self.context.mavlink.MAV_RESULT_ACCEPTED:
            self.context.active_gcs.record_command(sender.system)
        return result

    def _arm(self, request: CommandRequest) -> int:
        wanted = request[1]
        if wanted not in (0.0, 1.0):
            return int(self.context.mavlink.MAV_RESULT_DENIED)
        return self._submit(request.sender, Arm(wanted == 1.0))

    def _set_mode(self, sender: Sender, message: Any) -> None:
        if is_custom(message.base_mode) and self.context.profile.is_return(message.custom_mode):
            self._return_home(sender)
        elif is_custom(message.base_mode):
            self._mode(sender, self.context.profile.find_mode(message.custom_mode), f"{message.custom_mode}")
        else:
            self._mode(sender, None, f"of base mode {message.base_mode}")

    def _command_mode(self, request: CommandRequest) -> int:
        base, first, second = request.int_param(1), request.int_param(2), request.int_param(3) or 0
        if base is None or first is None or not is_custom(base):
            return self._mode(request.sender, None, "without a number")
        if self.context.profile.is_return(first << 16 | second << 24):  # MAVSDK's return to launch
            return self._return_home(request.sender)
        named = f"{first}" if not second else f"{first}, {second}"
        return self._mode(request.sender, self.context.profile.find_commanded_mode(first, second), named)

    def _standard_mode(self, request: CommandRequest) -> int:
        number = request.int_param(1)
        return self._mode(
            request.sender, None if number is None else _MODES_BY_STANDARD.get(number), f"standard {number}"
        )

    def _mode(self, sender: Sender, mode: Mode | None, named: str) -> int:
        context = self.context
        if mode is None:
            numbers = context.profile.custom_modes
            known = ", ".join(f"{MODE_TABLE[mode].name.lower()} {number}" for mode, number in numbers.items())
            context.reject(f"no such mode: {named}; profile {context.profile.name} has {known}", "mode")
            return int(context.mavlink.MAV_RESULT_FAILED)
        return self._steer(sender, mode)

    def _steer(self, sender: Sender, mode: Mode) -> int:
        context = self.context
        if mode == "mission" and not context.plan and context.accepts_commands:
            context.reject("there is no mission", "mission")
            return int(context.mavlink.MAV_RESULT_FAILED)
        return self._submit(sender, SetMode(mode))

    def _return_home(self, sender: Sender) -> int:
        north, east, _ = self.context.home_ned()
        settings = self.context.settings
        if not self.context.accepts_commands:
            return self.context.submit()
        depth, radius = settings["commands.surface_depth"], settings["commands.hold_radius"]
        return self._submit(sender, SetTarget((north, east, depth), radius))

    # ---- pause ----

    def _goto(self, request: CommandRequest) -> int:
        m = self.context.mavlink
        here = request.int_param(2) in (None, 0, m.MAV_GOTO_HOLD_AT_CURRENT_POSITION)
        if request.int_param(1) == m.MAV_GOTO_DO_HOLD and here:
            return self._hold(request.sender)
        if request.int_param(1) == m.MAV_GOTO_DO_CONTINUE:
            return self._steer(request.sender, self._paused_from)
        return int(m.MAV_RESULT_UNSUPPORTED)

    def _pause(self, request: CommandRequest) -> int:
        if request[1] == 0.0:
            return self._hold(request.sender)
        if request[1] == 1.0:
            return self._steer(request.sender, self._paused_from)
        return int(self.context.mavlink.MAV_RESULT_DENIED)

    def _hold(self, sender: Sender) -> int:
        mode = self.context.mode_ahead
        if mode != "hold":
            self._paused_from = mode
        return self._steer(sender, "hold")

    # ---- restart ----

    def _reboot(self, request: CommandRequest) -> int:
        m, context = self.context.mavlink, self.context
        if request[1] != 1.0:
            return int(m.MAV_RESULT_UNSUPPORTED if math.isfinite(request[1]) else m.MAV_RESULT_DENIED)
        if context.armed and request[6] != _FORCE and context.accepts_commands:
            context.reject("armed: disarm before a restart", "restart")
            return int(m.MAV_RESULT_DENIED)
        return self._submit(request.sender, Reset())
