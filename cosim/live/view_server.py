"""Server of the live view: page over HTTP and run over WebSocket on one port; no viewer can block another."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
import time
from collections.abc import Callable, Coroutine
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as serve_websockets
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from cosim.live.address import LiveAddress, foreign_origin
from cosim.live.command_desk import MAX_LENGTH
from cosim.live.hub import Cursor, Hub
from cosim.live.viewer_messages import format_message
from cosim.replay.page import replay_page

log = logging.getLogger(__name__)

PATH = "/ws"
MAX_VIEWERS = 16  # at once
MAX_CONNECTIONS = 4 * MAX_VIEWERS  # at once; more could use up the file descriptors that the run needs
_PERIOD = 1.0 / 30.0  # s between polls for new rows while there are viewers
_IDLE_PERIOD = 0.25  # s, the same without viewers
_COMMAND_RATE = 20  # 1/s, sustained rate of commands of a viewer
_BURST = 40  # commands in a burst
_MAX_EXCESS = 60  # messages beyond these limits, after which a viewer is disconnected
_PING_PERIOD = 20.0  # s, also the time after which a viewer that does not answer is disconnected
_FLUSH_TIME = 2.0  # s, for which closing waits until all messages are sent

_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    # the page is one file that loads nothing but its connection, and must not be framed
    "Content-Security-Policy": "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
}


async def serve(
    listening: socket.socket, address: LiveAddress, hub: Hub, take_rows: Callable[[], None], closing: threading.Event
) -> None:
    """Serve viewers until `closing` is set."""
    viewers = _Viewers(address, hub, replay_page([], "Live run").encode())
    quiet = logging.getLogger(f"{__name__}.connections")
    quiet.setLevel(logging.CRITICAL + 1)  # invalid requests to the port are not logged
    async with serve_websockets(
        viewers.show, sock=listening, process_request=viewers.answer, compression=None, max_size=MAX_LENGTH,
        max_queue=4, open_timeout=5.0, ping_interval=_PING_PERIOD, ping_timeout=_PING_PERIOD, close_timeout=1.0,
        server_header=None, logger=quiet, create_connection=_limited_connections(MAX_CONNECTIONS),
    ):  # fmt: skip
        while not closing.is_set():
            take_rows()
            viewers.wake()
            await asyncio.sleep(_PERIOD if viewers.cursors else _IDLE_PERIOD)
        take_rows()
        until = time.monotonic() + _FLUSH_TIME
        while viewers.has_unsent_messages and time.monotonic() < until:
            viewers.wake()
            await asyncio.sleep(_PERIOD)


def _limited_connections(max_open: int) -> type[ServerConnection]:
    """Return a class of connections that aborts new ones while `max_open` are open."""
    opened: set[ServerConnection] = set()

    class Connection(ServerConnection):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            super().connection_made(transport)
            opened.add(self)
            if len(opened) > max_open:
                self.transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            opened.discard(self)
            super().connection_lost(exc)

    return Connection


class _Viewers:
    """All connected viewers."""

    def __init__(self, address: LiveAddress, hub: Hub, page: bytes) -> None:
        self.cursors: list[Cursor] = []
        self._address, self._hub, self._page = address, hub, page
        self._news = asyncio.Event()
        self._failures: set[type[Exception]] = set()

    def wake(self) -> None:
        """Wake the tasks of all viewers, which send new messages."""
        self._news.set()
        self._news = asyncio.Event()

    @property
    def has_unsent_messages(self) -> bool:
        """True if messages for some viewer are not sent yet."""
        return any(not self._hub.is_up_to_date(cursor) for cursor in self.cursors)

    def answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer an HTTP request with the page or an error; return None to open a WebSocket."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return connection.respond(HTTPStatus.BAD_REQUEST, "expected one header Host\n")
        reason = foreign_origin(self._address, hosts[0], origins[0] if origins else None)
        if reason is not None:
            return connection.respond(HTTPStatus.FORBIDDEN, f"{reason}\n")
        path = request.path.split("?")[0]
        if path == PATH:
            if len(self.cursors) >= MAX_VIEWERS:
                return connection.respond(
                    HTTPStatus.SERVICE_UNAVAILABLE, f"{MAX_VIEWERS} viewers are connected already\n"
                )
            return None
        if path != "/":
            return connection.respond(HTTPStatus.NOT_FOUND, f"not found: expected / or {PATH}\n")
        headers = Headers(_HEADERS | {"Content-Length": str(len(self._page)), "Connection": "close"})
        return Response(HTTPStatus.OK, HTTPStatus.OK.phrase, headers, self._page)

    async def show(self, connection: ServerConnection) -> None:
        """Send the run to a viewer, and take its commands, until it disconnects."""
        cursor = Cursor()
        self.cursors.append(cursor)
        sending = asyncio.create_task(self._serve(connection, self._send_news(connection, cursor)))
        try:
            await self._serve(connection, self._accept(connection))
        finally:
            sending.cancel()
            self.cursors.remove(cursor)

    async def _serve(self, connection: ServerConnection, work: Coroutine[Any, Any, None]) -> None:
        """Do the work for a viewer until it disconnects, or is disconnected because of an error."""
        try:
            await work
        except ConnectionClosed:
            log.debug("a viewer has gone")
        except Exception as error:  # broad: an error of one viewer must not end the others
            if type(error) not in self._failures:  # later ones of its type are not logged
                self._failures.add(type(error))
                log.exception("a viewer was lost")
            await connection.close(1011)

    async def _send_news(self, connection: ServerConnection, cursor: Cursor) -> None:
        while True:
            news = self._news
            while (message := self._hub.next_for(cursor)) is not None:
                await connection.send(message)  # waits while the viewer's buffer is full
            await news.wait()

    async def _accept(self, connection: ServerConnection) -> None:
        """Take commands at a limited rate (token bucket)."""
        allowance, then, excess = float(_BURST), time.monotonic(), 0
        async for message in connection:
            now = time.monotonic()
            allowance, then = min(_BURST, allowance + _COMMAND_RATE * (now - then)), now
            excess = 0 if allowance == _BURST else excess
            if allowance < 1.0:
                excess += 1
                if excess > _MAX_EXCESS:
                    await connection.close(1008, "too many messages")
                    return
                await asyncio.sleep(1.0 / _COMMAND_RATE)  # further messages wait at the sender
            allowance -= 1.0
            reason = "the run has not begun" if self._hub.desk is None else self._hub.desk.submit(message)
            if reason is not None:
                await connection.send(format_message("message", kind="refused", text=reason, time=None))
