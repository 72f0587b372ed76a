"""SET_ATTITUDE_TARGET: set-points of attitude and force."""

from __future__ import annotations

import math
from typing import Any

from cosim.mavlink.services.service import Service
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.mavlink.wire.thrust_body import THRUST_BODY_SET, get_thrust_body
from cosim.scenario.region_tables import Vector3
from cosim.simulation.commands.commands import Mode, SetAttitude, SetTarget
from cosim.simulation.commands.stick_stabilizer import CLIMB_RATE

_THRUST_IGNORED, _ATTITUDE_IGNORED = 1 << 6, 1 << 7  # type_mask
_TIMEOUTS: dict[Mode, float] = {"reach": 3.0, "depth_hold": 5.0}  # s without a set-point, after which an attitude ends
_REPORT_DELAY, _REPORT_PERIOD = 3.0, 10.0  # s of set-points in another mode before a status text; s between two texts
_NO_FORCE: Vector3 = (0.0, 0.0, 0.0)


class AttitudeTargets(Service):
    """Apply set-points of attitude as the autopilot of the profile does."""

    # As ArduSub: in ALT_HOLD a set-point without thrust leaves surge, sway and the rate of depth to the sticks. In
    # GUIDED thrust is a rate of climb, and nothing pushes ahead or aside. As PX4: in OFFBOARD, with a thrust along each
    # body axis, or along the first one.

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self._last: SetAttitude | None = None
        self._received_at = self._waits_since = -math.inf

    def restart(self) -> None:
        """Forget the last set-point."""
        self._last, self._received_at = None, -math.inf

    def on_snapshot(self) -> None:
        """Forget the last set-point once another mode is on."""
        if self.context.mode_ahead not in _TIMEOUTS:
            self._last = None

    def tick(self) -> None:
        """End an attitude that is no longer sent."""
        context, mode = self.context, self.context.mode_ahead
        if self._last is None or mode not in _TIMEOUTS or context.now - self._received_at < _TIMEOUTS[mode]:
            return
        self._last = None
        if mode == "reach":
            context.submit(SetTarget(context.view.position_ned, context.settings["commands.hold_radius"]))
        else:
            context.submit(SetAttitude(None))
        text = (
            f"No attitude for {_TIMEOUTS[mode]:g} s: {'the vehicle stays' if mode == 'reach' else 'the sticks apply'}"
        )
        context.send_text(text, "WARNING")

    def _receive_set_attitude_target(self, sender: Sender, message: Any) -> None:
        context = self.context
        if not self.accept_control(sender):
            return
        reason = self._unsupported_reason(message)
        if reason:
            context.reject(f"attitude set-point with mask {message.type_mask}: {reason}", "attitude")
            return
        if not self._applies(message):
            self._report_waiting()
            return
        self._waits_since, self._received_at = -math.inf, context.now
        command = self._command(message)
        if command != self._last and context.submit(command) == Result.ACCEPTED:
            self._last = command

    def _unsupported_reason(self, message: Any) -> str:
        """Return the reason why a set-point is refused, as text; empty if it is accepted."""
        mask, thrust = message.type_mask, message.thrust
        if mask & _ATTITUDE_IGNORED:
            return "rates alone are not followed; an attitude is"
        if not abs(math.hypot(*message.q) - 1.0) < 1e-2:
            return "its quaternion is not of length 1"
        if mask & THRUST_BODY_SET and self.context.profile.name == "ardusub":
            return "thrust along each axis is not followed; a rate of climb is"
        if mask & _THRUST_IGNORED and self.context.profile.name != "ardusub":
            return "a thrust is needed"
        thrusts = get_thrust_body(message) if mask & THRUST_BODY_SET else (0.0 if mask & _THRUST_IGNORED else thrust,)
        return "" if all(-1.0 <= part <= 1.0 for part in thrusts) else "a thrust is beyond -1 to 1"

    def _applies(self, message: Any) -> bool:
        sticks_push = self.context.profile.name == "ardusub" and message.type_mask & _THRUST_IGNORED
        return bool(self.context.mode_ahead == ("depth_hold" if sticks_push else "reach"))

    def _report_waiting(self) -> None:
        """Report set-points that are not applied in the present mode, once they have been received for 3 s."""
        context = self.context
        if self._waits_since == -math.inf or context.now - self._received_at > 1.0:
            self._waits_since = context.now
        self._received_at = context.now
        if context.now - self._waits_since >= _REPORT_DELAY:
            modes = "ALT_HOLD without thrust, in GUIDED with it" if context.profile.name == "ardusub" else "offboard"
            text = f"Attitude set-points wait: they apply in {modes}"
            context.send_text(text, "NOTICE", "early attitude", _REPORT_PERIOD)

    def _command(self, message: Any) -> SetAttitude:
        q0, q1, q2, q3 = message.q
        attitude, mask = (q0, q1, q2, q3), message.type_mask
        if self.context.profile.name != "ardusub":
            ahead, right, down = get_thrust_body(message) if mask & THRUST_BODY_SET else (message.thrust, 0.0, 0.0)
            return SetAttitude(attitude, (ahead, right, down))
        if mask & _THRUST_IGNORED:
            return SetAttitude(attitude)
        return SetAttitude(attitude, _NO_FORCE, -2.0 * (max(message.thrust, 0.0) - 0.5) * CLIMB_RATE)
