"""Address of the live view, and a check that requests come from its own page."""

from __future__ import annotations

import contextlib
import ipaddress
import socket
from dataclasses import dataclass
from urllib.parse import urlsplit

from cosim.errors import TelemetryError
from cosim.io.network_address import resolve_host

HOST, PORT = "127.0.0.1", 8765
_LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
_EXPECTED = "expected HOST:PORT or PORT, such as 8765"


@dataclass(frozen=True)
class LiveAddress:
    """Address at which a live view is served."""

    host: str = HOST  # host as the user named it
    ip: str = HOST
    port: int = PORT  # 0 for any free one
    is_fixed_port: bool = False  # True: only this port; False: any free port if it is in use
    is_loopback: bool = True  # True: other machines do not reach it


def parse_live(text: str, allow_remote: bool = False) -> LiveAddress:
    """Parse the address of a live view."""
    if not text:
        return LiveAddress()
    host, colon, number = text.rpartition(":")
    host = host or HOST
    if not (number.isascii() and number.isdecimal() and int(number[:6]) <= 65535) or (colon and not text[0].isalnum()):
        raise TelemetryError(f"--live {text!r}: {_EXPECTED}")
    try:
        ip, loopback = resolve_host(host)
    except OSError as error:
        raise TelemetryError(f"--live {text!r}: {host!r} is not known; {_EXPECTED}") from error
    if not (loopback or allow_remote):
        raise TelemetryError(f"--live {text!r}: is reachable from other machines; --allow-remote allows it")
    return LiveAddress(host, ip, int(number), True, loopback)


def foreign_origin(address: LiveAddress, host: str | None, origin: str | None) -> str | None:
    """Return the reason why a request is of foreign origin, None if it comes from the view's own page."""
    # A page of another site can make a browser connect to this machine, directly or by DNS rebinding. The browser sends
    # the requested name in `Host`, and the site of the page in `Origin`.
    name = _name(host or "")
    known = name in _LOOPBACK_NAMES or name == address.host.lower()
    if not address.is_loopback:
        known = known or name == socket.gethostname().lower() or _is_ip(name)
    if not known:
        return f"host {host!r} is not this one"
    if origin is not None and origin.lower() not in (f"http://{host}".lower(), f"https://{host}".lower()):
        return f"page of foreign origin {origin!r}"
    return None


def _name(host: str) -> str:
    with contextlib.suppress(ValueError):
        return urlsplit(f"//{host}").hostname or ""
    return ""


def _is_ip(name: str) -> bool:
    with contextlib.suppress(ValueError):
        ipaddress.ip_address(name)
        return True
    return False


def open_socket(address: LiveAddress) -> socket.socket:
    """Open a socket at an address; at a free port if the default one is in use."""
    for port in (address.port,) if address.is_fixed_port else (address.port, 0):
        # a port in TIME_WAIT may be taken again; on Windows the option would let others take one that is in use
        try:
            return socket.create_server((address.ip, port))
        except OSError as error:
            failure = error
    raise TelemetryError(
        f"--live: {address.host}:{address.port} cannot be opened: {failure.strerror or failure}"
    ) from failure
