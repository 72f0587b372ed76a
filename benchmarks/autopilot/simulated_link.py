"""The companion's link in simulated time, with faults on purpose."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from cosim.companion.autopilot_link import COMPANION
from cosim.errors import RunError
from cosim.mavlink.wire.dialect import dialect
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.ground_end import GROUND_STATION, GroundLink, ReceivedMessage
from cosim.sitl.json_server import JsonServer
from cosim.sitl.sitl_session import SitlSession

_DOWN, _UP = 0.010, 0.020  # s, delays of messages from the autopilot and to it
_READ_EVERY = 0.004  # s, period of reading the autopilot's port


class SimulatedLink:
    """The companion's link in the plant's time: waiting for a message advances plant and autopilot.

    Messages are exchanged while the autopilot waits for the plant, so that a flight is the same each time.
    """

    def __init__(self, flights: SitlSession, server: JsonServer, endpoint: str) -> None:
        self._flights, self._server = flights, server
        server.before_answer = self._exchange
        self._link = GroundLink(parse_endpoint(endpoint), identity=COMPANION, clock=self.clock)
        self.name, self.identity = endpoint, COMPANION
        self.cut = False  # True: all messages in both directions are lost
        self.lost = set[str]()  # names of messages that are lost in both directions
        self.others: GroundLink | None = None  # link of a pilot's station to the autopilot
        self._up: deque[tuple[float, Any]] = deque()
        self._down: deque[ReceivedMessage] = deque()
        self._read_at = -math.inf
        self.events: list[tuple[float, Callable[[], None]]] = []  # times [s] in order, and functions to call

    def clock(self) -> float:
        """Return the plant's time since the autopilot's first frame [s]."""
        flight = self._flights.flight
        return 0.0 if flight is None else self.waited() + flight.steps * flight.scenario.time.step

    def waited(self) -> float:
        """Return the time for which the plant was held before its record began [s]."""
        flight = self._flights.flight
        return 0.0 if flight is None else flight.waited * flight.scenario.time.step

    def receive(self, timeout: float) -> Sequence[ReceivedMessage]:
        """Advance the plant by `timeout` [s], and return the messages that have arrived."""
        until = self.clock() + timeout
        while self.clock() < until - 1e-9:
            self.advance()
        heard = []
        while self._down and self._down[0].time <= self.clock():
            heard.append(self._down.popleft())
        return heard

    def send(self, message: Any) -> bool:
        """Send a message, which arrives 20 ms later."""
        if not self.cut and message.get_type() not in self.lost:
            self._up.append((self.clock() + _UP, message))
        return True

    def advance(self) -> None:
        """Answer one frame of the autopilot."""
        if status := self._server.poll():
            raise RunError(f"the autopilot's run: {status}")

    def _exchange(self) -> None:
        now = self.clock()
        while self.events and self.events[0][0] <= now:
            self.events.pop(0)[1]()
        while self._up and self._up[0][0] <= now:
            self._link.send(self._up.popleft()[1])
        if now - self._read_at < _READ_EVERY:
            return
        self._read_at = now
        if self.others is not None:
            self.others.receive(0.0)  # connects the link as well
        for one in self._link.receive(0.0):
            if not self.cut and one.name not in self.lost:
                self._down.append(one._replace(time=now + _DOWN))

    def close(self) -> None:
        """Close the link to the autopilot."""
        self._link.close()


def _pilot_takes(mode: int) -> Callable[[SimulatedLink], None]:
    def take(link: SimulatedLink) -> None:
        assert link.others is not None
        link.others.send(dialect().MAVLink_command_long_message(1, 1, 176, 0, 1, mode, 0, 0, 0, 0, 0))

    return take


def _pilot_drives(link: SimulatedLink) -> None:
    """Send sticks for 7 s, and 1 s later the command to resume, from the pilot's station."""
    begin, m = link.clock(), dialect()
    backward = m.MAVLink_manual_control_message(1, -700, 0, 500, 0, 0)
    resume = m.MAVLink_command_long_message(*COMPANION, m.MAV_CMD_DO_PAUSE_CONTINUE, 0, 1, 0, 0, 0, 0, 0, 0)

    def send(message: Any) -> None:
        assert link.others is not None
        link.others.send(message)

    link.events += [(begin + 0.04 * k, lambda: send(backward)) for k in range(175)]
    link.events.append((begin + 8.0, lambda: send(resume)))


def _pause(link: SimulatedLink) -> None:
    system, component = COMPANION
    m = dialect().MAVLink_command_long_message(system, component, 193, 0, 0, 0, 0, 0, 0, 0, 0)
    link._down.append(ReceivedMessage(link.clock() + _DOWN, *GROUND_STATION, 0, m.get_type(), m))


FAULTS: dict[str, Callable[[SimulatedLink], None]] = {
    "pilot takes ALT_HOLD": _pilot_takes(2),
    "pilot takes MANUAL": _pilot_takes(19),
    "pilot drives": _pilot_drives,
    "estimate stops": lambda link: link.lost.update({"LOCAL_POSITION_NED", "ODOMETRY"}),
    "link cut": lambda link: setattr(link, "cut", True),
    "DO_PAUSE_CONTINUE": _pause,
}
