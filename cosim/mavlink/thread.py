"""The thread of all links, and the observer that passes snapshots to it."""

# The stepper and this thread share one interpreter lock. So the thread works in slices of well under a millisecond,
# between which it sleeps: the stepper never waits for longer than a slice. Input beyond the capacity of the slices is
# lost in the kernel. The thread polls; no event wakes it.

from __future__ import annotations

import logging
import math
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from typing import Any

from cosim.mavlink.autopilot import Autopilot
from cosim.mavlink.channels.tlog_file import Tlog
from cosim.mavlink.wire.link import Link
from cosim.simulation.signals import Array

log = logging.getLogger(__name__)

SNAPSHOT_PERIOD = 0.01  # s, simulated: the shortest period of a stream
MAX_SNAPSHOTS = 8192  # in the queue; a full queue drops the oldest, unless the links include a log: then the run waits
_IDLE_PERIOD = 0.02  # s, polling period while idle: each poll delays the stepper by 0.1 ms
_FAST_RUN_PERIOD = 0.2  # s, polling period in a run much faster than real time, whose stepper hardly ever pauses
_FAST_RUN_RATE = 2500  # snapshots per second of the wall clock that mark such a run: 25 times real time
_ACTIVE_PERIOD = 0.004  # s, polling period during a conversation, in which a peer may wait for an answer
_ACTIVE_TIME = 0.1  # s after the last accepted message, during which a conversation lasts
_RECEIVING = 0.2e-3  # s of a slice for receiving, for all links together
_SENDING = 0.5e-3  # s of a slice for sending
_REST_RECEIVING = 19  # ratio of rest to receiving: a flood gets a twentieth of the time
_REST_SENDING = 3  # ratio of rest to sending
_MAX_REST = 0.05  # s; long slices come from the stepper, which loads libraries before its first step
_DRAINING = 2.0  # s for which closing waits for the queue
_CLOSING = 4.0  # s for which closing waits in total
_WAITING_PERIOD = 0.002  # s between two looks at the queue while waiting for it
_STALLED = 2.0  # s after the start of a slice, after which the thread has stalled


class LinkThread:
    """Observer that streams the run on links, from its own thread, started by `start`; step [s], lead [s]."""

    def __init__(self, vehicle: Autopilot, links: Sequence[Link], step: float, lead: float = 0.0) -> None:
        self._vehicle, self._links = vehicle, list(links)
        self._logs = [link.channel for link in links if isinstance(link.channel, Tlog)]
        for tlog in self._logs:
            tlog.advance_start(lead)
        for link in links:
            link.logs = [other for other in links if other is not link and isinstance(other.channel, Tlog)]
        self._decimation = max(1, round(SNAPSHOT_PERIOD / step))
        self._queue: deque[Array] = deque(maxlen=MAX_SNAPSHOTS)
        self._closing = threading.Event()
        self._next_tick = 0.0
        self._first_at: float | None = None  # s, monotonic, reception of the first snapshot of time 0
        self._waited = 0.0  # s, from then to the last one: time of waiting for arming
        self._last_poll = time.perf_counter()  # s, end of the last work
        self._snapshot_count = 0  # snapshots since then
        self._received_at = -math.inf  # s, monotonic, time of the last accepted message
        self._slice_at = -math.inf  # s, monotonic, start of the last slice
        self._is_awaited = False  # so that slices need no rest
        self.dropped = 0
        self.failures: dict[str, int] = Counter()
        self._thread = threading.Thread(target=self._run, name="mavlink", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._slice_at = time.monotonic()
        self._thread.start()

    def observe(self, k: int, row: Array) -> None:
        """Queue a copy of the row of step `k`, if a snapshot is due."""
        self.observe_block(k, row[None])

    def observe_block(self, first: int, rows: Array) -> None:
        """Queue copies of the rows of the steps from `first` on of which a snapshot is due."""
        for row in rows[-first % self._decimation :: self._decimation]:
            if self._logs:
                self.await_queue(MAX_SNAPSHOTS - 1)
            self.dropped += len(self._queue) == MAX_SNAPSHOTS
            self._queue.append(row.copy())

    def await_queue(self, count: int) -> None:
        """Wait until at most `count` snapshots are queued, unless the thread has stalled."""
        self._is_awaited = True
        while len(self._queue) > count and time.monotonic() < self._slice_at + _STALLED:
            time.sleep(_WAITING_PERIOD)
        self._is_awaited = False

    def close(self) -> None:
        """Send queued snapshots (all to a log, else for a bounded time), close vehicle and links, and log losses."""
        if self._closing.is_set():
            return
        if self._logs:
            self.await_queue(0)
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join(_CLOSING)
            if self._thread.is_alive():
                log.warning("MAVLink: the links did not close within %g s", _CLOSING)
                return
        else:
            self._close_links()
        troubles = self.loss_reports()
        if troubles:
            log.warning("MAVLink: %s", "; ".join(troubles))

    def loss_reports(self) -> list[str]:
        """Return a text for each kind of loss or refusal, with its count."""
        reports = [f"{self.dropped} snapshots dropped"] if self.dropped else []
        reports += [f"{n} times {what}" for what, n in self.failures.items()]
        losses = [(link.name, link.loss_reports()) for link in self._links]
        return reports + [f"{name}: {', '.join(texts)}" for name, texts in losses if texts]

    # ---- in the thread ----

    def _run(self) -> None:
        for link in self._links:
            self._guard("attach", self._vehicle.attach, link)
        while not self._closing.is_set():
            time.sleep(self._run_slice())  # not an event, which releases the interpreter lock several times
        deadline = time.perf_counter() + _DRAINING
        while self._send_queued(time.perf_counter() + _SENDING) and time.perf_counter() < deadline:
            self._poll(time.monotonic())
        self.dropped += len(self._queue)
        self._guard("close", self._vehicle.close, time.monotonic())
        self._close_links()

    def _run_slice(self) -> float:
        """Run a slice of each kind of work; return the time to rest [s]."""
        self._slice_at, start = time.monotonic(), time.perf_counter()
        for link in self._links:
            self._guard("receive", self._receive, link, time.perf_counter() + _RECEIVING / len(self._links))
        received = time.perf_counter()
        has_more = self._send_queued(received + _SENDING)
        now = time.monotonic()
        if now >= self._next_tick:
            self._next_tick = now + _ACTIVE_PERIOD
            self._guard("tick", self._vehicle.tick, now)
        self._poll(now)
        sent = time.perf_counter()
        pause = max(_REST_RECEIVING * (received - start), _REST_SENDING * (sent - received))
        pause = min(pause, _MAX_REST)
        if has_more:
            return 0.0 if self._is_awaited else pause
        if now - self._received_at < _ACTIVE_TIME:
            return max(pause, _ACTIVE_PERIOD)
        is_fast = self._snapshot_count > _FAST_RUN_RATE * (start - self._last_poll)
        self._snapshot_count, self._last_poll = 0, start
        return max(pause, _FAST_RUN_PERIOD if is_fast else _IDLE_PERIOD)

    def _poll(self, now: float) -> None:
        for link in self._links:
            self._guard("poll", link.channel.poll, now)

    def _receive(self, link: Link, until: float) -> None:
        for frame, message in link.receive(until):
            self._received_at = time.monotonic()
            for tlog in self._logs:
                tlog.send(frame)
            self._guard("receive", self._vehicle.receive, link, message, self._received_at)

    def _send_queued(self, until: float) -> bool:
        """Pass snapshots to the vehicle until a time of `time.perf_counter`; return True if some are left."""
        while self._queue:
            row = self._queue.popleft()
            self._snapshot_count += 1
            if not row[0] > 0.0:  # time 0 repeats while the run waits for arming
                now = time.monotonic()
                self._first_at = now if self._first_at is None else self._first_at
                self._waited = now - self._first_at
            for tlog in self._logs:
                tlog.simulated = self._waited + float(row[0])
            self._guard("observe", self._vehicle.observe, row)
            if time.perf_counter() > until:
                break
        return bool(self._queue)

    def _guard(self, what: str, work: Callable[..., object], *arguments: Any) -> None:
        """Call a function; log the first error of each kind, count all, and continue."""
        try:
            work(*arguments)
        except Exception as error:  # broad: an error from one message must not stop the links
            kind = f"{type(error).__name__} in {what}"
            if not self.failures[kind]:
                log.exception("MAVLink: %s", kind)
            self.failures[kind] += 1

    def _close_links(self) -> None:
        for link in self._links:
            self._guard("close", link.channel.close)
