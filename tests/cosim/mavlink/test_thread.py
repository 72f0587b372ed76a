"""The thread of all links: isolation of the stepper, the vehicle and each peer."""

import contextlib
import itertools
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
from tests.cosim.mavlink import stubs
from tests.cosim.mavlink.stubs import HERE, KEY, Codec, StubVehicle, attitude, heartbeat, link_of, odometry, until


class Ground:
    """A ground station's socket, and what came to it."""

    def __init__(self, codec=None):
        self.socket, self.codec, self.messages = stubs.udp_socket(), codec or Codec(), []
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]

    def receive(self):
        with contextlib.suppress(BlockingIOError):
            while True:
                data, self.address = self.socket.recvfrom(2048)
                self.messages += self.codec.parse(data)
        return self.messages

    def send(self, message, codec=None):
        self.socket.sendto((codec or self.codec).pack(message), self.address)

    def count(self, name):
        return sum(m.get_type() == name for m in self.receive())

    def sequence(self):
        return [m.get_seq() for m in self.receive()]


@pytest.fixture
def ground():
    return Ground()


def row(t):
    return np.array([t, 1.0, 2.0])


def observe(links, *steps, step=0.01):
    for k in steps:
        links.observe(k, row(k * step))


def started(*links, vehicle=None, step=0.01):
    """Start a thread of links; return its vehicle and the thread."""
    vehicle = vehicle or StubVehicle()
    running = LinkThread(vehicle, links, step)
    running.start()
    return vehicle, running


def test_snapshots_are_ordered_copies_every_10_ms(ground):
    vehicle, links = started(stubs.udp_link(ground.port), step=1e-3)
    shared = row(0.0)
    for k in range(1001):
        shared[0] = k * 1e-3
        links.observe(k, shared)
    links.close()
    assert [r[0] for r in vehicle.rows] == pytest.approx(np.arange(101) * 0.01)
    assert [m.time_boot_ms for m in ground.receive()[:-1]] == [int(t * 1000) for t in np.arange(1001)[::10] * 1e-3]
    assert ground.messages[-1].get_type() == "HEARTBEAT" and vehicle.closed
    assert ground.sequence() == list(range(102))


def test_blocks_of_rows_are_logged_whole_like_single_rows(tmp_path, monkeypatch):
    for name, value in (("MAX_SNAPSHOTS", 16), ("_IDLE_PERIOD", 1e-3), ("_FAST_RUN_PERIOD", 1e-3), ("_STALLED", 60.0)):
        monkeypatch.setattr(thread, name, value)
    rows = np.stack([row(k * 0.003) for k in range(1000)])
    vehicles, ends = [], np.cumsum([0, 1, 2, 5, 1, 400, 3, 3, 300, 285])
    for name, bounds in (("rows", range(1001)), ("blocks", ends)):
        vehicle, links = started(link_of(Tlog(str(tmp_path / f"{name}.tlog"))), step=0.003)
        block = np.empty_like(rows)
        for first, end in itertools.pairwise(bounds):
            block[: end - first] = rows[first:end]
            links.observe_block(first, block[: end - first])
            block[:] = np.nan
        links.close()
        assert links.dropped == 0 and len(stubs.read_log(tmp_path / f"{name}.tlog")) == 335
        vehicles.append(vehicle)
    assert np.array_equal(vehicles[0].rows, rows[::3]) and np.array_equal(vehicles[1].rows, rows[::3])


def test_a_stalled_thread_holds_up_a_logged_run_once(tmp_path, monkeypatch):
    monkeypatch.setattr(thread, "MAX_SNAPSHOTS", 16)
    monkeypatch.setattr(thread, "_STALLED", 0.2)
    vehicle, going_on = StubVehicle(), threading.Event()
    vehicle.observe = lambda row: going_on.wait(60.0)
    _, links = started(link_of(Tlog(str(tmp_path / "dive.tlog"))), vehicle=vehicle)
    observe(links, *range(1000))
    assert links.dropped > 900
    going_on.set()
    links.close()


def test_requests_are_answered_while_the_simulation_is_paused(ground):
    vehicle, links = started(stubs.udp_link(ground.port), step=1e-3)
    observe(links, 0)
    assert until(ground.receive)
    ground.send(heartbeat())
    assert until(lambda: ground.count("COMMAND_ACK") == 1 and vehicle.ticks > 20)
    links.close()
    assert [m.get_type() for m in vehicle.received] == ["HEARTBEAT"]


def test_many_links_at_once_each_with_a_sequence_of_its_own(ground):
    other, server, udp_in = Ground(), TcpIn(HERE, 0), UdpIn(HERE, 0)
    _, links = started(stubs.udp_link(ground.port), link_of(udp_in), link_of(server), stubs.udp_link(other.port))
    other.address = (HERE, udp_in.port)
    other.send(heartbeat())
    with socket.create_connection((HERE, server.port), 60.0) as client:
        assert until(lambda: server.clients and udp_in.peers)
        observe(links, *range(300))
        links.close()
        data = b""
        while chunk := client.recv(1 << 16):
            data += chunk
    expected = [i % 256 for i in range(301)]
    assert [m.get_seq() for m in Codec().parse(data)] == expected == ground.sequence()
    assert other.count("ATTITUDE") == 600 and other.count("COMMAND_ACK") == 1


def test_log_holds_sent_and_accepted_frames(ground, tmp_path):
    path = tmp_path / "dive.tlog"
    vehicle, links = started(stubs.udp_link(ground.port), link_of(Tlog(str(path))))
    observe(links, 0)
    assert until(ground.receive)
    ground.send(heartbeat())
    assert until(lambda: vehicle.received)
    observe(links, *range(1, 1001))  # ten seconds in no time
    links.close()
    messages = stubs.read_log(path)
    ours = [m._timestamp for m in messages if m.get_type() == "ATTITUDE"]
    assert np.subtract(ours, ours[0]) == pytest.approx(np.arange(1001) * 0.01, abs=1e-4)
    assert [m.get_srcSystem() for m in messages if m.get_type() == "HEARTBEAT"] == [255, 1]
    assert (np.diff([m._timestamp for m in messages]) >= 0.0).all()


DEFECTS = {"observe": ZeroDivisionError, "receive": KeyError, "tick": RuntimeError, "attach": ValueError}


class Clumsy(StubVehicle):
    """Raises another error from each of its methods."""

    def __getattribute__(self, name):
        method = super().__getattribute__(name)

        def fail(*arguments):
            method(*arguments)
            raise DEFECTS[name](name)

        return fail if name in DEFECTS else method


def test_vehicle_errors_are_logged_once_per_kind_and_isolated(ground, caplog):
    vehicle, links = started(stubs.udp_link(ground.port), vehicle=Clumsy())
    observe(links, *range(50))
    assert until(lambda: len(vehicle.rows) == 50 and ground.count("ATTITUDE") == 50)
    for _ in range(5):
        ground.send(heartbeat())
    assert until(lambda: len(vehicle.received) == 5)
    links.close()
    tracebacks = [record.message for record in caplog.records if record.exc_info]
    assert sorted(tracebacks) == sorted(f"MAVLink: {error.__name__} in {name}" for name, error in DEFECTS.items())
    assert links.failures.pop("RuntimeError in tick") > 0
    assert links.failures == {"ValueError in attach": 1, "ZeroDivisionError in observe": 50, "KeyError in receive": 5}
    assert "50 times ZeroDivisionError in observe; " in caplog.text


def test_unencodable_messages_are_counted_without_sequence_gap(ground, caplog):
    text = stubs.message("STATUSTEXT")
    text._text_raw = "letters where bytes belong"  # TypeError
    bad = [attitude(boot_ms) for boot_ms in (-1, 1.5, 2**32)]  # struct.error
    bad += [stubs.message("ATTITUDE", roll=1e300), stubs.message("ATTITUDE", roll=None), text]  # OverflowError
    bad += [stubs.message("ACTUATOR_OUTPUT_STATUS", actuator=[0.0] * 3)]  # IndexError
    link = stubs.udp_link(ground.port)
    for message in bad:
        assert not link.send(message)
        assert link.send(attitude(1))
    link.channel.close()
    assert ground.sequence() == list(range(7)) and link.unencodable == 7
    assert link.loss_reports() == ["7 messages that could not be encoded"]
    assert len(caplog.records) == 3  # one a kind of message


def test_a_budget_thins_streams_before_answers(ground, monkeypatch):
    clock, ack = [100.0], stubs.message("COMMAND_ACK")
    monkeypatch.setattr(link_module.time, "monotonic", lambda: clock[0])
    link = stubs.udp_link(ground.port, budget=10_000.0)
    sent = [link.send(odometry(1)) for _ in range(100)]  # 24.5 kB at once
    assert 10 < sent.count(True) < 5000 / 245 and link.dropped == sent.count(False)
    assert all(link.send(ack) for _ in range(20))
    assert not all(link.send(ack) for _ in range(100))
    assert not link.has_room()
    clock[0] += 0.25
    assert link.has_room() and link.send(odometry(1))
    link.channel.close()
    assert link.loss_reports() == [f"{link.dropped} messages over the budget"]
    assert ground.sequence() == list(range(len(ground.messages)))


def test_stalled_thread_drops_oldest_snapshots_and_reports_the_count(caplog):
    vehicle = StubVehicle()
    links = LinkThread(vehicle, [], step=0.01)
    observe(links, *range(thread.MAX_SNAPSHOTS + 904))
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
    observe(links, *range(1000))
    links.close()
    links.close()
    assert 900 < links.dropped < 1000 and f"{links.dropped} snapshots dropped" in caplog.text
    assert len(caplog.records) == 1
    assert "mavlink" not in [t.name for t in threading.enumerate()]


def test_unstarted_links_are_closed():
    channel = UdpIn(HERE, 0)
    LinkThread(StubVehicle(), [link_of(channel)], step=0.01).close()
    stubs.udp_socket(channel.port)


def test_endpoints_become_links_of_one_signed_vehicle(tmp_path):
    ground = Ground(Codec(key=KEY))
    texts = [f"udpout:127.0.0.1:{ground.port}", str(tmp_path / "dive.tlog")]
    links = open_links([parse_endpoint(text) for text in texts], MavlinkOptions(key=KEY, system_id=9))
    assert [link.name for link in links] == texts
    vehicle, running = started(*links)
    observe(running, 0)
    assert until(lambda: ground.count("ATTITUDE"))
    assert ground.messages[0].get_srcSystem() == 9 and ground.codec.codec.signing.goodsig_count > 0
    ground.send(heartbeat())
    ground.send(heartbeat(), Codec())
    assert until(lambda: links[0].stats.unsigned and vehicle.received)
    running.close()
    assert links[0].loss_reports() == ["1 frames unsigned"]
    assert stubs.read_log(texts[1])[0].get_type() == "ATTITUDE"


class Loud(StubVehicle):
    def observe(self, row):
        for link in self.links:
            link.send(odometry(round(row[0] * 100) + 1))


@pytest.mark.medium
def test_a_client_that_never_reads_costs_no_other_client_a_frame():
    server = TcpIn(HERE, 0)
    link = link_of(server)
    _, links = started(link, vehicle=Loud())
    address, codec, messages = (HERE, server.port), Codec(), []
    with socket.create_connection(address, 60.0), socket.create_connection(address, 60.0) as good:
        assert until(lambda: len(server.clients) == 2)
        for k in range(4000):
            observe(links, k)
            while len(messages) + 100 < k:
                messages += codec.parse(good.recv(1 << 16))
        closing = threading.Thread(target=links.close)
        closing.start()
        while chunk := good.recv(1 << 16):
            messages += codec.parse(chunk)
        closing.join()
    assert links.dropped == 0
    assert [m.time_usec for m in messages if m.get_type() == "ODOMETRY"] == list(range(1, 4001))
    assert any("frames dropped for slow clients" in trouble for trouble in link.loss_reports())
