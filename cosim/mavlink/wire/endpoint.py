"""Endpoints of MAVLink links, and their text form."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from cosim.errors import TelemetryError
from cosim.io.network_address import resolve_host

Kind = Literal["udpout", "udpin", "tcpin", "tcp", "serial", "tlog"]

_SYNTAX = "udpout:, udpin:, tcpin: or tcp:HOST:PORT, serial:DEVICE[:BAUD], or a file ending in .tlog"
_NETWORK: dict[str, Kind] = {"udpout": "udpout", "udpin": "udpin", "tcpin": "tcpin", "tcp": "tcp", "tcpout": "tcp"}
_DEFAULT_BAUD = 57600  # of telemetry radios
_MAX_BAUD = 4_000_000


@dataclass(frozen=True)
class Endpoint:
    """A network address, serial device or log file."""

    # `host` and `port` are for networks, the host as an IPv4 address; `path` is that of a serial device, with its
    # `baud`, or of a file. `text` is the user's text.

    kind: Kind
    text: str
    host: str = ""
    port: int = 0
    path: str = ""
    baud: int = 0


def parse_endpoint(text: str, allow_remote: bool = False) -> Endpoint:
    """Parse an endpoint such as ``udpout:127.0.0.1:14550``.

    ``udpout`` and ``tcp`` send to an address, ``udpin`` and ``tcpin`` listen on one. The spellings with ``//``
    (``udpin://127.0.0.1:14550``, ``tcpout://``, ``serial:///dev/ttyUSB0:57600``) mean the same.

    Parameters
    ----------
    text : str
        Endpoint in the notation of pymavlink, MAVProxy or MAVSDK.
    allow_remote : bool
        True to accept addresses beyond this machine, to send to or listen on: MAVLink is not encrypted.

    Returns
    -------
    Endpoint
        The endpoint, with its host resolved to an address.

    Raises
    ------
    TelemetryError
        If the text is invalid, the address is beyond this machine and not allowed, or the file exists.

    Examples
    --------
    >>> import cosim
    >>> cosim.parse_endpoint("udpout:127.0.0.1:14550").port
    14550
    """
    if text.endswith(".tlog"):
        return Endpoint("tlog", text, path=_require_new_file(text))
    kind, _, rest = text.partition(":")
    rest = rest.removeprefix("//")
    if kind == "serial":
        device, baud = _parse_serial(text, rest)
        return Endpoint("serial", text, path=device, baud=baud)
    if kind not in _NETWORK:
        raise TelemetryError(f"endpoint {text!r}: expected {_SYNTAX}")
    host, _, port = rest.rpartition(":")
    if not host or not (port.isascii() and port.isdecimal() and 0 < int(port[:6]) < 65536):
        raise TelemetryError(f"endpoint {text!r}: expected {kind}:HOST:PORT, such as {kind}:127.0.0.1:14550")
    return Endpoint(_NETWORK[kind], text, host=_resolve(text, host, allow_remote), port=int(port))


def _resolve(text: str, host: str, allow_remote: bool) -> str:
    """Return the IPv4 address of a host; raise for other machines unless they are allowed."""
    try:
        address, is_loopback = resolve_host(host)
    except OSError as error:
        raise TelemetryError(f"endpoint {text!r}: host {host!r} is not known: {error}") from error
    if not (allow_remote or is_loopback):
        raise TelemetryError(f"endpoint {text!r}: {address} is beyond this machine; --allow-remote lets it through")
    return address


def _parse_serial(text: str, rest: str) -> tuple[str, int]:
    device, colon, baud = rest.rpartition(":")
    if not colon:
        device, baud = rest, str(_DEFAULT_BAUD)
    if not device or not (baud.isascii() and baud.isdecimal() and 0 < int(baud[:8]) <= _MAX_BAUD):
        raise TelemetryError(f"endpoint {text!r}: expected serial:DEVICE[:BAUD], such as serial:/dev/ttyUSB0:57600")
    return device, int(baud)


def _require_new_file(text: str) -> str:
    path = Path(text)
    try:
        path.stat()  # Path.exists is False from Python 3.14 on, whatever the error
    except (FileNotFoundError, NotADirectoryError):
        if not path.parent.is_dir():
            raise TelemetryError(f"endpoint {text!r}: there is no folder {str(path.parent)!r}") from None
        return text
    except (OSError, ValueError) as error:  # such as a name that is too long, or has a null in it
        raise TelemetryError(f"endpoint {text!r}: {getattr(error, 'strerror', None) or error}") from error
    raise TelemetryError(f"endpoint {text!r}: the file exists; a log is never overwritten")
