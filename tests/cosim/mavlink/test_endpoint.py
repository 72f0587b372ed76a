"""Endpoint texts: accepted forms and rejection messages."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.errors import TelemetryError
from cosim.mavlink.wire.endpoint import Endpoint, parse_endpoint

NETWORK = {
    "udpout:127.0.0.1:14550": ("udpout", "127.0.0.1", 14550), "udpout:localhost:1": ("udpout", "127.0.0.1", 1),
    "udpin:127.0.0.2:65535": ("udpin", "127.0.0.2", 65535), "tcpin:127.0.0.1:5760": ("tcpin", "127.0.0.1", 5760),
    "tcp:127.0.0.1:5760": ("tcp", "127.0.0.1", 5760), "udpin://127.0.0.1:14550": ("udpin", "127.0.0.1", 14550),
    "udpout://127.0.0.1:14550": ("udpout", "127.0.0.1", 14550), "tcpout://127.0.0.1:5760": ("tcp", "127.0.0.1", 5760),
    "tcpin://localhost:5760": ("tcpin", "127.0.0.1", 5760),
}  # fmt: skip
SERIAL = {
    "serial:/dev/ttyUSB0": ("/dev/ttyUSB0", 57600), "serial:/dev/ttyUSB0:115200": ("/dev/ttyUSB0", 115200),
    "serial:///dev/ttyACM0:921600": ("/dev/ttyACM0", 921600), "serial:COM7:57600": ("COM7", 57600),
}  # fmt: skip


@pytest.mark.parametrize("text", [*NETWORK, *SERIAL])
def test_endpoints_of_this_machine_are_parsed(text):
    if text in NETWORK:
        kind, host, port = NETWORK[text]
        assert parse_endpoint(text) == Endpoint(kind, text, host=host, port=port)
    else:
        path, baud = SERIAL[text]
        assert parse_endpoint(text) == Endpoint("serial", text, path=path, baud=baud)


def test_log_endpoint_requires_a_new_file(tmp_path):
    path = tmp_path / "dive.tlog"
    assert parse_endpoint(str(path)) == Endpoint("tlog", str(path), path=str(path))
    path.touch()
    with pytest.raises(TelemetryError, match="the file exists"):
        parse_endpoint(str(path))
    with pytest.raises(TelemetryError, match="there is no folder"):
        parse_endpoint(str(tmp_path / "none" / "dive.tlog"))
    with pytest.raises(TelemetryError, match=r"endpoint 'x+ \.\.\. x+\.tlog': .*too long"):
        parse_endpoint("x" * 300 + ".tlog")


def test_remote_endpoints_require_allow_remote():
    for text in ("udpout:192.0.2.1:14550", "udpin://0.0.0.0:14550", "tcpin:0.0.0.0:5760", "tcp:192.0.2.1:5760"):
        with pytest.raises(TelemetryError, match="beyond this machine; --allow-remote"):
            parse_endpoint(text)
        assert parse_endpoint(text, allow_remote=True).text == text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "udpout:, udpin:, tcpin: or tcp:HOST:PORT, serial:"),
        ("127.0.0.1:14550", "udpout:, udpin:"),
        ("udp:127.0.0.1:14550", "udpout:, udpin:"),
        ("http://127.0.0.1:14550", "udpout:, udpin:"),
        ("udpout:127.0.0.1", "expected udpout:HOST:PORT, such as udpout:127.0.0.1:14550"),
        ("udpin::14550", "expected udpin:HOST:PORT"),
        ("udpin://:14550", "expected udpin:HOST:PORT"),
        ("tcpin:127.0.0.1:0", "expected tcpin:HOST:PORT"),
        ("tcpin:127.0.0.1:99999", "expected tcpin:HOST:PORT"),
        ("tcpin:127.0.0.1:65536", "expected tcpin:HOST:PORT"),
        ("udpout:127.0.0.1:١٢٣", "expected udpout:HOST:PORT"),
        ("udpout:127.0.0.1:" + "1" * 5000, "expected udpout:HOST:PORT"),
        ("udpout:a..b:14550", "a..b"),
        (f"udpout:{'a' * 70}:14550", "aaa"),
        ("udpout:::1:14550", "is not known"),
        ("serial:", "expected serial:DEVICE"),
        ("serial:/dev/ttyUSB0:", "expected serial:DEVICE"),
        ("serial:/dev/ttyUSB0:fast", "expected serial:DEVICE"),
        ("serial::57600", "expected serial:DEVICE"),
    ],
)
def test_invalid_endpoints_are_rejected(text, words):
    with pytest.raises(TelemetryError, match=words) as caught:
        parse_endpoint(text)
    assert repr(text)[:30] in str(caught.value)  # of a long one the middle is left out
    assert "\n" not in str(caught.value)


@given(st.text(max_size=40).map("udpout:".__add__) | st.text(max_size=40) | st.from_regex(r"[a-z]{3,7}:(//)?\d+:\w*"))
def test_any_text_is_parsed_or_rejected(text):
    try:
        found = parse_endpoint(text)
    except TelemetryError:
        return
    assert found.text == text
