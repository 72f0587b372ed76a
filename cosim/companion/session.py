"""Message exchange with one autopilot: the messages to send in each state, and the handling of received ones."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from cosim.companion.autopilot_link import AutopilotLink
from cosim.companion.companion_options import CompanionOptions
from cosim.companion.failsafes import Failsafes
from cosim.companion.frame_alignment import FrameAlignment
from cosim.companion.heading import HeadingWatch, LevelDive
from cosim.companion.outputs import Output
from cosim.companion.pilot_watch import PilotWatch
from cosim.companion.safety import GAIN_TOLERANCE, Observation, State, Supervisor
from cosim.companion.vehicle_state import ReportedState, requested_rates
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.mavlink.wire.dialect import dialect, make_command, make_heartbeat, make_rate_requests
from cosim.simulation.commands.commands import Arm, Command, Mode, SetMode
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.signals import Array
from plant_fmu import Vehicle

log = logging.getLogger(__name__)

# s, periods of heartbeats, TIMESYNC, rate and mode requests, and global origins
_HEARTBEAT_PERIOD, _SYNC_PERIOD, _RATES_PERIOD, _MODE_PERIOD, _ORIGIN_PERIOD = 1.0, 0.5, 10.0, 0.25, 1.0
_PILOT_TIMEOUT = 1.0  # s, for which deflected sticks of another station count as a pilot's takeover
_HOLD_TIMEOUT = 1.0  # s, in ``held`` without the hold mode, after which the depth-hold mode is requested instead
_ROUNDING = 1e-6  # s
_CUSTOM_MODE_ENABLED = 1  # MAV_MODE_FLAG, parameter 1 of DO_SET_MODE


class AutopilotSession:
    """Steers one autopilot as its supervisor allows; a source of commands for the master that computes the law."""

    exhausted = False

    def __init__(self, link: AutopilotLink, vehicle: Vehicle, options: CompanionOptions) -> None:
        self._link, self._options = link, options
        self._mavlink: Any = dialect()
        self.profile = PROFILES[options.profile]
        self.output = Output(self._mavlink, vehicle, options)
        self._dive_mode: Mode = options.steering_mode if options.steer_by == "velocity" else "hold"
        self._mode = self.profile.custom_modes[options.steering_mode]
        self.reported = ReportedState(options.vehicle_system)
        self.pilot = PilotWatch(link.identity)
        self.alignment = FrameAlignment(options.origin)
        self.heading = HeadingWatch()
        self.dive = LevelDive(options.level_dive if options.profile == "ardusub" and not options.dry_run else 0.0)
        self.failsafes = Failsafes(options.profile)
        self.supervisor = Supervisor(options.dry_run)
        self.lateness = self.outside = 0.0  # s; m
        self.nearer_time = 0.0  # s, since a distance sensor shows something nearer than the scene
        self.is_placed, self.misplaced = False, ""
        self.commands = CommandQueue(("hold", "reach"))  # from page and terminal: end steering, and resume it
        self._taken_over = self._was_in_mode = self._is_ending = False
        self._is_law_active = False  # value of the last `Arm` for the master
        self._sent_at: dict[str, float] = {}
        self._held_at, self._release_until = 0.0, -math.inf
        self._mode_when_held = -1
        self._is_released = False  # True once the hold mode has been on, or a pilot has changed the mode
        self._stations, self._station_warnings = set[int](), set[str]()  # system ids of other stations; warnings so far

    def clock(self) -> float:
        """Return the link's time [s]."""
        return self._link.clock()

    def take(self, k: int) -> Sequence[Command]:
        """Return the command that starts or stops the law, if `supervisor.is_steering` has changed."""
        if self._is_law_active == self.supervisor.is_steering:
            return ()
        self._is_law_active = self.supervisor.is_steering
        return (Arm(self._is_law_active),)

    def exchange(self, wrench: Array, due: float, until: float) -> None:
        """Run one step: update the state, send messages, and receive until the step ends; wrench [N, N m]."""
        # Units of arguments: due, until [s]
        now = self._link.clock()
        self.lateness = max(0.0, now - due)
        self._receive(0.0)
        for command in self.commands.take(0):
            self._set_takeover(command == SetMode("hold"))
        self._warn_of_stations(now)
        before = self.supervisor.state
        state = self.supervisor.update(self._observation(now))
        if state != before:
            self._start_release(now)
            self._announce(state)
            self.output.restart()
            self._was_in_mode = False
            if state in ("diving", "engaging"):
                self.output.scale_rates(self.failsafes.values)
            if state == "engaging":
                self.heading.restart()
                if self.reported.is_reckoned and self.failsafes.learns_magnetic_field():
                    text = "no position fix, and EK3_MAG_CAL is not 2: the heading may drift by degrees; set it to 2"
                    log.warning(text)
            if before in ("diving", "engaging", "steering") and state == "pilot":
                self._release_until = now + self.output.release_time
        self._send_requests(now)
        self._send_outputs(state, now, wrench, until - due)
        while True:
            self._receive(max(0.0, until - self._link.clock()))
            if self._link.clock() >= until - _ROUNDING:
                return

    def _receive(self, timeout: float) -> None:
        for received in self._link.receive(timeout):
            self._handle(received.system, received.component, received.message, received.time)

    def release(self, seconds: float) -> None:
        """Release the sticks, and request the hold mode until it is on or `seconds` are over."""
        # In the state `pilot`, only finish the release; without steering, do nothing.
        self._is_ending = True
        state, begun = self.supervisor.state, self._link.clock()
        if state in ("diving", "engaging", "steering", "held") and not self._is_released:
            self.supervisor.state, self.supervisor.reason = "held", self.supervisor.reason or "end"
            self._start_release(begun)
            until, waits = begun + self.output.release_time, begun + seconds
        elif state == "pilot":
            until = waits = self._release_until
        else:
            return
        hold = self.profile.custom_modes["hold"]
        while (now := self._link.clock()) <= until or (now < waits and self.reported.mode != hold):
            self.exchange(np.zeros(6), now, now + 0.05)

    def missing(self) -> str:
        """Return the missing conditions for steering as text."""
        reported, now = self.reported, self._link.clock()
        if reported.system is None:
            system = self._options.vehicle_system
            return "a heartbeat of an autopilot" + (f" of system {system}" if system is not None else "")
        if not math.isfinite(reported.age(now)):
            return "LOCAL_POSITION_NED and ATTITUDE_QUATERNION, or ODOMETRY"
        if not self.failsafes.is_read(now):
            return "its failsafe parameters"
        if self.alignment.offset is not None and self.misplaced and not self.is_placed:
            return f"a position near the scene, not {self.misplaced}: check sign and digits of its origin"
        return self.alignment.missing(reported) or {
            "disarmed": "arming",
            "held": f"a command to resume after: {self.supervisor.reason}",
            "pilot": f"a command to resume after: {self.supervisor.reason}", "engaging": f"mode {self._mode}",
            "diving": "the heading alignment",
            "waiting": "a command to resume" if self._taken_over else self.stick_rejection() or "nothing",
        }.get(self.supervisor.state, "nothing")  # fmt: skip

    def stick_rejection(self) -> str:
        """Return the reason why the autopilot would ignore or misread the sticks; empty if none is known."""
        o = self._options
        if o.dry_run or not o.uses_sticks:
            return ""
        system, is_read = self._link.identity[0], self.failsafes.is_read(self._link.clock())
        if is_read and (ignored := self.failsafes.ignored_sticks(system)):
            text = f"{ignored}, and the companion's system id {system}: its sticks would be ignored"
            accepted = self.failsafes.accepted_systems()
            expected = f"from {accepted[0]} to {accepted[-1]}" if accepted[-1] > accepted[0] else f"{accepted[0]}"
            return f"{text}; expected --system-id {expected}, or --steer-by velocity"
        if o.steer_by == "wrench" and (warning := self.failsafes.held_sticks_warning(accepts_unknown=not is_read)):
            return f"{warning}; with --steer-by wrench they would turn the vehicle over"
        if is_read and (misread := self.failsafes.misread_throttle()):
            return misread
        if self._gain_error() > GAIN_TOLERANCE:
            return f"the autopilot's pilot gain is {self._gain():g}, expected {o.pilot_gain:g} of --pilot-gain"
        return ""

    # ---- observation ----

    def _gain_error(self) -> float:
        """Return the difference between the autopilot's pilot gain and the user's; 0 where it is not known."""
        error = abs(self._gain() - self._options.pilot_gain)
        return error if math.isfinite(error) else 0.0

    def _gain(self) -> float:
        """Return the autopilot's pilot gain: the reported one, else JS_GAIN_DEFAULT; NaN if neither is known."""
        reported = self.reported.pilot_gain
        return reported if math.isfinite(reported) else self.failsafes.values.get("JS_GAIN_DEFAULT", math.nan)

    def _observation(self, now: float) -> Observation:
        reported, alignment = self.reported, self.alignment
        has_state = math.isfinite(reported.age(now)) and self.failsafes.is_read(now)
        has_state = has_state and not self.stick_rejection() and not self._taken_over
        values = {
            "lost link": now - reported.received_at,
            "stale estimate": reported.age(now),
            "late loop": self.lateness,
            "autopilot failsafe": float(reported.in_failsafe),
            "frame jump": alignment.jump,
            "frame drift": alignment.drift,
            "geofence": self.dive.outside if self.supervisor.state == "diving" else self.outside,
            "heading leap": 0.0 if self.supervisor.state == "diving" else self.heading.leap,
            "unfinished dive": self.dive.time_diving(now),
            "battery": float(reported.battery < self._options.least_battery),
            "leak": float(reported.is_leaking),
            "unexpected range": self.nearer_time,
            "takeover": float(self._taken_over),
        }
        if self._dive_mode == "hold" and self.supervisor.state == "diving" and self.dive.is_stuck(reported, now):
            self._dive_mode, self._was_in_mode = "depth_hold", False
        is_known = alignment.offset is not None and self.is_placed
        needs_dive = is_known and has_state and self.dive.is_needed(reported, now)
        is_in_mode = reported.mode == (self.profile.custom_modes[self._dive_mode] if needs_dive else self._mode)
        self._was_in_mode |= is_in_mode and self.supervisor.state == "diving"
        is_ours = self.supervisor.state == "steering" or (needs_dive and self._was_in_mode)
        if not self._options.dry_run:
            values |= {
                "pilot's sticks": float(now - self.pilot.seen_at < _PILOT_TIMEOUT),
                "disarmed": float(not reported.is_armed),
                "mode taken": float(not is_in_mode and is_ours),
                "refused mode": self.supervisor.mode_wait_time(now),
                "pilot gain": self._gain_error() if self._options.uses_sticks else 0.0,
            }
        return Observation(now, has_state, is_known, reported.is_armed, is_in_mode, values, needs_dive)

    # ---- sending ----

    def _is_due(self, what: str, period: float, now: float) -> bool:
        if now - self._sent_at.get(what, -math.inf) < period:
            return False
        self._sent_at[what] = now
        return True

    def _send_requests(self, now: float) -> None:
        """Send the messages of every state: heartbeat, clock, and requests of parameters and message rates."""
        m = self._mavlink
        if self._is_due("heartbeat", _HEARTBEAT_PERIOD, now):
            self._link.send(make_heartbeat(m, m.MAV_TYPE_ONBOARD_CONTROLLER, m.MAV_STATE_ACTIVE))
        if self.reported.system is None:
            return
        if self._is_due("sync", _SYNC_PERIOD, now):
            self._link.send(m.MAVLink_timesync_message(0, self.reported.sync.request(now)))
        is_up = math.isfinite(self.reported.age(now))  # one that starts does not answer parameter requests
        origin = self._options.global_origin
        self._sent_at.setdefault("origin", now)  # the autopilot's own may arrive first
        if origin is not None and not self.reported.has_origin and self._is_due("origin", _ORIGIN_PERIOD, now):
            latitude, longitude = (round(1e7 * angle) for angle in origin)
            self._link.send(m.MAVLink_set_gps_global_origin_message(self.reported.system, latitude, longitude, 0))
        for name in self.failsafes.names_to_request(now) if is_up else ():
            self._link.send(m.MAVLink_param_request_read_message(self.reported.system, 1, name.encode(), -1))
        if self._is_due("rates", _RATES_PERIOD, now):
            for request in make_rate_requests(m, self.reported.system, requested_rates(self.profile.name)):
                self._link.send(request)

    def _send_outputs(self, state: State, now: float, wrench: Array, period: float) -> None:
        output, messages = self.output, ()  # type: Output, Sequence[Any]
        if state == "steering":
            messages = output.make_messages(wrench, self.reported, period)
        elif state == "dry_run":
            output.make_messages(wrench, self.reported, period)
        else:
            output.clear()
        if state == "disarmed" and self._options.arm and self._is_due("arm", 1.0, now):
            self._command(self._mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
        elif state == "diving":
            self.supervisor.record_mode_request(now)
            if self.reported.mode != self.profile.custom_modes[self._dive_mode]:
                self._send_mode(self._dive_mode, now)
                messages = output.hold_still(self.reported)
            else:
                speed, back = self.dive.speed_down(self.reported), self.dive.vector_back(self.reported)
                messages = output.descend(self.reported, speed, back, period)
        elif state == "engaging":
            self.supervisor.record_mode_request(now)
            self._send_mode(self._options.steering_mode, now)
            messages = output.hold_still(self.reported)
        elif state == "held" and self.reported.system is not None and not self._options.dry_run:
            messages = self._request_hold(now)
        elif state == "pilot" and now <= self._release_until:
            messages = output.release(self.reported, now - self._held_at)
        for message in messages:
            self._link.send(message)
        if state in ("diving", "engaging", "steering"):
            self.pilot.record_sent(output.pulses, now)

    def _start_release(self, now: float) -> None:
        self._held_at, self._mode_when_held, self._is_released = now, self.reported.mode, False

    def _request_hold(self, now: float) -> Sequence[Any]:
        """Request the hold mode, or depth hold if that is refused; return the messages that release the sticks."""
        since, modes, mode = now - self._held_at, self.profile.custom_modes, self.reported.mode
        if since > self.output.release_time:
            own = self._mode, modes[self._dive_mode], self._mode_when_held
            # a mode that we requested before may still follow the hold mode
            self._is_released |= since > _HOLD_TIMEOUT if mode == modes["hold"] else mode not in own
            if self._is_released or mode == modes["hold"]:
                return ()
        refused = since > _HOLD_TIMEOUT
        if self.reported.mode != modes["depth_hold" if refused else "hold"]:
            self._send_mode("depth_hold" if refused else "hold", now)
        return self.output.release(self.reported, since)

    def _send_mode(self, mode: Mode, now: float) -> None:
        if self._is_due("mode", _MODE_PERIOD, now):
            number = self.profile.custom_modes[mode]
            first, second = (number >> 16 & 0xFF, number >> 24) if self.profile.is_packed else (number, 0)
            self._command(self._mavlink.MAV_CMD_DO_SET_MODE, _CUSTOM_MODE_ENABLED, first, second)

    def _command(self, number: int, *parameters: float) -> None:
        self._link.send(make_command(self._mavlink, self.reported.system or 0, number, *parameters))

    def _announce(self, state: State) -> None:
        """Log the new state, and send it as a STATUSTEXT."""
        reason = f": {self.supervisor.reason}" if self.supervisor.reason else ""
        text = f"Companion {state.replace('_', ' ')}{reason}"
        log.log(logging.WARNING if reason else logging.INFO, "%s", text)
        self._send_text(text, is_warning=bool(reason))

    def _send_text(self, text: str, is_warning: bool) -> None:
        m = self._mavlink
        severity = m.MAV_SEVERITY_WARNING if is_warning else m.MAV_SEVERITY_NOTICE
        self._link.send(m.MAVLink_statustext_message(severity, text[:50].encode()))

    # ---- receiving ----

    def _handle(self, system: int, component: int, message: Any, time: float) -> None:
        if message.get_type() == "COMMAND_LONG":
            self._handle_command(system, component, message)
            return
        if message.get_type() == "HEARTBEAT" and message.type == self._mavlink.MAV_TYPE_GCS:
            self._stations.add(system)
        if message.get_type() == "PARAM_VALUE" and (system, component) == (self.reported.system, 1):
            self.failsafes.receive(message)
        self.reported.receive(system, component, message, time)
        self.pilot.receive(system, component, message, self.reported, time)
        self.alignment.update(self.reported, time)
        self.heading.update(self.reported)
        self.dive.update(self.reported, time)

    def _warn_of_stations(self, now: float) -> None:
        """Warn once of each ground station whose sticks are ignored or compete, or that hides a failed companion."""
        if not self.failsafes.is_read(now):
            return
        for text, advice in [warning for system in sorted(self._stations) for warning in self._warnings_of(system)]:
            if text not in self._station_warnings:
                self._station_warnings.add(text)
                log.warning("%s%s", text, advice)
                self._send_text(f"Companion: {text}", is_warning=True)

    def _warnings_of(self, system: int) -> Iterator[tuple[str, str]]:
        """Yield the warnings of one ground station: a short text, and what the log adds to it."""
        o, failsafes, accepted = self._options, self.failsafes, self.failsafes.accepted_systems()
        if ignored := failsafes.ignored_sticks(system):
            yield f"ArduSub ignores sticks of station {system}", f": {ignored}; set its system id to {accepted[0]}"
        elif (accepted or system == self._link.identity[0]) and o.uses_sticks and not o.dry_run:
            yield f"joystick of station {system} competes if on", "; enable it only to take over"
            if failsafes.values.get("FS_PILOT_INPUT") == 0.0:
                advice = "; it satisfies FS_GCS_ENABLE: set FS_PILOT_INPUT to 1"
                yield f"no failsafe while station {system} runs", advice

    def _set_takeover(self, is_taken_over: bool) -> None:
        """End steering, or estimate the frame again and resume it."""
        self._taken_over = is_taken_over
        if not is_taken_over and not self._is_ending and self.supervisor.state in ("held", "pilot"):
            self.alignment.restart()
            self.is_placed = False
            self.supervisor.resume()

    def _handle_command(self, system: int, component: int, message: Any) -> None:
        """Apply a DO_PAUSE_CONTINUE that is addressed to the companion: 0 ends steering, 1 resumes it."""
        m = self._mavlink
        if (message.target_system, message.target_component) != self._link.identity:
            return
        result = m.MAV_RESULT_UNSUPPORTED
        if message.command == m.MAV_CMD_DO_PAUSE_CONTINUE and message.param1 in (0.0, 1.0):
            result, is_hold = m.MAV_RESULT_DENIED, message.param1 == 0.0
            if is_hold or not self._is_ending:
                result = m.MAV_RESULT_ACCEPTED
                self._set_takeover(is_hold)
        self._link.send(m.MAVLink_command_ack_message(message.command, result, 0, 0, system, component))
