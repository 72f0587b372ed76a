"""Requests for messages, once or at an interval, and for the time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cosim.mavlink.messages import status
from cosim.mavlink.messages.message_table import message_specs
from cosim.mavlink.messages.streams import Streams
from cosim.mavlink.services.service import CommandRequest, Service
from cosim.mavlink.vehicle.vehicle_context import Sender, VehicleContext
from cosim.mavlink.wire.message_sink import MessageSink

_SECOND = 1_000_000
_ALL = 0
_MAX_RATE = 100  # Hz
_NANO = 1000  # ns in a µs


class Requests(Service):
    """Intervals and single messages, by command or by REQUEST_DATA_STREAM."""

    def __init__(self, context: VehicleContext, streams: Mapping[MessageSink, Streams]) -> None:
        super().__init__(context)
        self._streams = streams
        m = context.mavlink
        self.messages = {"REQUEST_DATA_STREAM": self._group}
        self.commands = {
            m.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            m.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            m.MAV_CMD_REQUEST_MESSAGE: self._message,
            m.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: self._version,
            m.MAV_CMD_DO_SEND_BANNER: self._banner,
        }

    def _set_interval(self, request: CommandRequest) -> int:
        m, context = self.context.mavlink, self.context
        message_id, interval = request.int_param(1), request.int_param(2)
        if message_id is None or interval is None:
            return int(m.MAV_RESULT_DENIED)
        if message_id not in message_specs():
            return int(m.MAV_RESULT_FAILED)
        if not self._streams[request.sender.link].set_intervals([(message_id, interval)]):
            context.reject("the link would carry too much", "load")
            return int(m.MAV_RESULT_DENIED)
        return int(m.MAV_RESULT_ACCEPTED)

    def _get_interval(self, request: CommandRequest) -> int:
        m, context, link = self.context.mavlink, self.context, request.sender.link
        message_id = request.int_param(1)
        interval = 0 if message_id is None else self._streams[link].interval(message_id)
        link.send(context.make("MESSAGE_INTERVAL", message_id or 0, interval))
        return int(m.MAV_RESULT_ACCEPTED if interval else m.MAV_RESULT_FAILED)

    def _message(self, request: CommandRequest) -> int:
        """REQUEST_MESSAGE: any message of the table; parameter 2 is a mode's index. Others fail, as in ArduPilot."""
        m, context, link = self.context.mavlink, self.context, request.sender.link
        message_id = request.int_param(1)
        spec = None if message_id is None else message_specs().get(message_id)
        if spec is None and message_id != m.MAVLINK_MSG_ID_MESSAGE_INTERVAL:
            return int(m.MAV_RESULT_FAILED)
        index = request.int_param(2) or 0
        if spec is None:
            link.send(context.make("MESSAGE_INTERVAL", index, self._streams[link].interval(index)))
            return int(m.MAV_RESULT_ACCEPTED)
        is_modes = spec.name == "AVAILABLE_MODES"
        messages = status.available_modes(context, index) if is_modes else spec.build(context)
        for message in messages:
            link.send(message)
        return int(m.MAV_RESULT_ACCEPTED if messages else m.MAV_RESULT_FAILED)

    def _version(self, request: CommandRequest) -> int:
        for message in status.autopilot_version(self.context):
            request.sender.link.send(message)
        return int(self.context.mavlink.MAV_RESULT_ACCEPTED)

    def _banner(self, request: CommandRequest) -> int:
        for line in banner(self.context):
            for message in self.context.make_text(line):
                request.sender.link.send(message)
        return int(self.context.mavlink.MAV_RESULT_ACCEPTED)

    def _group(self, sender: Sender, message: Any) -> None:
        group, rate = message.req_stream_id, min(message.req_message_rate, _MAX_RATE)
        interval = _SECOND // rate if message.start_stop and rate else -1
        changes = [
            (spec.id, interval) for spec in message_specs().values() if spec.group and group in (_ALL, spec.group)
        ]
        if not self._streams[sender.link].set_intervals(changes):
            self.context.reject("the link would carry too much", "load")


def banner(context: VehicleContext) -> list[str]:
    """Return the lines of the banner: simulation and profile, vehicle, scenario, and restrictions."""
    scenario = context.scenario
    lines = [f"subreach co-simulation, profile {context.profile.name}", f"Vehicle {scenario.vehicle.name}"]
    lines.append(f"Scenario {scenario.name}, law {scenario.law.name}")
    if not context.live:
        lines.append("A recorded run")
    elif not context.accepts_commands:
        lines.append("Read-only: commands are off")
    return lines


class Timing(Service):
    """TIMESYNC and PING, answered with the time since boot."""

    def __init__(self, context: VehicleContext) -> None:
        super().__init__(context)
        self.messages = {"TIMESYNC": self._synchronize, "PING": self._ping}

    def _synchronize(self, sender: Sender, message: Any) -> None:
        if message.tc1 == 0:
            boot = max(1, self.context.view.boot_us * _NANO)  # 0 would be a request
            sender.link.send(self.context.make("TIMESYNC", boot, message.ts1))

    def _ping(self, sender: Sender, message: Any) -> None:
        if message.target_system == 0 and message.target_component == 0:  # a request, not an answer
            to = sender.system, sender.component
            sender.link.send(self.context.make("PING", message.time_usec, message.seq, *to))
