"""The page over HTTP and the run over a WebSocket, on one port, for viewers of whom none can hold up another."""

from __future__ import annotations

import asyncio
import logging
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable
from http import HTTPStatus

from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as serve_websockets
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from cosim.live.address import LiveAddress, stranger
from cosim.live.command_desk import LONGEST
from cosim.live.hub import Cursor, Hub
from cosim.live.messages import text_of
from cosim.replay.page import replay_page

log = logging.getLogger(__name__)

PATH = "/ws"
VIEWERS = 16  # at once
CONNECTIONS = 4 * VIEWERS  # at once; further ones would take the files away that the run writes
_LOOKING = 1.0 / 30.0  # s, after which rows are looked for while somebody watches
_IDLING = 0.25  # s, the same while nobody does
_ORDERS = 20  # a second that a viewer may give in the long run
_AT_ONCE = 40  # and in a burst
_PATIENCE = 60  # messages beyond that, after which a viewer is shut out
_SILENCE = 20.0  # s, after which a viewer that answers nothing is gone
_FAREWELL = 2.0  # s, that closing waits for viewers who were not told all yet

_HEADERS = {
    "Content-Type": "text/html; charset=utf-8",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    # one file that asks for nothing but its connection, and stands in no other page
    "Content-Security-Policy": "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
}


async def serve(
    listening: socket.socket, address: LiveAddress, hub: Hub, take_rows: Callable[[], None], closing: threading.Event
) -> None:
    """Serve viewers until it is to close.

    Parameters
    ----------
    listening : socket
        Bound and listening.
    address : LiveAddress
        What it is bound to.
    hub : Hub
        What is shown.
    take_rows : callable
        Brings the hub what is new.
    closing : threading.Event
        Set when it is to end.
    """
    viewers = _Viewers(address, hub, replay_page([], "Live run").encode())
    quiet = logging.getLogger(f"{__name__}.connections")
    quiet.setLevel(logging.CRITICAL + 1)  # garbage on the port is no news
    async with serve_websockets(
        viewers.show, sock=listening, process_request=viewers.answer, compression=None, max_size=LONGEST, max_queue=4,
        open_timeout=5.0, ping_interval=_SILENCE, ping_timeout=_SILENCE, close_timeout=1.0, server_header=None,
        logger=quiet, create_connection=_few(CONNECTIONS),
    ):  # fmt: skip
        while not closing.is_set():
            take_rows()
            viewers.wake()
            await asyncio.sleep(_LOOKING if viewers.cursors else _IDLING)
        take_rows()
        until = time.monotonic() + _FAREWELL
        while viewers.behind and time.monotonic() < until:
            viewers.wake()
            await asyncio.sleep(_LOOKING)


def _few(most: int) -> type[ServerConnection]:
    """Return connections of whom no more than so many are open at once: who comes then is cut off."""
    made: set[ServerConnection] = set()

    class Connection(ServerConnection):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            super().connection_made(transport)
            made.add(self)
            if len(made) > most:
                self.transport.abort()

        def connection_lost(self, exc: Exception | None) -> None:
            made.discard(self)
            super().connection_lost(exc)

    return Connection


class _Viewers:
    """All that are connected."""

    def __init__(self, address: LiveAddress, hub: Hub, page: bytes) -> None:
        self.cursors: list[Cursor] = []
        self._address, self._hub, self._page = address, hub, page
        self._news = asyncio.Event()
        self._failures: Counter[str] = Counter()

    def wake(self) -> None:
        """Let all look whether there is something new for them."""
        self._news.set()
        self._news = asyncio.Event()

    @property
    def behind(self) -> bool:
        """Whether somebody was not told all yet."""
        return any(not self._hub.told_all(cursor) for cursor in self.cursors)

    def answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Answer a plain request, or refuse one; None lets it become a WebSocket."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return connection.respond(HTTPStatus.BAD_REQUEST, "one header Host is expected\n")
        why = stranger(self._address, hosts[0], origins[0] if origins else None)
        if why is not None:
            return connection.respond(HTTPStatus.FORBIDDEN, f"{why}\n")
        path = request.path.split("?")[0]
        if path == PATH:
            if len(self.cursors) >= VIEWERS:
                return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, f"{VIEWERS} viewers are here already\n")
            return None
        if path != "/":
            return connection.respond(HTTPStatus.NOT_FOUND, f"nothing is here but / and {PATH}\n")
        headers = Headers(_HEADERS | {"Content-Length": str(len(self._page)), "Connection": "close"})
        return Response(HTTPStatus.OK, HTTPStatus.OK.phrase, headers, self._page)

    async def show(self, connection: ServerConnection) -> None:
        """Show a viewer the run, and take its commands, until it goes."""
        cursor = Cursor()
        self.cursors.append(cursor)
        telling = asyncio.create_task(self._tell(connection, cursor))
        try:
            await self._accept(connection)
        except ConnectionClosed:
            log.debug("a viewer has gone")
        except Exception as error:  # broad: whatever one viewer brings about, the others go on
            if self._is_new(error):
                log.exception("a viewer was lost")
        finally:
            telling.cancel()
            self.cursors.remove(cursor)

    async def _tell(self, connection: ServerConnection, cursor: Cursor) -> None:
        try:
            while True:
                news = self._news
                while (message := self._hub.next_for(cursor)) is not None:
                    await connection.send(message)  # waits while the viewer takes nothing
                await news.wait()
        except ConnectionClosed:
            log.debug("a viewer has gone")
        except Exception as error:  # broad: as above
            if self._is_new(error):
                log.exception("a viewer was lost")
            await connection.close(1011)

    async def _accept(self, connection: ServerConnection) -> None:
        """Take commands, no faster than a person gives them."""
        allowance, then, hasty = float(_AT_ONCE), time.monotonic(), 0
        async for message in connection:
            now = time.monotonic()
            allowance, then = min(_AT_ONCE, allowance + _ORDERS * (now - then)), now
            hasty = 0 if allowance == _AT_ONCE else hasty
            if allowance < 1.0:
                hasty += 1
                if hasty > _PATIENCE:
                    await connection.close(1008, "too many messages")
                    return
                await asyncio.sleep(1.0 / _ORDERS)  # what comes meanwhile waits at the sender's
            allowance -= 1.0
            why = "the run has not begun" if self._hub.desk is None else self._hub.desk.take(message)
            if why is not None:
                await connection.send(text_of("said", kind="refused", text=why, time=None))

    def _is_new(self, error: Exception) -> bool:
        """Return whether it is the first of its kind: the others are not told."""
        self._failures[type(error).__name__] += 1
        return self._failures[type(error).__name__] == 1
