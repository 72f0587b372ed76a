"""The watch over the ground station that commands, by the wall clock."""

from __future__ import annotations

from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Sender, Vessel
from cosim.simulation.commands.commands import Arm, Command, SetMode

_REMINDER = 30.0  # s


class Supervision(Service):
    """Acts when the heartbeats of the system that commands stay away; one that never sent any is not missed."""

    def __init__(self, vessel: Vessel) -> None:
        super().__init__(vessel)
        self._reminded = 0.0
        self._acted = True
        self.messages = {"HEARTBEAT": self._heartbeat}

    def _heartbeat(self, sender: Sender, message: Any) -> None:
        self.vessel.operator.beat(sender.system, self.vessel.now)

    def tick(self) -> None:
        """See whether the station is still there."""
        vessel = self.vessel
        silence = vessel.operator.silence(vessel.now)
        lost = vessel.loss_action != "none" and silence > vessel.loss_timeout
        if lost and not vessel.failsafe:
            vessel.failsafe, self._reminded = True, vessel.now
            self._say(silence)
            self._acted = False
        elif lost and vessel.now - self._reminded >= _REMINDER:
            self._reminded = vessel.now
            self._say(silence)
        elif vessel.failsafe and not lost:
            vessel.failsafe = False
            self._acted = True
            vessel.say(f"Link to station {vessel.operator.commander} regained", vessel.mavlink.MAV_SEVERITY_NOTICE)
        if not self._acted:
            self._acted = self._act()

    def _say(self, silence: float) -> None:
        vessel = self.vessel
        action = vessel.loss_action
        then = "" if action == "warn" else f": {action}"
        text = f"Link to station {vessel.operator.commander} lost for {silence:.0f} s{then}"
        vessel.say(text, vessel.mavlink.MAV_SEVERITY_CRITICAL)

    def _act(self) -> bool:
        """Order what was asked for, and return whether the order found room."""
        vessel = self.vessel
        command: Command
        match vessel.loss_action:
            case "disarm":
                command = Arm(False)
            case "hold" | "surface" as mode:
                command = SetMode(mode)
            case _:
                return True
        return bool(vessel.give(command) != vessel.mavlink.MAV_RESULT_TEMPORARILY_REJECTED)
