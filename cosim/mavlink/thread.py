"""The thread that all links live in, and the little that the stepper does for it.

The stepper and this thread share one interpreter, which only one of them holds at a time. So the thread works in slices
of well under a millisecond, between which it sleeps: the stepper never waits for longer than a slice, and what a peer
sends beyond what fits in the slices is lost in the kernel, at no cost. Nobody wakes the thread; it looks by itself.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from cosim.mavlink.channels.tlog import Tlog
from cosim.mavlink.wire.link import Link
from cosim.mavlink.wire.message_sink import MessageSink
from cosim.simulation.signals import Array

log = logging.getLogger(__name__)

SNAPSHOT_PERIOD = 0.01  # s, simulated: the fastest that a stream can be
SNAPSHOTS = 8192  # that wait at the most; when the thread falls behind, the oldest go
_PERIOD = 0.02  # s, after which it looks again where there was nothing to do: each look costs the stepper 0.1 ms
_RUSHING = 0.2  # s, the same in a run that is so much faster than real time that its stepper can hardly ever pause
_MANY = 2500  # snapshots a second of the wall clock that tell of such a run: 25 times real time
_SOON = 0.004  # s, the same while somebody speaks, who may wait for an answer
_TALKING = 0.1  # s, for which somebody is taken to speak after what was heeded last
_RECEIVING = 0.2e-3  # s, of a slice, for all links together
_SENDING = 0.5e-3  # s, of a slice
_REST_RECEIVING = 19  # times as long as it received it rests: a flood gets a twentieth of the time
_REST_SENDING = 3  # times as long as it sent
_LONGEST_REST = 0.05  # s; where a slice took long it was the stepper's, which loads what it calls before its first step
_DRAINING = 2.0  # s, that closing waits for what is queued
_CLOSING = 4.0  # s, that closing waits at all


class Vehicle(Protocol):
    """The vehicle's side of the protocol; it does no input or output of its own."""

    def attach(self, link: MessageSink) -> None:
        """Begin to stream on a link."""
        ...

    def observe(self, row: Array) -> None:
        """Take the next snapshot, a row of the run's signals, and send what is due by its time."""
        ...

    def receive(self, link: MessageSink, message: Any, now: float) -> None:
        """Take a message that came on a link, at monotonic time `now` [s]."""
        ...

    def tick(self, now: float) -> None:
        """Send what is due by the wall clock."""
        ...

    def close(self, now: float) -> None:
        """Say goodbye."""
        ...


class LinkThread:
    """Observer that shows the run on links, from a thread of its own, which `start` begins.

    Parameters
    ----------
    vehicle : Vehicle
        Sends and answers; it is called in the thread only.
    links : sequence of Link
        Closed with the thread.
    step : float
        Step of the run [s].
    ahead : float
        By how much simulated time may get ahead of the wall clock [s]; logs begin earlier by that.

    Attributes
    ----------
    dropped : int
        Snapshots that were overtaken by newer ones.
    failures : dict of str to int
        Errors in the vehicle's side, which cost no more than what raised them.
    """

    def __init__(self, vehicle: Vehicle, links: Sequence[Link], step: float, ahead: float = 0.0) -> None:
        self._vehicle, self._links = vehicle, list(links)
        self._logs = [link.channel for link in links if isinstance(link.channel, Tlog)]
        for tlog in self._logs:
            tlog.begin_earlier(ahead)
        for link in links:
            link.logs = [other for other in links if other is not link and isinstance(other.channel, Tlog)]
        self._every = max(1, round(SNAPSHOT_PERIOD / step))
        self._queue: deque[Array] = deque(maxlen=SNAPSHOTS)
        self._closing = threading.Event()
        self._next_tick = 0.0
        self._first: float | None = None  # s, monotonic, when the first snapshot of time 0 came
        self._waited = 0.0  # s, from then to the last one: for how long arming was awaited
        self._looked = time.perf_counter()  # s, when nothing was left to do before
        self._shown = 0  # snapshots since then
        self._heard = -math.inf  # s, monotonic, when something was heeded last
        self.dropped = 0
        self.failures: dict[str, int] = Counter()
        self._thread = threading.Thread(target=self._live, name="mavlink", daemon=True)

    def start(self) -> None:
        """Begin to send and receive."""
        self._thread.start()

    def observe(self, k: int, row: Array) -> None:
        """Queue a copy of the row of step `k`, where one is due."""
        if k % self._every:
            return
        self.dropped += len(self._queue) == SNAPSHOTS
        self._queue.append(row.copy())

    @property
    def waiting(self) -> int:
        """Snapshots that are queued; more than `SNAPSHOTS` never are."""
        return len(self._queue)

    def close(self) -> None:
        """Send what is queued, within a bounded time, say goodbye, end the thread, and warn of what was lost."""
        if self._closing.is_set():
            return
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join(_CLOSING)
            if self._thread.is_alive():
                log.warning("MAVLink: the links did not close within %g s", _CLOSING)
                return
        else:
            self._close_links()
        troubles = self.troubles()
        if troubles:
            log.warning("MAVLink: %s", "; ".join(troubles))

    def troubles(self) -> list[str]:
        """Return what was lost or refused, and how often, in words."""
        found = [f"{self.dropped} snapshots dropped"] if self.dropped else []
        found += [f"{n} times {what}" for what, n in self.failures.items()]
        return found + [f"{link.name}: {', '.join(link.troubles())}" for link in self._links if link.troubles()]

    # ---- in the thread ----

    def _live(self) -> None:
        for link in self._links:
            self._guard("attach", self._vehicle.attach, link)
        while not self._closing.is_set():
            time.sleep(self._turn())  # and not on an event: that gives the interpreter up several times
        deadline = time.perf_counter() + _DRAINING
        while self._send_queued(time.perf_counter() + _SENDING) and time.perf_counter() < deadline:
            self._tend(time.monotonic())
        self.dropped += len(self._queue)
        self._guard("close", self._vehicle.close, time.monotonic())
        self._close_links()

    def _turn(self) -> float:
        """Do a slice of each kind of work; return for how long to rest [s]."""
        began = time.perf_counter()
        for link in self._links:
            self._guard("receive", self._receive, link, time.perf_counter() + _RECEIVING / len(self._links))
        received = time.perf_counter()
        more = self._send_queued(received + _SENDING)
        now = time.monotonic()
        if now >= self._next_tick:
            self._next_tick = now + _SOON
            self._guard("tick", self._vehicle.tick, now)
        self._tend(now)
        sent = time.perf_counter()
        rest = max(_REST_RECEIVING * (received - began), _REST_SENDING * (sent - received))
        rest = min(rest, _LONGEST_REST)
        if more:
            return rest
        if now - self._heard < _TALKING:
            return max(rest, _SOON)
        rushing = self._shown > _MANY * (began - self._looked)
        self._shown, self._looked = 0, began
        return max(rest, _RUSHING if rushing else _PERIOD)

    def _tend(self, now: float) -> None:
        for link in self._links:
            self._guard("tend", link.channel.tend, now)

    def _receive(self, link: Link, until: float) -> None:
        for frame, message in link.receive(until):
            self._heard = time.monotonic()
            for tlog in self._logs:
                tlog.send(frame)
            self._guard("receive", self._vehicle.receive, link, message, self._heard)

    def _send_queued(self, until: float) -> bool:
        """Show the vehicle snapshots until a moment of `time.perf_counter`; return whether some are left."""
        while self._queue:
            row = self._queue.popleft()
            self._shown += 1
            if not row[0] > 0.0:  # where it comes again, arming is awaited
                now = time.monotonic()
                self._first = now if self._first is None else self._first
                self._waited = now - self._first
            for tlog in self._logs:
                tlog.simulated = self._waited + float(row[0])
            self._guard("observe", self._vehicle.observe, row)
            if time.perf_counter() > until:
                break
        return bool(self._queue)

    def _guard(self, what: str, work: Callable[..., object], *arguments: Any) -> None:
        """Call something; an error in it is told once a kind and counted, and the links live on."""
        try:
            work(*arguments)
        except Exception as error:  # broad: whatever one message brings about, the links go on for everybody else
            kind = f"{type(error).__name__} in {what}"
            if not self.failures[kind]:
                log.exception("MAVLink: %s", kind)
            self.failures[kind] += 1

    def _close_links(self) -> None:
        for link in self._links:
            self._guard("close", link.channel.close)
