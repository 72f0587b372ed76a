"""Requests: for messages, once or at an interval, for the time, and for logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cosim.mavlink.messages.message_table import build_messages, message_specs
from cosim.mavlink.messages.status import available_modes
from cosim.mavlink.messages.streams import Streams
from cosim.mavlink.services.service import CommandRequest, Service
from cosim.mavlink.vehicle.vehicle_context import Result, Sender, VehicleContext
from cosim.mavlink.wire.link import Link

_SECOND = 1_000_000
_ALL = 0
_MAX_RATE = 100  # Hz
_NANO = 1000  # ns in a µs


class Requests(Service):
    """Intervals and single messages, by command or by REQUEST_DATA_STREAM."""

    def __init__(self, context: VehicleContext, streams: Mapping[Link, Streams]) -> None:
        super().__init__(context)
        self._streams = streams

    def _execute_set_message_interval(self, request: CommandRequest) -> Result:
        message_id, interval = request.int_param(1), request.int_param(2)
        if message_id is None or interval is None:
            return Result.DENIED
        if message_id not in message_specs():
            return Result.FAILED
        return self._set_intervals(request.sender, [(message_id, interval)])

    def _set_intervals(self, sender: Sender, intervals: Sequence[tuple[int, int]]) -> Result:
        if self._streams[sender.link].set_intervals(intervals):
            return Result.ACCEPTED
        self.context.reject("the link would carry too much", "load")
        return Result.DENIED

    def _execute_get_message_interval(self, request: CommandRequest) -> Result:
        message_id = request.int_param(1)
        interval = 0 if message_id is None else self._streams[request.sender.link].interval(message_id)
        self.reply(request.sender, [self.context.make("MESSAGE_INTERVAL", message_id or 0, interval)])
        return Result.ACCEPTED if interval else Result.FAILED

    def _execute_request_message(self, request: CommandRequest) -> Result:
        """Send any message of the table; parameter 2 is a mode's index. Others fail, as in ArduPilot."""
        context, sender = self.context, request.sender
        message_id, index = request.int_param(1), request.int_param(2) or 0
        spec = message_specs().get(message_id or 0)
        if message_id == context.mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL:
            messages = [context.make("MESSAGE_INTERVAL", index, self._streams[sender.link].interval(index))]
        elif message_id is None or spec is None:
            return Result.FAILED
        elif spec.name == "AVAILABLE_MODES":
            messages = [context.make(spec.name, *fields) for fields in available_modes(context, index)]
        else:
            messages = spec.build(context)
        self.reply(sender, messages)
        return Result.ACCEPTED if messages else Result.FAILED

    def _execute_request_autopilot_capabilities(self, request: CommandRequest) -> Result:
        return self.reply(request.sender, build_messages(self.context, "AUTOPILOT_VERSION"))

    def _execute_do_send_banner(self, request: CommandRequest) -> Result:
        return self.reply(request.sender, banner(self.context))

    def _receive_request_data_stream(self, sender: Sender, message: Any) -> None:
        group, rate = message.req_stream_id, min(message.req_message_rate, _MAX_RATE)
        interval = _SECOND // rate if message.start_stop and rate else -1
        specs = [spec for spec in message_specs().values() if spec.group and group in (_ALL, spec.group)]
        self._set_intervals(sender, [(spec.id, interval) for spec in specs])


def banner(context: VehicleContext) -> list[Any]:
    """Return the texts of the banner: simulation and profile, vehicle, scenario, and restrictions."""
    scenario = context.scenario
    lines = [f"subreach co-simulation, profile {context.profile.name}", f"Vehicle {scenario.vehicle.name}"]
    lines.append(f"Scenario {scenario.name}, law {scenario.law.name}")
    if not context.live:
        lines.append("A recorded run")
    elif not context.accepts_commands:
        lines.append("Read-only: commands are off")
    return [message for line in lines for message in context.make_text(line)]


class Timing(Service):
    """TIMESYNC and PING, answered with the time since boot."""

    def _receive_timesync(self, sender: Sender, message: Any) -> None:
        if message.tc1 == 0:
            boot = max(1, self.context.view.boot_us * _NANO)  # 0 would be a request
            sender.link.send(self.context.make("TIMESYNC", boot, message.ts1))

    def _receive_ping(self, sender: Sender, message: Any) -> None:
        if message.target_system == 0 and message.target_component == 0:  # a request, not an answer
            sender.link.send(self.context.make("PING", message.time_usec, message.seq, *sender.address))


class LogProtocol(Service):
    """LOG_REQUEST_LIST, LOG_REQUEST_DATA and LOG_ERASE: an empty list, without which MAVSDK waits for 7.5 s."""

    def _receive_log_erase(self, sender: Sender, message: Any) -> None:
        self.context.reject("there are no logs to erase", "logs")

    def _receive_log_request_list(self, sender: Sender, message: Any) -> None:
        sender.link.send(self.context.make("LOG_ENTRY", 0, 0, 0, 0, 0))

    def _receive_log_request_data(self, sender: Sender, message: Any) -> None:
        sender.link.send(self.context.make("LOG_DATA", message.id, message.ofs, 0, bytes(90)))
        self.context.reject(f"there is no log {message.id}: the record is in the run's folder", "logs")
