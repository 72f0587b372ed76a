"""The thread of all links: isolation of the stepper, the vehicle and each peer."""

import socket
import threading
import time

import numpy as np
import pytest

from cosim.mavlink import thread
from cosim.mavlink.channels.tcp import TcpIn
from cosim.mavlink.channels.tlog_file import Tlog
from cosim.mavlink.channels.udp import UdpIn
from cosim.mavlink.thread import LinkThread
from cosim.mavlink.wire import link as link_module
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.link import open_links
from cosim.mavlink.wire.options import MavlinkOptions
from tests.cosim.mavlink.stubs import (
    KEY,
    Station,
    StubVehicle,
    attitude,
    heartbeat,
    link_of,
    mavlink,
    odometry,
    read_log,
    udp_link,
    until,
)

HERE = "127.0.0.1"


class GroundSocket:
    """A ground station's socket."""

    def __init__(self, station=None):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.bind((HERE, 0))
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]
        self.station, self.messages = station or Station(), []

    def receive(self):
        while True:
            try:
                data, self.address = self.socket.recvfrom(2048)
            except BlockingIOError:
                return self.messages
            self.messages += self.station.parse(data)

    def send(self, message):
        self.socket.sendto(self.station.pack(message), self.address)

    def count(self, name):
        return sum(m.get_type() == name for m in self.receive())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()


def row(t):
    return np.array([t, 1.0, 2.0])


def started(*links, vehicle=None, step=0.01):
    """Start a thread of links; return its vehicle and the thread."""
    vehicle = vehicle or StubVehicle()
    running = LinkThread(vehicle, links, step)
    running.start()
    return vehicle, running


def test_snapshots_are_ordered_copies_every_10_ms():
    with GroundSocket() as ground:
        vehicle, links = started(udp_link(ground.port), step=1e-3)
        shared = row(0.0)
        for k in range(1001):
            shared[0] = k * 1e-3
            links.observe(k, shared)
        links.close()
        assert [r[0] for r in vehicle.rows] == pytest.approx(np.arange(101) * 0.01)
        assert [m.time_boot_ms for m in ground.receive()[:-1]] == [int(t * 1000) for t in np.arange(1001)[::10] * 1e-3]
        assert ground.messages[-1].get_type() == "HEARTBEAT" and vehicle.closed
        sequence = [m.get_seq() for m in ground.messages]
        assert all((b - a) % 256 == 1 for a, b in zip(sequence, sequence[1:], strict=False))


def test_every_row_of_a_coarse_run_is_observed():
    vehicle = StubVehicle()
    links = LinkThread(vehicle, [], step=0.05)
    for k in range(5):
        links.observe(k, row(k * 0.05))
    links.start()
    links.close()
    assert len(vehicle.rows) == 5


def test_requests_are_answered_while_the_simulation_is_paused():
    with GroundSocket() as ground:
        vehicle, links = started(udp_link(ground.port), step=1e-3)
        links.observe(0, row(0.0))
        assert until(ground.receive)
        ground.send(heartbeat())
        assert until(lambda: ground.count("COMMAND_ACK") == 1)
        assert until(lambda: vehicle.ticks > 20)
        links.close()
    assert [m.get_type() for m in vehicle.received] == ["HEARTBEAT"]


def test_many_links_at_once_each_with_a_sequence_of_its_own():
    with GroundSocket() as ground, GroundSocket() as other:
        server, udp_in = TcpIn(HERE, 0), UdpIn(HERE, 0)
        _, links = started(udp_link(ground.port), link_of(udp_in), link_of(server), udp_link(other.port))
        other.address = (HERE, udp_in.port)
        other.send(heartbeat())
        with socket.create_connection((HERE, server.port), 60.0) as client:
            assert until(lambda: server.clients and udp_in.peers)
            for k in range(300):
                links.observe(k, row(k * 0.01))
            links.close()
            data = b""
            while chunk := client.recv(1 << 16):
                data += chunk
        tcp_messages = Station().parse(data)
        assert [m.get_seq() for m in tcp_messages] == [i % 256 for i in range(301)]
        assert [m.get_seq() for m in ground.receive()] == [i % 256 for i in range(301)]
        assert other.count("ATTITUDE") == 600 and other.count("COMMAND_ACK") == 1


def test_log_holds_sent_and_accepted_frames(tmp_path):
    path = tmp_path / "dive.tlog"
    with GroundSocket() as ground:
        vehicle, links = started(udp_link(ground.port), link_of(Tlog(str(path))))
        links.observe(0, row(0.0))
        assert until(ground.receive)
        ground.send(heartbeat())
        assert until(lambda: vehicle.received)
        for k in range(1, 1001):  # ten seconds in no time
            links.observe(k, row(k * 0.01))
        links.close()
    messages = read_log(path)
    ours = [m for m in messages if m.get_type() == "ATTITUDE"]
    assert [m._timestamp - ours[0]._timestamp for m in ours] == pytest.approx(np.arange(1001) * 0.01, abs=1e-4)
    assert [m.get_srcSystem() for m in messages if m.get_type() == "HEARTBEAT"] == [255, 1]
    assert all(b._timestamp >= a._timestamp for a, b in zip(messages, messages[1:], strict=False))


DEFECTS = {"observe": ZeroDivisionError, "receive": KeyError, "tick": RuntimeError, "attach": ValueError}


class Clumsy(StubVehicle):
    """Raises another error from each of its methods."""

    def __getattribute__(self, name):
        method = super().__getattribute__(name)

        def fail(*arguments):
            method(*arguments)
            raise DEFECTS[name](name)

        return fail if name in DEFECTS else method


def test_vehicle_errors_are_logged_once_per_kind_and_isolated(caplog):
    with GroundSocket() as ground:
        vehicle, links = started(udp_link(ground.port), vehicle=Clumsy())
        for k in range(50):
            links.observe(k, row(k * 0.01))
        assert until(lambda: len(vehicle.rows) == 50 and ground.count("ATTITUDE") == 50)
        for _ in range(5):
            ground.send(heartbeat())
        assert until(lambda: len(vehicle.received) == 5)
        links.close()
    tracebacks = [record.message for record in caplog.records if record.exc_info]
    assert sorted(tracebacks) == sorted(f"MAVLink: {error.__name__} in {name}" for name, error in DEFECTS.items())
    assert "50 times ZeroDivisionError in observe; 5 times KeyError in receive" in caplog.text.replace(
        f"{links.failures['RuntimeError in tick']} times RuntimeError in tick; ", ""
    )


def test_unencodable_messages_are_counted_without_sequence_gap(caplog):
    text = mavlink.MAVLink_statustext_message(6, b"")
    text._text_raw = "letters where bytes belong"
    with GroundSocket() as ground:
        link = udp_link(ground.port)
        for bad in (
            attitude(-1),  # struct.error
            attitude(1.5),
            attitude(2**32),
            mavlink.MAVLink_attitude_message(1, 1e300, 0, 0, 0, 0, 0),  # OverflowError
            mavlink.MAVLink_actuator_output_status_message(1, 1, [0.0] * 3),  # IndexError
            mavlink.MAVLink_attitude_message(1, None, 0, 0, 0, 0, 0),
            text,  # TypeError
        ):
            assert not link.send(bad)
            assert link.send(attitude(1))
        link.channel.close()
        assert [m.get_seq() for m in ground.receive()] == list(range(7))
    assert link.unencodable == 7
    assert link.loss_reports() == ["7 messages that could not be encoded"]
    assert len(caplog.records) == 3  # one a kind of message


def test_a_budget_thins_streams_before_answers(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(link_module.time, "monotonic", lambda: clock[0])
    with GroundSocket() as ground:
        link = udp_link(ground.port, budget=10_000.0)
        sent = [link.send(odometry(1)) for _ in range(100)]  # 24.5 kB at once
        assert 10 < sent.count(True) < 5000 / 245 and link.dropped == sent.count(False)
        assert all(link.send(mavlink.MAVLink_command_ack_message(1, 0)) for _ in range(20))
        assert not all(link.send(mavlink.MAVLink_command_ack_message(1, 0)) for _ in range(100))
        assert not link.has_room()
        clock[0] += 0.25
        assert link.has_room() and link.send(odometry(1))
        link.channel.close()
        assert link.loss_reports() == [f"{link.dropped} messages over the budget"]
        sequence = [m.get_seq() for m in ground.receive()]
    assert sequence == list(range(len(sequence)))


def test_stalled_thread_drops_oldest_snapshots_and_reports_the_count(caplog):
    vehicle = StubVehicle()
    links = LinkThread(vehicle, [], step=0.01)
    for k in range(thread.MAX_SNAPSHOTS + 904):
        links.observe(k, row(k * 0.01))
    assert links.dropped == 904
    links.start()
    links.close()
    assert vehicle.rows[0][0] == pytest.approx(9.04) and len(vehicle.rows) == thread.MAX_SNAPSHOTS
    assert "904 snapshots dropped" in caplog.text


def test_closing_is_time_bounded_and_counts_dropped_snapshots(monkeypatch, caplog):
    monkeypatch.setattr(thread, "_DRAINING", 0.05)
    vehicle = StubVehicle()
    vehicle.observe = lambda row: time.sleep(0.02)
    _, links = started(vehicle=vehicle)
    for k in range(1000):
        links.observe(k, row(k * 0.01))
    links.close()
    links.close()
    assert 900 < links.dropped < 1000 and f"{links.dropped} snapshots dropped" in caplog.text
    assert len(caplog.records) == 1
    assert "mavlink" not in [t.name for t in threading.enumerate()]


def test_unstarted_links_are_closed(tmp_path):
    channel = UdpIn(HERE, 0)
    LinkThread(StubVehicle(), [link_of(channel)], step=0.01).close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind((HERE, channel.port))


def test_endpoints_become_links_of_one_signed_vehicle(tmp_path):
    with GroundSocket(Station(key=KEY)) as ground:
        texts = [f"udpout:127.0.0.1:{ground.port}", str(tmp_path / "dive.tlog")]
        links = open_links([parse_endpoint(text) for text in texts], MavlinkOptions(key=KEY, system_id=9))
        assert [link.name for link in links] == texts
        vehicle, running = started(*links)
        running.observe(0, row(0.0))
        assert until(lambda: ground.count("ATTITUDE"))
        assert ground.messages[0].get_srcSystem() == 9
        assert ground.station.codec.signing.goodsig_count > 0
        ground.send(heartbeat())
        ground.socket.sendto(Station().pack(heartbeat()), ground.address)
        assert until(lambda: links[0].stats.unsigned and vehicle.received)
        running.close()
    assert links[0].loss_reports() == ["1 frames unsigned"]
    assert read_log(texts[1])[0].get_type() == "ATTITUDE"


class Loud(StubVehicle):
    def observe(self, row):
        for link in self.links:
            link.send(odometry(round(row[0] * 100) + 1))


@pytest.mark.medium
def test_a_client_that_never_reads_costs_no_other_client_a_frame():
    server = TcpIn(HERE, 0)
    link = link_of(server)
    _, links = started(link, vehicle=Loud())
    with (
        socket.create_connection((HERE, server.port), 60.0),
        socket.create_connection((HERE, server.port), 60.0) as good,
    ):
        assert until(lambda: len(server.clients) == 2)
        station, messages = Station(), []
        good.settimeout(60.0)
        for k in range(4000):
            links.observe(k, row(k * 0.01))
            while len(messages) + 100 < k:
                messages += station.parse(good.recv(1 << 16))
        closing = threading.Thread(target=links.close)
        closing.start()
        while chunk := good.recv(1 << 16):
            messages += station.parse(chunk)
        closing.join()
    assert links.dropped == 0
    assert [m.time_usec for m in messages if m.get_type() == "ODOMETRY"] == list(range(1, 4001))
    assert any("frames dropped for slow clients" in trouble for trouble in link.loss_reports())
