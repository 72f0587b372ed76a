"""Arming, modes, pause and restart."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.services.service import CommandRequest, Service
from cosim.mavlink.vehicle.profile import MODE_TABLE, is_custom
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.simulation.commands.commands import Arm, Mode, Reset, SetMode, SetTarget

_FORCE = 20190226  # PREFLIGHT_REBOOT_SHUTDOWN, parameter 6
_MODES_BY_STANDARD: dict[int, Mode] = {entry.standard: mode for mode, entry in MODE_TABLE.items() if entry.standard}


class ModeCommands(Service):
    """Commands that arm, disarm, restart, or change the mode."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self._paused_from: Mode = "reach"

    def _execute_component_arm_disarm(self, request: CommandRequest) -> Result:
        if request[1] not in (0.0, 1.0):
            return Result.DENIED
        return self.submit(request.sender, Arm(request[1] == 1.0))

    def _execute_nav_loiter_unlim(self, request: CommandRequest) -> Result:
        return self._steer(request.sender, "hold")

    def _execute_nav_land(self, request: CommandRequest) -> Result:
        return self._steer(request.sender, "surface")

    def _execute_nav_return_to_launch(self, request: CommandRequest) -> Result:
        return self._return_home(request.sender)

    def _receive_set_mode(self, sender: Sender, message: Any) -> None:
        if is_custom(message.base_mode) and self.context.profile.is_return(message.custom_mode):
            self._return_home(sender)
        elif is_custom(message.base_mode):
            self._mode(sender, self.context.profile.find_mode(message.custom_mode), f"{message.custom_mode}")
        else:
            self._mode(sender, None, f"of base mode {message.base_mode}")

    def _execute_do_set_mode(self, request: CommandRequest) -> Result:
        """Change to a mode by its numbers."""
        base, first, second = request.int_param(1), request.int_param(2), request.int_param(3) or 0
        if base is None or first is None or not is_custom(base):
            return self._mode(request.sender, None, "without a number")
        if self.context.profile.is_return(first << 16 | second << 24):  # MAVSDK's return to launch
            return self._return_home(request.sender)
        named = f"{first}" if not second else f"{first}, {second}"
        return self._mode(request.sender, self.context.profile.find_commanded_mode(first, second), named)

    def _execute_do_set_standard_mode(self, request: CommandRequest) -> Result:
        """Change to a MAV_STANDARD_MODE."""
        number = request.int_param(1)
        return self._mode(request.sender, _MODES_BY_STANDARD.get(number or 0), f"standard {number}")

    def _mode(self, sender: Sender, mode: Mode | None, named: str) -> Result:
        context = self.context
        if mode is None:
            numbers = context.profile.custom_modes
            known = ", ".join(f"{MODE_TABLE[mode].name.lower()} {number}" for mode, number in numbers.items())
            context.reject(f"no such mode: {named}; profile {context.profile.name} has {known}", "mode")
            return Result.FAILED
        return self._steer(sender, mode)

    def _steer(self, sender: Sender, mode: Mode) -> Result:
        context = self.context
        if mode == "mission" and not context.plan and context.accepts_commands:
            context.reject("there is no mission", "mission")
            return Result.FAILED
        return self.submit(sender, SetMode(mode))

    def _return_home(self, sender: Sender) -> Result:
        north, east, _ = self.context.home_ned()
        settings = self.context.settings
        if not self.context.accepts_commands:
            return self.context.submit()
        depth, radius = settings["commands.surface_depth"], settings["commands.hold_radius"]
        return self.submit(sender, SetTarget((north, east, depth), radius))

    # ---- pause ----

    def _execute_override_goto(self, request: CommandRequest) -> Result:
        m = self.context.mavlink
        here = request.int_param(2) in (None, 0, m.MAV_GOTO_HOLD_AT_CURRENT_POSITION)
        if request.int_param(1) == m.MAV_GOTO_DO_HOLD and here:
            return self._hold(request.sender)
        if request.int_param(1) == m.MAV_GOTO_DO_CONTINUE:
            return self._continue(request.sender)
        return Result.UNSUPPORTED

    def _execute_do_pause_continue(self, request: CommandRequest) -> Result:
        if request[1] == 0.0:
            return self._hold(request.sender)
        if request[1] == 1.0:
            return self._continue(request.sender)
        return Result.DENIED

    def _hold(self, sender: Sender) -> Result:
        mode = self.context.mode_ahead
        if mode != "hold":
            self._paused_from = mode
        return self._steer(sender, "hold")

    def _continue(self, sender: Sender) -> Result:
        """Continue in the mode before the pause."""
        return self._steer(sender, self._paused_from)

    # ---- restart ----

    def _execute_preflight_reboot_shutdown(self, request: CommandRequest) -> Result:
        context = self.context
        if request[1] != 1.0:
            return Result.UNSUPPORTED if math.isfinite(request[1]) else Result.DENIED
        if context.armed and request[6] != _FORCE and context.accepts_commands:
            context.reject("armed: disarm before a restart", "restart")
            return Result.DENIED
        return self.submit(request.sender, Reset())
