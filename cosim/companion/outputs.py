"""Outputs of the companion: the messages that command a wrench, and the inputs that each autopilot accepts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cosim.companion.companion_options import CompanionOptions
from cosim.companion.set_points import LevelLead, TurnLead, VelocityLead, make_attitude_message, make_velocity_target
from cosim.companion.sticks import make_manual_control, make_stick_scale, override_channels
from cosim.companion.vehicle_state import ReportedState
from cosim.errors import RunError
from cosim.mavlink.vehicle.profile import PROFILES, Profile
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

_PX4_REJECTIONS: dict[str, str] = {
    "sticks": "its Stabilized takes the forward stick for heave or pitch; expected attitude",
    "wrench": "its sticks have no roll and pitch beside surge and sway; expected attitude",
    "velocity": "its uuv_pos_control keeps the depth and pushes nowhere; expected attitude",
}
# An ArduSub integrates the rate of the yaw stick to a heading, and controls that too. With the full rate it oscillates.
_YAW_FRACTION = 0.75  # fraction of the law's yaw rate that the stick commands
_CENTERING_TIME = 0.2  # s, during which overridden channels are centered before their release


def _require_supported(options: CompanionOptions) -> None:
    """Raise an error if an autopilot does not accept an output."""
    steer_by, sticks_by = options.steer_by, options.sticks_by
    if options.profile == "px4" and steer_by in _PX4_REJECTIONS:
        raise RunError(f"--steer-by {steer_by}: not supported by PX4: {_PX4_REJECTIONS[steer_by]}")
    if sticks_by == "rc-override" and not options.uses_sticks:
        raise RunError(f"--sticks-by {sticks_by}: no sticks are sent with --steer-by {steer_by}, expected none")


class Output:
    """Make the messages that command a wrench, and keep their values for the record."""

    def __init__(self, mavlink: Any, vehicle: Vehicle, options: CompanionOptions) -> None:
        _require_supported(options)
        self._mavlink, self._steer_by, self._sticks_by = mavlink, options.steer_by, options.sticks_by
        self._profile: Profile = PROFILES[options.profile]
        self._uses_sticks, is_ardusub = options.uses_sticks, options.profile == "ardusub"
        self._scale = make_stick_scale(vehicle, self._profile, options.pilot_gain, options.sticks_by)
        self._yaw_fraction = _YAW_FRACTION if is_ardusub else 1.0
        self._all_axes = options.steer_by == "wrench" or (options.steer_by == "sticks" and is_ardusub)
        self._turn, self._level_lead = TurnLead(vehicle), LevelLead(vehicle)
        self._lead = VelocityLead(vehicle, options.velocity_lag, options.vertical_lag)
        self._overridden = False  # True while overridden channels are not released
        # last commands: sticks X Y Z K M N, -1 to 1; velocity [m/s, NED]; quaternion from body to world, scalar first;
        # unused ones are zero
        self.sticks, self.velocity, self.attitude = np.zeros(6), np.zeros(3), np.zeros(4)

    def restart(self) -> None:
        """Reset the estimates of the autopilot's loops, after another controller has steered."""
        self._lead.restart()
        self._level_lead.restart()

    def scale_rates(self, parameters: Mapping[str, float]) -> None:
        """Scale the sticks of rates and lean angles by the autopilot's parameters (a value for each name)."""
        if self._sticks_by == "rc-override":  # the autopilot's gains leave overridden channels alone
            parameters = {**parameters, "JS_THR_GAIN": 1.0}
        self._scale = self._scale.with_rates(parameters)
        self._level_lead.set_gains(parameters)

    def clear(self) -> None:
        """Set all commands to zero."""
        self.sticks[:], self.velocity[:], self.attitude[:] = 0.0, 0.0, 0.0

    def make_messages(self, wrench: Array, state: ReportedState, period: float) -> Sequence[Any]:
        """Return the messages that command a wrench, shape (6,) [N, N m], body frame, for a `period` [s]."""
        match self._steer_by:
            case "velocity":
                self.velocity[:] = self._lead.velocity(wrench, state, period)
                return (self._velocity_target(state, self._turn.yaw_rate(wrench, state)),)
            case "attitude":
                self.attitude[:] = self._turn.attitude(wrench, state)
                return self._attitude(wrench, state, period)
            case "sticks":
                wrench = wrench.copy()
                wrench[3:5] = self._level_lead.moments(state.velocity_body[:3])
                self.sticks[:] = self._scale.sticks(wrench)
                self.sticks[3:5] = self._lean(period)
                self.sticks[5] = self._scale.yaw_rate_stick(self._yaw_fraction * self._turn.yaw_rate(wrench, state))
            case "wrench":
                self.sticks[:] = self._scale.sticks(wrench)
        return (self._sticks(state),)

    def hold_still(self, state: ReportedState) -> Sequence[Any]:
        """Return the messages that command no motion, to be sent until the autopilot is in its mode."""
        self.clear()
        if self._uses_sticks:
            return (self._sticks(state),)
        if self._steer_by == "attitude":
            return (make_attitude_message(self._mavlink, state.system or 0, state.quaternion, np.zeros(3)),)
        return (self._velocity_target(state, 0.0),)

    def descend(self, state: ReportedState, speed: float, back: Array, period: float) -> Sequence[Any]:
        """Return the messages of a level descent at a speed [m/s], by velocity or by stick, for a `period` [s]."""
        # With velocities, the descent holds a horizontal position; `back`, shape (2,) [m, NE], is the vector to it.
        # With a stick, the autopilot holds the position by itself.
        self.clear()
        if self._steer_by == "velocity":
            self.velocity[:] = self._lead.hold(back, speed, state, period)
            return (self._velocity_target(state, 0.0),)
        self.sticks[2] = self._scale.climb_stick(speed)
        return (self._sticks(state),)

    def release(self, state: ReportedState, since: float) -> Sequence[Any]:
        """Return the messages that release the sticks, `since` [s] after the start of the release."""
        # Overridden channels are centered first, since an ArduSub without a radio keeps their last values; then they
        # are released, once. A PX4 keeps the last forces until its own failsafe, so zero forces are sent first.
        self.clear()
        if not self._uses_sticks:
            return self.hold_still(state) if self._steer_by == "attitude" and since < _CENTERING_TIME else ()
        if self._sticks_by == "manual-control" or (self._overridden and since < _CENTERING_TIME):
            return (self._sticks(state),)
        if self._overridden:
            self._overridden = False
            return (override_channels(self._mavlink, state.system or 0, None),)
        return ()

    @property
    def pulses(self) -> Array:
        """Pulses of an ArduSub's channels 1 to 6 that the sticks command, shape (6,) [us]."""
        return self._scale.pulses(self.sticks)

    @property
    def release_time(self) -> float:
        """Duration of the release before another controller steers [s]; an ArduSub keeps sticks for seconds."""
        return 0.0 if self._sticks_by == "manual-control" else 2.0 * _CENTERING_TIME

    def _attitude(self, wrench: Array, state: ReportedState, period: float) -> Sequence[Any]:
        """Return the messages of an attitude with forces; an ArduSub's are sticks of surge, sway and depth rate."""
        system, level = state.system or 0, wrench.copy()
        level[3:] = 0.0
        if not self._uses_sticks:
            force = np.clip(self._scale.efforts @ level, -1.0, 1.0)[:3]
            return (make_attitude_message(self._mavlink, system, self.attitude, force),)
        rate_down = float(self._lead.velocity(wrench, state, period)[2])
        level[2] = 0.0
        self.sticks[:] = self._scale.sticks(level)
        self.sticks[2:] = self._scale.climb_stick(rate_down), 0.0, 0.0, 0.0
        return make_attitude_message(self._mavlink, system, self.attitude, None), self._sticks(state)

    def _lean(self, period: float) -> Array:
        """Return the sticks of roll and pitch, shape (2,), whose lean angles give the commands now in `sticks`."""
        # They are zero for autopilots other than ArduSub.
        if self._profile.name != "ardusub":
            return np.zeros(2)
        return self._scale.lean_sticks(self._level_lead.angles(self.sticks[3:5], period))

    def _velocity_target(self, state: ReportedState, yaw_rate: float) -> Any:
        """Return the message of the velocity, with a yaw rate [rad/s] for an ArduSub."""
        turn = yaw_rate if self._profile.name == "ardusub" else None
        return make_velocity_target(self._mavlink, state.system or 0, self.velocity, turn)

    def _sticks(self, state: ReportedState) -> Any:
        system = state.system or 0
        if self._sticks_by == "manual-control":
            return make_manual_control(self._mavlink, system, self._profile, self.sticks, self._all_axes)
        self._overridden = True
        return override_channels(self._mavlink, system, self.sticks)
