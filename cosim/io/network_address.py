"""Network addresses of hosts, and whether they are loopback addresses."""

from __future__ import annotations

import ipaddress
import socket


def resolve_host(host: str) -> tuple[str, bool]:
    """Resolve a host to its IPv4 address."""
    try:
        address = str(socket.getaddrinfo(host, None, socket.AF_INET)[0][4][0])
    except UnicodeError as error:  # a name that no DNS query can hold
        raise OSError(str(error)) from error
    return address, ipaddress.ip_address(address).is_loopback
