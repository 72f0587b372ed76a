"""Endpoint texts: accepted forms and rejection messages."""

import pytest

from cosim.errors import TelemetryError
from cosim.mavlink.wire.endpoint import Endpoint, parse_endpoint

PARSED = {
    **{text: {"kind": kind, "host": host, "port": port} for text, kind, host, port in (
        ("udpout:127.0.0.1:14550", "udpout", "127.0.0.1", 14550), ("udpout:localhost:1", "udpout", "127.0.0.1", 1),
        ("udpin:127.0.0.2:65535", "udpin", "127.0.0.2", 65535), ("tcpin:127.0.0.1:5760", "tcpin", "127.0.0.1", 5760),
        ("tcp:127.0.0.1:5760", "tcp", "127.0.0.1", 5760), ("udpin://127.0.0.1:14550", "udpin", "127.0.0.1", 14550),
        ("udpout://127.0.0.1:14550", "udpout", "127.0.0.1", 14550),
        ("tcpout://127.0.0.1:5760", "tcp", "127.0.0.1", 5760), ("tcpin://localhost:5760", "tcpin", "127.0.0.1", 5760))},
    **{text: {"kind": "serial", "path": path, "baud": baud} for text, path, baud in (
        ("serial:/dev/ttyUSB0", "/dev/ttyUSB0", 57600), ("serial:/dev/ttyUSB0:115200", "/dev/ttyUSB0", 115200),
        ("serial:///dev/ttyACM0:921600", "/dev/ttyACM0", 921600), ("serial:COM7:57600", "COM7", 57600))},
}  # fmt: skip


@pytest.mark.parametrize("text", PARSED)
def test_endpoints_of_this_machine_are_parsed(text):
    assert parse_endpoint(text) == Endpoint(text=text, **PARSED[text])


def test_log_endpoint_requires_a_new_file(tmp_path):
    path = tmp_path / "dive.tlog"
    assert parse_endpoint(str(path)) == Endpoint("tlog", str(path), path=str(path))
    path.touch()
    for text, words in (
        (str(path), "the file exists"), (str(tmp_path / "none" / "dive.tlog"), "there is no folder"),
        ("x" * 300 + ".tlog", r"endpoint 'x+ \.\.\. x+\.tlog': .*too long"),
    ):  # fmt: skip
        with pytest.raises(TelemetryError, match=words):
            parse_endpoint(text)


def test_remote_endpoints_require_allow_remote():
    for text in ("udpout:192.0.2.1:14550", "udpin://0.0.0.0:14550", "tcpin:0.0.0.0:5760", "tcp:192.0.2.1:5760"):
        with pytest.raises(TelemetryError, match="beyond this machine; --allow-remote"):
            parse_endpoint(text)
        assert parse_endpoint(text, allow_remote=True).text == text


INVALID = {
    "udpout:, udpin:, tcpin: or tcp:HOST:PORT, serial:": [
        "", "127.0.0.1:14550", "udp:127.0.0.1:14550", "http://127.0.0.1:14550"],
    "expected udpout:HOST:PORT, such as udpout:127.0.0.1:14550": [
        "udpout:127.0.0.1", "udpout:127.0.0.1:١٢٣", "udpout:127.0.0.1:" + "1" * 5000],
    "expected udpin:HOST:PORT": ["udpin::14550", "udpin://:14550"],
    "expected tcpin:HOST:PORT": ["tcpin:127.0.0.1:0", "tcpin:127.0.0.1:99999", "tcpin:127.0.0.1:65536"],
    "is not known": ["udpout:a..b:14550", f"udpout:{'a' * 70}:14550", "udpout:::1:14550"],
    "expected serial:DEVICE": ["serial:", "serial:/dev/ttyUSB0:", "serial:/dev/ttyUSB0:fast", "serial::57600"],
}  # fmt: skip


@pytest.mark.parametrize(("text", "words"), [(text, words) for words, texts in INVALID.items() for text in texts])
def test_invalid_endpoints_are_rejected(text, words):
    with pytest.raises(TelemetryError, match=words) as caught:
        parse_endpoint(text)
    assert repr(text)[:30] in str(caught.value)  # of a long one the middle is left out
    assert "\n" not in str(caught.value)
