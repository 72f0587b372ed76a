"""Addresses that a user names, and whether other machines see them."""

from __future__ import annotations

import ipaddress
import socket


def resolved(host: str) -> tuple[str, bool]:
    """Return the address of a host.

    Parameters
    ----------
    host : str
        A name, or an address.

    Returns
    -------
    str
        Its IPv4 address.
    bool
        Whether it is of this machine alone.

    Raises
    ------
    OSError
        If it is not known.
    """
    try:
        address = str(socket.getaddrinfo(host, None, socket.AF_INET)[0][4][0])
    except UnicodeError as error:  # a name that no server could be asked for
        raise OSError(str(error)) from error
    return address, ipaddress.ip_address(address).is_loopback
