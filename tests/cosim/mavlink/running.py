"""A running vehicle in this process, on loopback, and pymavlink's ground station, which connects as QGroundControl."""

from __future__ import annotations

import contextlib
import struct
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from pymavlink import mavftp, mavutil
from pymavlink.dialects.v20 import all as mavlink

from cosim.errors import TelemetryError
from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.thread import LinkThread
from cosim.mavlink.vehicle.vehicle_context import VehicleContext
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.link import open_links
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.commands import Reset
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.master import Master
from cosim.simulation.signals import Array

_STARTING = 120.0  # s, includes compilation
_ACK_TIMEOUT, _ACK_TRIES = 3.0, 3  # QGroundControl's timers [s] and numbers of tries
_MESSAGE_TIMEOUT = 1.0  # s, from the ack to the message
_LIST_TIMEOUT, _MISSION_TIMEOUT, _MISSION_TRIES = 5.0, 1.5, 5
_FILE = "@PARAM/param.pck"
_COMPONENT_METADATA = 397  # missing in all dialects of pymavlink
_GROUPS_OF_ARDUPILOT = ((1, 2), (2, 2), (3, 2), (6, 3), (10, 20), (11, 10), (12, 3))  # group, Hz


class _FirstStep(threading.Event):
    """Observer that is set by the first step."""

    def observe(self, k: int, row: Array) -> None:
        self.set()


@contextlib.contextmanager
def running_vehicle(endpoints: Sequence[Endpoint], options: MavlinkOptions) -> Iterator[LinkThread]:
    """Run a vehicle in a thread until the context ends."""
    scenario = load_scenario("paper-limited", ("commands.enabled=true", "time.duration=3600"))
    commands, begun = CommandQueue(), _FirstStep()
    with Master(scenario) as master:
        autopilot = Autopilot(VehicleContext(scenario, master.signals.columns, options, commands))
        links = LinkThread(autopilot, open_links(endpoints, options), scenario.time.step)
        stepper = threading.Thread(target=lambda: master.run([begun, links], 1.0, commands), daemon=True)
        stepper.start()
        try:
            if not begun.wait(_STARTING):
                raise TelemetryError(f"the vehicle did not begin to move within {_STARTING:g} s")
            links.start()
            yield links
        finally:
            commands.submit(Reset())  # which ends the run
            stepper.join()
            links.close()


class GroundStation:
    """A link of pymavlink that connects in QGroundControl's order."""

    def __init__(self) -> None:
        self.link = mavutil.mavlink_connection("udpin:127.0.0.1:0", 0, 255, 190, dialect="all")
        self.endpoint = Endpoint("udpout", "station", "127.0.0.1", self.link.port.getsockname()[1])
        self.retries = self.file_retries = 0  # requests that were sent again, and those of files by mavftp's timers
        self.log = bytearray()  # a .tlog of all received messages
        self.link.message_hooks.append(
            lambda link, m: self.log.extend(struct.pack(">Q", time.time_ns() // 1000) + m.get_msgbuf())
        )

    def __enter__(self) -> GroundStation:
        return self

    def __exit__(self, *error: object) -> None:
        self.link.close()

    def wait(self, is_wanted: Callable[[Any], bool], timeout: float) -> Any:
        """Return the next message that is wanted, or None after `timeout` [s]."""
        end = time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            message = self.link.recv_match(blocking=True, timeout=left)
            if message is not None and is_wanted(message):
                return message
        return None

    def ask(self, request: Any, is_wanted: Callable[[Any], bool], timeout: float, tries: int) -> Any:
        """Send a request until a wanted message arrives, and return it; None after all tries."""
        for attempt in range(tries):
            self.retries += attempt > 0
            self.link.mav.send(request)
            if (reply := self.wait(is_wanted, timeout)) is not None:
                return reply
        return None

    def command(self, number: int, *numbers: float) -> Any:
        """Send a COMMAND_LONG, and return its ack."""
        request = mavlink.MAVLink_command_long_message(1, 1, number, 0, *numbers, *[0.0] * (7 - len(numbers)))

        def is_ack(message: Any) -> bool:
            return message.get_type() == "COMMAND_ACK" and message.command == number

        return self.ask(request, is_ack, _ACK_TIMEOUT, _ACK_TRIES)

    def request(self, message_id: int, index: float = 0.0) -> Any:
        """Request a message, and return it, or None; an ack must arrive."""
        name = mavlink.mavlink_map[message_id].msgname if message_id in mavlink.mavlink_map else ""
        self.link.messages.pop(name, None)
        ack = self.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message_id, index)
        assert ack is not None, f"no ack for message {message_id}"
        if ack.result != mavlink.MAV_RESULT_ACCEPTED:
            return None
        return self.link.messages.get(name) or self.wait(lambda m: m.get_type() == name, _MESSAGE_TIMEOUT)

    def connect(self) -> dict[str, float]:
        """Connect as QGroundControl does; return the time of each step [s]."""
        autopilot = self.link.wait_heartbeat(timeout=10.0).autopilot
        self.link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4)
        of_ardupilot = autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
        steps: dict[str, Callable[[], object]] = {
            "version": lambda: self.request(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION).capabilities,
            "modes": self._modes,
            "metadata": lambda: self.request(_COMPONENT_METADATA),
            "streams": self._streams if of_ardupilot else lambda: None,
            "parameters": self._file if of_ardupilot else self.parameters,
            "mission": self._mission,
        }
        seconds = {}
        for name, step in steps.items():
            started = time.monotonic()
            step()
            seconds[name] = time.monotonic() - started
        return seconds

    def _modes(self) -> None:
        first = self.request(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, 1)
        for index in range(2, first.number_modes + 1):
            assert self.request(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, index).mode_index == index

    def _streams(self) -> None:
        for group, rate in _GROUPS_OF_ARDUPILOT:
            self.link.mav.request_data_stream_send(1, 1, group, rate, 1)

    def _file(self) -> None:
        files: list[Any] = []
        client = mavftp.MAVFTP(self.link, 1, 1)
        client.cmd_get([_FILE], callback=lambda file: files.append(file and file.read()))
        client.process_ftp_reply("OpenFileRO", timeout=30.0)
        self.file_retries += client.open_retries + client.read_retries
        assert mavftp.MAVFTP.ftp_param_decode(files[0]).params

    def parameters(self) -> dict[str, float]:
        """Fetch the list of parameters."""
        values: dict[int, Any] = {}

        def is_last(message: Any) -> bool:
            if message.get_type() == "PARAM_VALUE" and message.param_index != 0xFFFF:
                values[message.param_index] = message
                return len(values) == int(message.param_count)
            return False

        assert self.ask(mavlink.MAVLink_param_request_list_message(1, 1), is_last, _LIST_TIMEOUT, 2) is not None
        return {value.param_id: value.param_value for value in values.values()}

    def _mission(self) -> None:
        request = mavlink.MAVLink_mission_request_list_message(1, 1, 0)
        assert self.ask(request, lambda m: m.get_type() == "MISSION_COUNT", _MISSION_TIMEOUT, _MISSION_TRIES).count == 0
