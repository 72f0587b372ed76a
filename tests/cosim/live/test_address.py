"""Addresses of the live view, and its accepted hosts and origins."""

import socket

import pytest

from cosim.errors import TelemetryError
from cosim.live.address import LiveAddress, foreign_origin, open_socket, parse_live


def test_an_address_is_a_port_or_a_host_with_one():
    assert parse_live("") == LiveAddress("127.0.0.1", "127.0.0.1", 8765, is_fixed_port=False, is_loopback=True)
    assert parse_live("9000").port == 9000 and parse_live("9000").is_fixed_port
    assert parse_live("localhost:0").ip == "127.0.0.1"
    assert not parse_live("0.0.0.0:9000", allow_remote=True).is_loopback


@pytest.mark.parametrize(
    "text", ["harbour", "127.0.0.1", "127.0.0.1:", ":70000", "70000", "-1", "no.such.host.invalid:1"]
)
def test_invalid_address_is_rejected(text):
    with pytest.raises(TelemetryError, match=r"--live .*expected HOST:PORT or PORT"):
        parse_live(text)


def test_remote_binding_requires_allow_remote():
    with pytest.raises(TelemetryError, match="--allow-remote"):
        parse_live("0.0.0.0:9000")


HERE = LiveAddress("127.0.0.1", "127.0.0.1", 8765)


@pytest.mark.parametrize(
    ("host", "origin", "is_own"),
    [
        ("127.0.0.1:8765", None, True), ("localhost:8765", "http://localhost:8765", True),
        ("[::1]:8765", "http://[::1]:8765", True),
        ("127.0.0.1:9999", "http://127.0.0.1:9999", True),  # through a tunnel
        ("127.0.0.1:8765", "https://evil.example", False),
        ("127.0.0.1:8765", "http://127.0.0.1:8000", False),  # another server of this machine
        ("127.0.0.1:8765", "http://127.0.0.1:8765.evil.example", False),
        ("127.0.0.1:8765", "null", False),  # a file, or a sandboxed frame
        ("evil.example:8765", "http://evil.example:8765", False),  # a name that its owner lets point here
        *((host, None, False) for host in ("127.0.0.1.evil.example:8765", "", None, "[")),
    ],
)  # fmt: skip
def test_own_pages_and_programs_alone_are_accepted(host, origin, is_own):
    assert (foreign_origin(HERE, host, origin) is None) is is_own


def test_remote_host_header_must_be_an_address_or_own_name():
    there = LiveAddress("0.0.0.0", "0.0.0.0", 8765, is_loopback=False)
    assert foreign_origin(there, "192.0.2.7:8765", "http://192.0.2.7:8765") is None
    assert foreign_origin(there, f"{socket.gethostname()}:8765", None) is None
    assert foreign_origin(there, "evil.example:8765", None)


def test_occupied_port_is_an_error_only_if_requested():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(TelemetryError, match=f"127.0.0.1:{port} cannot be opened"):
            open_socket(LiveAddress(port=port, is_fixed_port=True))
        with open_socket(LiveAddress(port=port)) as other:
            assert other.getsockname()[1] != port
