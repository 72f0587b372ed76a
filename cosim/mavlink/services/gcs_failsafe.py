"""Failsafe for the loss of the commanding ground station, by the wall clock."""

from __future__ import annotations

from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.mavlink.wire.options import LossAction
from cosim.simulation.commands.commands import Arm, Command, SetMode

_REPORT_PERIOD = 30.0  # s
_ACTIONS: dict[LossAction, Command] = {
    "disarm": Arm(False), "hold": SetMode("hold"), "surface": SetMode("surface"),
}  # fmt: skip


class GcsFailsafe(Service):
    """Apply the loss action when heartbeats of the commanding system stop; a system that never sent one is ignored."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self._reported_at = 0.0
        self._is_applied = True

    def _receive_heartbeat(self, sender: Sender, message: Any) -> None:
        self.context.active_gcs.record_heartbeat(sender.system, self.context.now)

    def tick(self) -> None:
        """Check the silence of the station, report it, and apply the loss action."""
        context = self.context
        silence = context.active_gcs.silence(context.now)
        is_lost = context.loss_action != "none" and silence > context.loss_timeout
        if is_lost and not context.failsafe:
            context.failsafe, self._reported_at = True, context.now
            self._report(silence)
            self._is_applied = False
        elif is_lost and context.now - self._reported_at >= _REPORT_PERIOD:
            self._reported_at = context.now
            self._report(silence)
        elif context.failsafe and not is_lost:
            context.failsafe = False
            self._is_applied = True
            context.send_text(f"Link to station {context.active_gcs.commander} regained", "NOTICE")
        if not self._is_applied:
            self._is_applied = self._apply_action()

    def _report(self, silence: float) -> None:
        context = self.context
        action = context.loss_action
        then = "" if action == "warn" else f": {action}"
        text = f"Link to station {context.active_gcs.commander} lost for {silence:.0f} s{then}"
        context.send_text(text, "CRITICAL")

    def _apply_action(self) -> bool:
        """Submit the command of the loss action; return False if the queue was full."""
        command = _ACTIONS.get(self.context.loss_action)
        return command is None or self.context.submit(command) != Result.TEMPORARILY_REJECTED
