"""A ground station for the length of a check: sends, waits, and records received messages."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.ground_end import GroundLink, ReceivedMessage

_KEPT = 20_000  # messages that are kept
_BEAT = 1.0  # s, between our heartbeats
_SLICE = 0.05  # s
_VEHICLE_COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1

Wanted = Callable[[Any], bool]


class Vehicle(NamedTuple):
    """Identity of the checked vehicle."""

    system: int
    component: int
    autopilot: int
    type: int


class Client:
    """Exchange messages with one vehicle."""

    def __init__(self, link: GroundLink) -> None:
        self.link, self.mavlink = link, dialect()
        self.vehicle: Vehicle | None = None
        self.lost = self.total = 0
        self._heard: deque[ReceivedMessage] = deque(maxlen=_KEPT)
        self._new: deque[ReceivedMessage] = deque(maxlen=_KEPT)  # not examined by a wait
        self._sequence: int | None = None
        self._next_beat = 0.0
        self.last_heard = time.monotonic()

    # ---- receiving ----

    def pump(self, timeout: float = 0.0) -> None:
        """Receive messages of the vehicle for up to `timeout` [s]; send the client's heartbeat once a second."""
        now = time.monotonic()
        if now >= self._next_beat:
            self._next_beat = now + _BEAT
            self.link.send_heartbeat()
        for heard in self.link.receive(min(timeout, _SLICE)):
            if self._is_of_vehicle(heard):
                if self._sequence is not None:
                    self.lost += (heard.sequence - self._sequence - 1) % 256
                self._sequence = heard.sequence
                self._heard.append(heard)
                self._new.append(heard)
                self.total += 1
                self.last_heard = heard.time

    def _is_of_vehicle(self, heard: ReceivedMessage) -> bool:
        m = self.mavlink
        if self.vehicle is None and heard.name == "HEARTBEAT" and heard.component == _VEHICLE_COMPONENT:
            beat = heard.message
            if beat.type not in (m.MAV_TYPE_GCS, m.MAV_TYPE_ONBOARD_CONTROLLER, m.MAV_TYPE_GIMBAL, m.MAV_TYPE_ADSB):
                self.vehicle = Vehicle(heard.system, heard.component, beat.autopilot, beat.type)
        return self.vehicle is not None and (heard.system, heard.component) == self.vehicle[:2]

    def collect(self, seconds: float) -> list[ReceivedMessage]:
        """Return the messages not yet examined by a wait, and those of the next `seconds` of the wall clock."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self.pump(left)
        found = list(self._new)
        self._new.clear()
        return found

    def discard_unread(self) -> None:
        """Discard the messages not yet examined, so that the next wait examines only later ones."""
        self.pump()
        self._new.clear()

    def wait(self, wanted: Wanted, timeout: float) -> Any:
        """Return the next message for which `wanted` is true, skipping others, or None after `timeout` [s]."""
        end = time.monotonic() + timeout
        while True:
            while self._new:
                message = self._new.popleft().message
                if wanted(message):
                    return message
            left = end - time.monotonic()
            if left <= 0.0:
                return None
            self.pump(left)

    def find(self, timeout: float) -> Vehicle | None:
        """Wait for a vehicle's heartbeat, and return its identity; None after `timeout` [s]."""
        end = time.monotonic() + timeout
        while self.vehicle is None and (left := end - time.monotonic()) > 0.0:
            self.pump(left)
        return self.vehicle

    def recent(self, kind: str) -> list[ReceivedMessage]:
        """Return the kept messages of a kind, oldest first."""
        return [heard for heard in self._heard if heard.name == kind]

    def last(self, kind: str) -> Any:
        """Return the newest message of a kind, or None."""
        return next((heard.message for heard in reversed(self._heard) if heard.name == kind), None)

    # ---- sending ----

    @property
    def identity(self) -> tuple[int, int]:
        """System and component id of the client."""
        return self.link.identity

    @property
    def target(self) -> tuple[int, int]:
        """System and component id of the vehicle."""
        return self.vehicle[:2] if self.vehicle is not None else (1, _VEHICLE_COMPONENT)

    def send(self, message: Any) -> bool:
        """Send a message; return False if it could not be sent."""
        return self.link.send(message)

    def send_command(
        self, command: int, parameters: Sequence[float] = (), target: tuple[int, int] | None = None
    ) -> None:
        """Send a COMMAND_LONG, `command`, to the vehicle or another `target`.

        Missing `parameters` are NaN, as MAVSDK sends them.
        """
        padded = [*parameters, *[math.nan] * (7 - len(parameters))]
        self.send(self.mavlink.MAVLink_command_long_message(*(target or self.target), command, 0, *padded))

    def command(self, command: int, parameters: Sequence[float] = (), timeout: float = 2.0) -> Any:
        """Send a COMMAND_LONG, `command` with `parameters`, and return its COMMAND_ACK; None after `timeout` [s]."""
        self.discard_unread()
        self.send_command(command, parameters)
        return self.wait(lambda m: m.get_type() == "COMMAND_ACK" and m.command == command, timeout)

    def request(self, message_id: int, timeout: float = 2.0, index: float = 0.0) -> Any:
        """Request the message `message_id` by MAV_CMD_REQUEST_MESSAGE, with `index` as param2, and return it.

        None after `timeout` [s]; the ack may come before or after.
        """
        self.discard_unread()
        self.send_command(self.mavlink.MAV_CMD_REQUEST_MESSAGE, [message_id, index, 0, 0, 0, 0, 0])
        return self.wait(lambda m: m.get_msgId() == message_id, timeout)
