"""The observer that shows a run to viewers, and the thread of their server."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cosim.live.address import LiveAddress, open_socket
from cosim.live.hub import Hub
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import Command
from cosim.simulation.commands.sources import CommandQueue
from cosim.simulation.signals import Array, Column

log = logging.getLogger(__name__)

PERIOD = 1.0 / 30.0  # s of the wall clock, between rows that are copied
_QUEUE_LENGTH = 256  # maximum number of rows in the queue to the thread; beyond it the oldest are dropped
_CLOSE_TIMEOUT = 3.0  # s, for which closing or a new run waits for the thread


class LiveView:
    """Observer that copies some rows for viewers, which another thread serves."""

    # The view passes only commands to the run, through its queue. Errors of the view do not affect the run.

    def __init__(self, address: LiveAddress) -> None:
        from cosim.live.view_server import serve

        self._socket = open_socket(address)
        port = self._socket.getsockname()[1]
        self.url = f"http://{address.host}:{port}/"
        self._hub = Hub()
        self._rows: deque[tuple[int, Array]] = deque(maxlen=_QUEUE_LENGTH)
        self._run, self._picked, self._due, self._last_step = -1, np.zeros(0, dtype=np.intp), 0.0, 0
        self._loop = asyncio.new_event_loop()
        self._closing = threading.Event()
        self._started = False
        self._serve = serve(self._socket, address, self._hub, self._take_rows, self._closing)
        self._thread = threading.Thread(target=self._run_server, name="live view", daemon=True)
        self._warnings = _Warnings(self)

    # ---- called in the thread of the run ----

    def begin(self, scenario: Scenario, columns: Sequence[Column], queue: CommandQueue | str) -> None:
        """Begin showing another run."""
        self._run += 1
        hub = self._hub
        if not self._started:
            hub.begin(self._run, scenario, columns, queue)
            self._started = True
            self._thread.start()
            logging.getLogger("cosim").addHandler(self._warnings)
        elif self._thread.is_alive():
            begun = threading.Event()
            self._call(hub.begin, self._run, scenario, columns, queue)
            self._call(begun.set)
            begun.wait(_CLOSE_TIMEOUT)
        self._picked, self._due, self._last_step = np.array(hub.picked), 0.0, scenario.steps

    def observe(self, k: int, row: Array) -> None:
        """Copy the shown columns of the row of step `k`, if a copy is due."""
        now = time.perf_counter()
        if now >= self._due or k == self._last_step:
            self._due = now + PERIOD
            self._rows.append((self._run, row[self._picked]))

    def observe_block(self, first: int, rows: Array) -> None:
        """Copy the last of the rows of the steps from `first` on, if a copy is due."""
        self.observe(first + len(rows) - 1, rows[-1])

    def show_commands(self, k: int, commands: Sequence[Command]) -> None:
        """Show the commands that step `k` applies."""
        self._call(self._hub.show_commands, k, commands)

    def say(self, text: str, kind: str = "info") -> None:
        """Show a `text` to all viewers; its `kind` is info, command or warning."""
        self._call(self._hub.say, text, kind)

    def end(self, status: str, verdict: str) -> None:
        """Show the `status` and `verdict` of a run that has ended."""
        self._call(self._take_rows)
        self._call(self._hub.end, status, verdict)

    def close(self) -> None:
        """Send the remaining messages, for a bounded time, and close the server. May be called twice."""
        logging.getLogger("cosim").removeHandler(self._warnings)
        if not self._started:
            self._serve.close()
            self._loop.close()
        elif self._thread.is_alive():
            self._closing.set()
            self._thread.join(_CLOSE_TIMEOUT)
        self._socket.close()

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    # ---- in the thread ----

    def _call(self, work: Callable[..., object], *arguments: Any) -> None:
        """Schedule a call in the thread."""
        try:
            self._loop.call_soon_threadsafe(work, *arguments)
        except RuntimeError:  # the thread has failed, which was logged
            log.debug("the view is closed")

    def _run_server(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_until_complete(self._serve)
        except Exception:  # broad: an error of the view must not end the run
            log.exception("the live view has ended, the run goes on")
        finally:
            self._loop.close()

    def _take_rows(self) -> None:
        """Pass the copied rows to the hub."""
        rows = []
        while self._rows:
            run, row = self._rows.popleft()
            if run == self._hub.run:
                rows.append(row)
        if rows:
            self._hub.show(rows)


class _Warnings(logging.Handler):
    """Shows logged warnings to viewers, such as a rejected command."""

    def __init__(self, view: LiveView) -> None:
        super().__init__(logging.WARNING)
        self._view = view

    def emit(self, record: logging.LogRecord) -> None:
        if not record.name.startswith("cosim.live"):
            self._view.say(record.getMessage(), "warning")
