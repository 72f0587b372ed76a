"""Telemetry: decoded by pymavlink, and without any effect on the run."""

import socket
import threading
import time

import numpy as np
import pytest

from cosim.errors import TelemetryError
from cosim.record import load_record
from cosim.run import run_scenario
from cosim.scenario import load_scenario
from cosim.signals import Column, Signals
from cosim.telemetry import Telemetry, parse_endpoint

mavlink = pytest.importorskip("pymavlink.dialects.v20.all", reason="the mavlink extra is not installed")

SCENARIO = ["arbiter.engine=closed", "time.duration=5"]


class Listener:
    """Takes every datagram that comes to a port of its own."""

    def __enter__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.2)
        self.address = self.socket.getsockname()
        self.datagrams, self.done = [], False
        self.thread = threading.Thread(target=self.listen)
        self.thread.start()
        return self

    def listen(self):
        while True:
            try:
                self.datagrams.append(self.socket.recv(1024))
            except TimeoutError:
                if self.done:
                    return

    def __exit__(self, *_):
        self.done = True
        self.thread.join()
        self.socket.close()

    def messages(self):
        parser = mavlink.MAVLink(None)
        found = []
        for datagram in self.datagrams:
            assert datagram[0] == 0xFD  # MAVLink 2
            found += parser.parse_buffer(datagram)
        return found


@pytest.fixture(scope="module")
def streamed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("streamed")
    with Listener() as listener:
        run = run_scenario(load_scenario("paper-limited", SCENARIO), folder / "run", mavlink=listener.address)
    return run, listener.messages()


def of_type(messages, name):
    return [m for m in messages if m.get_type() == name]


@pytest.mark.slow
def test_every_promised_message_comes_at_its_rate(streamed):
    _, messages = streamed
    assert len(of_type(messages, "HEARTBEAT")) >= 2
    assert len(of_type(messages, "SYSTEM_TIME")) == 6
    for name in ("ATTITUDE", "ATTITUDE_QUATERNION", "LOCAL_POSITION_NED"):
        assert [m.time_boot_ms for m in of_type(messages, name)] == list(range(0, 5001, 100))
    names = {m.name for m in of_type(messages, "NAMED_VALUE_FLOAT")}
    assert names == {"w_obstacle", "w_shape", "w_depth", "phi1", "phi2", "phi3", "phi4"}


def test_heartbeat_is_an_honest_submarine(streamed):
    _, messages = streamed
    beat = of_type(messages, "HEARTBEAT")[0]
    assert beat.type == mavlink.MAV_TYPE_SUBMARINE
    assert beat.autopilot == mavlink.MAV_AUTOPILOT_GENERIC
    assert beat.system_status == mavlink.MAV_STATE_ACTIVE
    assert of_type(messages, "HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_STANDBY  # goodbye
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in messages} == {(1, 1)}


def test_no_frame_is_lost_or_repeated(streamed):
    _, messages = streamed
    sequence = [m.get_seq() for m in messages]
    assert all((b - a) % 256 == 1 for a, b in zip(sequence, sequence[1:], strict=False))


def test_values_are_those_of_the_record(streamed):
    run, messages = streamed
    record = load_record(run.folder)
    rows = [m.time_boot_ms for m in of_type(messages, "LOCAL_POSITION_NED")]  # 1 ms steps
    for message, row in zip(of_type(messages, "LOCAL_POSITION_NED"), rows, strict=True):
        assert [message.x, message.y, message.z] == pytest.approx(
            [record[f"position.{a}"][row] for a in "xyz"], abs=1e-5
        )
        if row:  # velocity in the world is the slope of position
            slope = [(record[f"position.{a}"][row] - record[f"position.{a}"][row - 1]) / 1e-3 for a in "xyz"]
            assert [message.vx, message.vy, message.vz] == pytest.approx(slope, abs=2e-3)
    for message, row in zip(of_type(messages, "ATTITUDE_QUATERNION"), rows, strict=True):
        expected = [record[f"quaternion.e{i}"][row] for i in range(4)]
        assert [message.q1, message.q2, message.q3, message.q4] == pytest.approx(expected, abs=1e-6)
    for message, row in zip(of_type(messages, "ATTITUDE"), rows, strict=True):
        assert message.pitch == pytest.approx(record["attitude.pitch"][row], abs=1e-6)
        assert message.pitchspeed == pytest.approx(record["velocity.q"][row], abs=1e-6)
    phi1 = [m.value for m in of_type(messages, "NAMED_VALUE_FLOAT") if m.name == "phi1"]
    assert phi1 == pytest.approx(record["estimate.phi1"][rows].tolist(), abs=1e-4)


def test_the_record_is_bit_identical_with_telemetry_on_or_off(streamed, shipped_run):
    on, off = load_record(streamed[0].folder), load_record(shipped_run("paper-limited", *SCENARIO).folder)
    assert list(on.units) == list(off.units)
    for name in on.units:
        assert np.array_equal(on[name], off[name]), name


def signals():
    names = ["time", *(f"position.{a}" for a in "xyz"), *(f"quaternion.e{i}" for i in range(4)),
             *(f"velocity.{a}" for a in "uvwpqr"), "attitude.roll", "attitude.pitch", "attitude.yaw",
             "weight.obstacle", "weight.shape", "weight.depth", *(f"estimate.phi{i}" for i in range(1, 5))]  # fmt: skip
    return Signals([Column(name, "", "") for name in names])


def test_wild_values_neither_stop_the_thread_nor_the_stepper():
    with Listener() as listener:
        telemetry = Telemetry(listener.address, signals(), 0.1)
        telemetry.start()
        for k, value in enumerate([0.0, np.nan, np.inf, -np.inf, 1e300, -1e300, 1e39, 1.0]):
            row = np.full(24, value)
            row[0] = k * 1e7  # beyond what 32 bits of milliseconds hold
            telemetry.observe(k, row)
        row[4:8] = [1.0, 0.0, 0.0, 0.0]
        row[8] = 1e39  # beyond a float32, also after the rotation
        telemetry.observe(8, row)
        row[0] = np.nan  # this one cannot be sent
        telemetry.observe(9, row)
        row[:] = 0.0
        telemetry.observe(10, row)
        telemetry.close()
    assert len(of_type(listener.messages(), "LOCAL_POSITION_NED")) == 10
    assert telemetry.failed == 1


def test_nobody_listening_is_no_trouble():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        address = probe.getsockname()
    telemetry = Telemetry(address, signals(), 0.1)
    telemetry.start()
    for k in range(200):
        telemetry.observe(k, np.zeros(24))
    telemetry.close()


def test_a_stalled_sender_drops_the_oldest_and_says_how_many(monkeypatch, caplog):
    monkeypatch.setattr(Telemetry, "_send_queued", lambda self: None)
    telemetry = Telemetry(("127.0.0.1", 9), signals(), 0.1)
    telemetry.start()
    for k in range(5000):
        telemetry.observe(k, np.zeros(24))
    assert telemetry.dropped == 5000 - 4096
    telemetry.close()
    assert "904 snapshots dropped" in caplog.text


def test_heartbeat_goes_by_the_wall_clock(monkeypatch):
    """However slowly rows come; a twentieth of a second stands for one here."""
    monkeypatch.setattr("cosim.telemetry.HEARTBEAT_PERIOD", 0.05)
    with Listener() as listener:
        telemetry = Telemetry(listener.address, signals(), 0.1)
        telemetry.start()
        for k in range(10):  # rows that come just too often for silence
            telemetry.observe(k, np.zeros(24))
            time.sleep(0.04)
        telemetry.close()
    assert len(of_type(listener.messages(), "HEARTBEAT")) >= 5


def test_endpoints():
    assert parse_endpoint("udpout:127.0.0.1:14550") == ("127.0.0.1", 14550)
    assert parse_endpoint("udpout:localhost:1") == ("127.0.0.1", 1)
    assert parse_endpoint("udpout:192.0.2.1:14550", allow_remote=True) == ("192.0.2.1", 14550)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("127.0.0.1:14550", "udpout:HOST:PORT"),
        ("udpout:127.0.0.1", "udpout:HOST:PORT"),
        ("udpout:127.0.0.1:99999", "udpout:HOST:PORT"),
        ("tcp:127.0.0.1:5760", "udpout:HOST:PORT"),
        ("", "udpout:HOST:PORT"),
        ("udpout:a..b:14550", "a..b"),
        (f"udpout:{'a' * 70}:14550", "aaa"),
        ("udpout:192.0.2.1:14550", "--allow-remote"),
        ("udpout:0.0.0.0:14550", "--allow-remote"),
    ],
)
def test_endpoints_that_cannot_be_are_refused(text, words):
    with pytest.raises(TelemetryError, match=words):
        parse_endpoint(text)
