"""Failsafe for the loss of the commanding ground station, by the wall clock."""

from __future__ import annotations

from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.simulation.commands.commands import Arm, Command, SetMode

_REMINDER = 30.0  # s


class GcsFailsafe(Service):
    """Apply the loss action when heartbeats of the commanding system stop; a system that never sent one is ignored."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self._reminded = 0.0
        self._acted = True
        self.messages = {"HEARTBEAT": self._heartbeat}

    def _heartbeat(self, sender: Sender, message: Any) -> None:
        self.context.active_gcs.record_heartbeat(sender.system, self.context.now)

    def tick(self) -> None:
        """Check the silence of the station, report it, and apply the loss action."""
        context = self.context
        silence = context.active_gcs.silence(context.now)
        lost = context.loss_action != "none" and silence > context.loss_timeout
        if lost and not context.failsafe:
            context.failsafe, self._reminded = True, context.now
            self._say(silence)
            self._acted = False
        elif lost and context.now - self._reminded >= _REMINDER:
            self._reminded = context.now
            self._say(silence)
        elif context.failsafe and not lost:
            context.failsafe = False
            self._acted = True
            context.send_text(
                f"Link to station {context.active_gcs.commander} regained", context.mavlink.MAV_SEVERITY_NOTICE
            )
        if not self._acted:
            self._acted = self._act()

    def _say(self, silence: float) -> None:
        context = self.context
        action = context.loss_action
        then = "" if action == "warn" else f": {action}"
        text = f"Link to station {context.active_gcs.commander} lost for {silence:.0f} s{then}"
        context.send_text(text, context.mavlink.MAV_SEVERITY_CRITICAL)

    def _act(self) -> bool:
        """Submit the command of the loss action; return False if the queue was full."""
        context = self.context
        command: Command
        match context.loss_action:
            case "disarm":
                command = Arm(False)
            case "hold" | "surface" as mode:
                command = SetMode(mode)
            case _:
                return True
        return bool(context.submit(command) != context.mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
