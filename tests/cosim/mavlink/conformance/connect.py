"""QGroundControl's connection sequence, with its order, timers and retries."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from tests.cosim.mavlink.conformance.client import Client
from tests.cosim.mavlink.conformance.ftp import download

_ACK_TIMEOUT, _ACK_TRIES = 3.0, 3
_MESSAGE_TIMEOUT = 1.0  # s, from the ack to the message
_LIST_TIMEOUT, _GAP_TIMEOUT, _PARAMETER_TRIES = 5.0, 3.0, 5
_MISSION_TIMEOUT, _MISSION_TRIES = 1.5, 5
_HEARTBEAT_TIMEOUT = 10.0
_FTP_FILE = "@PARAM/param.pck"
COMPONENT_METADATA = 397  # missing in all dialects of pymavlink
_STREAMS_OF_ARDUPILOT = ((1, 2), (2, 2), (3, 2), (6, 3), (10, 20), (11, 10), (12, 3))  # group, Hz
_MAX_MODES = 256


@dataclass(frozen=True)
class Step:
    """One step of the connection sequence."""

    name: str
    seconds: float
    retries: int
    said: str  # description of its result
    good: bool = True


@dataclass(frozen=True)
class Connection:
    """Result of the connection sequence."""

    steps: tuple[Step, ...]

    @property
    def seconds(self) -> float:
        """Time from the first heartbeat to the end of the last step [s]."""
        return sum(step.seconds for step in self.steps)

    @property
    def retries(self) -> int:
        """Number of repeated requests."""
        return sum(step.retries for step in self.steps)

    @property
    def good(self) -> bool:
        """True if every step succeeded."""
        return bool(self.steps) and all(step.good for step in self.steps)


def qgc_connect(client: Client) -> Connection:
    """Connect to a vehicle as QGroundControl does."""
    if client.find(_HEARTBEAT_TIMEOUT) is None:
        return Connection(())
    return Connection(tuple(_Connecting(client).steps()))


class _Connecting:
    """The state of the connection sequence."""

    def __init__(self, client: Client) -> None:
        self._client, self._mavlink = client, client.mavlink
        self._retries = 0
        self._capabilities = 0

    def steps(self) -> Iterator[Step]:
        """Run the steps in QGroundControl's order, and yield each."""
        m = self._mavlink
        yield self._timed("version", self._version)
        yield self._timed("modes", self._modes)
        yield self._timed("metadata", self._metadata)
        yield self._timed("streams", self._streams)
        yield self._timed("parameters", self._parameters)
        yield self._timed("mission", lambda: self._mission(m.MAV_MISSION_TYPE_MISSION))
        if self._capabilities & m.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE:
            yield self._timed("fence", lambda: self._mission(m.MAV_MISSION_TYPE_FENCE))
        if self._capabilities & m.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY:
            yield self._timed("rally", lambda: self._mission(m.MAV_MISSION_TYPE_RALLY))

    def _timed(self, name: str, step: Callable[[], tuple[bool, str]]) -> Step:
        self._retries, started = 0, time.monotonic()
        good, said = step()
        return Step(name, time.monotonic() - started, self._retries, said, good)

    def _request(self, message_id: int, index: float = 0.0) -> tuple[Any, int | None]:
        """Request a message; return it, or None, and the result of its ack, or None without an ack."""
        m, command = self._mavlink, self._mavlink.MAV_CMD_REQUEST_MESSAGE
        for attempt in range(_ACK_TRIES):
            self._retries += attempt > 0
            self._client.discard_unread()
            self._client.send_command(command, [message_id, index, 0, 0, 0, 0, 0])
            found: list[Any] = []

            def is_ack(message: Any, found: list[Any] = found) -> bool:
                if message.get_msgId() == message_id:
                    found.append(message)
                return message.get_type() == "COMMAND_ACK" and bool(message.command == command)

            ack = self._client.wait(is_ack, _ACK_TIMEOUT)
            if ack is None:
                continue
            if ack.result != m.MAV_RESULT_ACCEPTED or found:
                return (found or [None])[0], int(ack.result)
            return self._client.wait(lambda x: bool(x.get_msgId() == message_id), _MESSAGE_TIMEOUT), int(ack.result)
        return None, None

    def _version(self) -> tuple[bool, str]:
        message, result = self._request(self._mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        if message is None:
            return False, f"AUTOPILOT_VERSION did not come (ack {result})"
        self._capabilities = message.capabilities
        return True, f"capabilities {message.capabilities:#x}"

    def _modes(self) -> tuple[bool, str]:
        names: list[str] = []
        for index in range(1, _MAX_MODES):
            mode, result = self._request(self._mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, index)
            if mode is None:  # QGroundControl then uses its own list of the autopilot's modes
                refused = result is not None and result != self._mavlink.MAV_RESULT_ACCEPTED
                return refused and not names, f"mode {index} did not come (ack {result})"
            names.append(mode.mode_name)
            if mode.mode_index >= mode.number_modes:
                break
        return True, f"{len(names)} modes: {', '.join(names)}"

    def _metadata(self) -> tuple[bool, str]:
        _, result = self._request(COMPONENT_METADATA)
        return result is not None, "no ack" if result is None else f"ack {result}"

    def _streams(self) -> tuple[bool, str]:
        """Request streams, without waiting for an answer."""
        m, client = self._mavlink, self._client
        assert client.vehicle is not None
        if client.vehicle.autopilot != m.MAV_AUTOPILOT_ARDUPILOTMEGA:
            return True, "not of ArduPilot: none asked for"
        for group, rate in _STREAMS_OF_ARDUPILOT:
            client.send(m.MAVLink_request_data_stream_message(*client.target, group, rate, 1))
        return True, f"{len(_STREAMS_OF_ARDUPILOT)} groups asked for"

    def _parameters(self) -> tuple[bool, str]:
        """Fetch the file of ArduPilot, or the list of all others."""
        assert self._client.vehicle is not None
        if self._client.vehicle.autopilot == self._mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
            file = download(self._client, _FTP_FILE)
            self._retries += file.retries
            if file.data is not None:
                return True, f"{_FTP_FILE} of {len(file.data)} bytes"
        got, count, retries = fetch_parameters(self._client)
        self._retries += retries
        return count is not None and len(got) == count, f"{len(got)} of {count} parameters"

    def _mission(self, kind: int) -> tuple[bool, str]:
        items, said, retries = fetch_mission(self._client, kind)
        self._retries += retries
        return items is not None, said


def fetch_parameters(client: Client) -> tuple[dict[int, Any], int | None, int]:
    """Fetch the parameter list, and request missing parameters again."""
    m, got, count, retries = client.mavlink, dict[int, Any](), None, 0

    def is_value(message: Any) -> bool:
        return bool(message.get_type() == "PARAM_VALUE" and message.param_index != 0xFFFF)

    client.discard_unread()
    client.send(m.MAVLink_param_request_list_message(*client.target))
    timeout = _LIST_TIMEOUT
    while retries <= _PARAMETER_TRIES:
        value = client.wait(is_value, timeout)
        if value is not None:
            got[value.param_index], count = value, value.param_count
            timeout = _GAP_TIMEOUT
            if len(got) >= count:
                break
        elif count is None:
            retries += 1
            client.send(m.MAVLink_param_request_list_message(*client.target))
        else:
            retries += 1
            for index in [i for i in range(count) if i not in got][:10]:
                client.send(m.MAVLink_param_request_read_message(*client.target, b"", index))
    return got, count, min(retries, _PARAMETER_TRIES)


def fetch_mission(client: Client, kind: int) -> tuple[list[Any] | None, str, int]:
    """Fetch a mission, a fence or rally points."""
    m, target, retries = client.mavlink, client.target, 0

    def ask(message: Any, wanted: str, sequence: int | None = None) -> Any:
        nonlocal retries
        for attempt in range(_MISSION_TRIES):
            retries += attempt > 0
            client.discard_unread()
            client.send(message)
            reply = client.wait(
                lambda x: (
                    x.get_type() in (wanted, "MISSION_ACK")
                    and x.mission_type == kind
                    and (sequence is None or getattr(x, "seq", sequence) == sequence)
                ),
                _MISSION_TIMEOUT,
            )
            if reply is not None:
                return reply
        return None

    count = ask(m.MAVLink_mission_request_list_message(*target, kind), "MISSION_COUNT")
    if count is None or count.get_type() == "MISSION_ACK":
        return None, "no answer" if count is None else f"refused: {count.type}", retries
    items = []
    for sequence in range(count.count):
        item = ask(m.MAVLink_mission_request_int_message(*target, sequence, kind), "MISSION_ITEM_INT", sequence)
        if item is None or item.get_type() == "MISSION_ACK":
            return None, f"item {sequence} of {count.count} did not come", retries
        items.append(item)
    client.send(m.MAVLink_mission_ack_message(*target, m.MAV_MISSION_ACCEPTED, kind))
    return items, f"{len(items)} items", retries
