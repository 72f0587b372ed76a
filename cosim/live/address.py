"""Where a live view is served, and who may come there."""

from __future__ import annotations

import contextlib
import ipaddress
import socket
from dataclasses import dataclass
from urllib.parse import urlsplit

from cosim.errors import TelemetryError
from cosim.io.network_address import resolved

HOST, PORT = "127.0.0.1", 8765
_OWN = frozenset({"127.0.0.1", "localhost", "::1"})
_EXPECTED = "expected HOST:PORT or PORT, such as 8765"


@dataclass(frozen=True)
class LiveAddress:
    """Where a live view is served."""

    host: str = HOST  # as the user named it
    ip: str = HOST
    port: int = PORT  # 0 for any free one
    insisted: bool = False  # on the port; otherwise another one does where it is taken
    loopback: bool = True  # of this machine alone


def parse_live(text: str, allow_remote: bool = False) -> LiveAddress:
    """Return the address that a user names.

    Parameters
    ----------
    text : str
        ``HOST:PORT`` or ``PORT``; empty for the usual one.
    allow_remote : bool
        Whether other machines may come.

    Returns
    -------
    LiveAddress
        Nothing is opened yet.

    Raises
    ------
    TelemetryError
        If it is none, or leaves this machine without leave.
    """
    if not text:
        return LiveAddress()
    host, colon, number = text.rpartition(":")
    host = host or HOST
    if not (number.isascii() and number.isdecimal() and int(number[:6]) <= 65535) or (colon and not text[0].isalnum()):
        raise TelemetryError(f"--live {text!r}: {_EXPECTED}")
    try:
        ip, loopback = resolved(host)
    except OSError as error:
        raise TelemetryError(f"--live {text!r}: {host!r} is not known; {_EXPECTED}") from error
    if not (loopback or allow_remote):
        raise TelemetryError(f"--live {text!r}: leaves this machine; --allow-remote lets it")
    return LiveAddress(host, ip, int(number), True, loopback)


def stranger(address: LiveAddress, host: str | None, origin: str | None) -> str | None:
    """Return why a request is not ours, None if it is.

    A page of another site may make its user's browser speak to this machine, also by a name that its owner lets point
    here. The browser tells both: the name that was asked for, and the site of the page.

    Parameters
    ----------
    address : LiveAddress
        Where it came.
    host : str or None
        Its header ``Host``.
    origin : str or None
        Its header ``Origin``, which browsers alone send.

    Returns
    -------
    str or None
        One line.
    """
    name = _name(host or "")
    known = name in _OWN or name == address.host.lower()
    if not address.loopback:
        known = known or name == socket.gethostname().lower() or _is_ip(name)
    if not known:
        return f"host {host!r} is not this one"
    if origin is not None and origin.lower() not in (f"http://{host}".lower(), f"https://{host}".lower()):
        return f"a page of {origin!r} has no business here"
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


def bound(address: LiveAddress) -> socket.socket:
    """Return a socket that is bound to an address; to a free port where the usual one is taken.

    Raises
    ------
    TelemetryError
        If it cannot be.
    """
    for port in (address.port,) if address.insisted else (address.port, 0):
        # a port in TIME_WAIT may be taken again; on Windows the option would let others take one that is in use
        try:
            return socket.create_server((address.ip, port))
        except OSError as error:
            failure = error
    raise TelemetryError(
        f"--live: {address.host}:{address.port} cannot be opened: {failure.strerror or failure}"
    ) from failure
