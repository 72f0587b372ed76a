"""The ground station's end of a link: receives from any vehicle, and sends to it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple, Self

from cosim.mavlink.wire.dialect import dialect, make_heartbeat
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.framing import FrameFilter, RxStats
from cosim.mavlink.wire.link import Link, Signer, open_channel
from cosim.mavlink.wire.signing import SigningClock, Verifier, timestamp_file

_MAX_MESSAGES = 512  # of one call
_POLL_PERIOD = 0.001  # s, of an idle link
_MAX_READ_TIME = 0.05  # s, of reading without a pause

Identity = tuple[int, int]
GROUND_STATION: Identity = (255, 190)  # QGroundControl's system and component


class ReceivedMessage(NamedTuple):
    """A received message with its time and sender."""

    time: float  # s, of the link's clock
    system: int
    component: int
    sequence: int
    name: str  # such as HEARTBEAT
    message: Any


class GroundLink:
    """A ground station's end of an endpoint."""

    def __init__(
        self,
        endpoint: Endpoint,
        key: bytes | None = None,
        identity: Identity = GROUND_STATION,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name, self.identity, self._clock = endpoint.text, identity, clock  # s, for connections and messages
        # in simulated time all is read at once, however loaded the machine is
        self._max_read_time = _MAX_READ_TIME if clock is time.monotonic else math.inf
        self.stats = RxStats()
        stamps = SigningClock(None if key is None else timestamp_file(key, identity))
        frames = FrameFilter(self.stats, verifier=None if key is None else Verifier(key, stamps))
        self.channel, _ = open_channel(endpoint)
        signer = None if key is None else Signer(key, stamps, link=0)
        self._link = Link(endpoint.text, self.channel, frames, identity, signer=signer)
        self.sends_first = endpoint.kind in ("udpout", "tcp", "serial")  # else the vehicle may not know this address
        m = dialect()
        self._heartbeat = make_heartbeat(m, m.MAV_TYPE_GCS, m.MAV_STATE_ACTIVE)

    def receive(self, timeout: float) -> list[ReceivedMessage]:
        """Return received messages, waiting for the first; timeout [s]."""
        deadline = time.monotonic() + timeout
        while True:
            now = time.monotonic()
            self.channel.poll(self._clock())
            received: list[ReceivedMessage] = []
            for _, message in self._link.receive(time.perf_counter() + self._max_read_time):
                source = message.get_srcSystem(), message.get_srcComponent(), message.get_seq()
                received.append(ReceivedMessage(self._clock(), *source, message.get_type(), message))
                if len(received) == _MAX_MESSAGES:
                    break
            if received or now >= deadline:
                return received
            time.sleep(min(_POLL_PERIOD, max(0.0, deadline - now)))

    def send(self, message: Any) -> bool:
        """Send a message; return False if it could not be sent."""
        return self._link.send(message)

    def send_heartbeat(self) -> None:
        """Send a ground station's heartbeat."""
        self._link.send(self._heartbeat)

    def loss_reports(self) -> list[str]:
        """Return a text for each kind of frame lost or rejected, with its count."""
        return self._link.loss_reports()

    def close(self) -> None:
        """Close the link. May be called twice."""
        self.channel.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
