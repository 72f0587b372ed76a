"""Channels: each kind against a peer of the standard library or pymavlink."""

import errno
import os
import socket
import time

import pytest
from pymavlink.dialects.v10 import all as v10

from cosim.errors import TelemetryError
from cosim.mavlink.channels import stream, tcp, udp
from cosim.mavlink.channels.serial import Serial
from cosim.mavlink.channels.stream import Stream
from cosim.mavlink.channels.tcp import TcpIn, TcpOut
from cosim.mavlink.channels.tlog_file import Tlog
from cosim.mavlink.channels.udp import UdpIn, UdpOut
from cosim.mavlink.run_links import max_lead
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.link import open_links
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.scenario.scenario import load_scenario
from tests.cosim.mavlink.stubs import (
    Station,
    attitude,
    closed_later,
    free_port,
    heartbeat,
    link_of,
    mavlink,
    odometry,
    read_log,
    send_now,
    udp_socket,
    until,
)

HERE = "127.0.0.1"


def received(link):
    return [message for _, message in link.receive(time.perf_counter() + 60.0)]


# ---- UDP ----


def test_udpout_accepts_only_its_configured_peer_and_answers_in_its_version():
    peer, foreign = udp_socket(), udp_socket()
    link = link_of(UdpOut(*peer.getsockname()))
    send_now(link, heartbeat())
    data, address = peer.recvfrom(1000)
    assert Station().parse(data)[0].get_type() == "HEARTBEAT"
    foreign.sendto(Station().pack(attitude(1)), address)
    peer.sendto(Station().pack(attitude(2)), address)
    assert [m.time_boot_ms for m in received(link)] == [2]
    send_now(link, attitude(3))
    assert peer.recv(1000)[0] == 0xFD
    peer = udp_socket()
    link = link_of(UdpOut(*peer.getsockname()))
    send_now(link, heartbeat())
    peer.sendto(Station().pack(heartbeat(), v1=True), peer.recvfrom(1000)[1])
    received(link)
    send_now(link, attitude(4))
    frame = peer.recv(1000)
    assert frame[0] == 0xFE and v10.MAVLink(None).parse_buffer(frame)[0].time_boot_ms == 4


def test_udpout_survives_absent_peer_and_late_peer_receives_frames():
    port = free_port()
    link = link_of(UdpOut(HERE, port))
    for _ in range(50):
        assert send_now(link, heartbeat())
        assert not received(link)
    late = udp_socket(port)
    send_now(link, attitude(7))
    assert Station().parse(late.recv(1000))[0].time_boot_ms == 7
    link.channel.close()
    assert not link.loss_reports()


def test_udpin_sends_to_peers_with_accepted_frames():
    link = link_of(UdpIn(HERE, 0))
    good, other, bad = udp_socket(), udp_socket(), udp_socket()
    to = (HERE, link.channel.port)
    assert link.send(heartbeat())  # to nobody
    good.sendto(Station().pack(heartbeat()), to)
    other.sendto(Station(254).pack(heartbeat()), to)
    bad.sendto(b"\xfd\xff\x00", to)
    bad.sendto(Station(1, 1).pack(heartbeat()), to)  # as if it were we
    assert until(lambda: not received(link) and len(link.channel.peers) == 2)
    send_now(link, attitude(1))
    assert good.recv(1000) == other.recv(1000)
    bad.setblocking(False)
    with pytest.raises(BlockingIOError):
        bad.recv(1000)


def test_udp_peers_are_answered_in_their_mavlink_version():
    """By MAVLink's specification an old one has neither extensions nor ids above 255; what pymavlink 1.0 decodes."""
    link, old_side, new_side = link_of(UdpIn(HERE, 0)), Station(), Station(254)
    old, new = udp_socket(), udp_socket()
    to = (HERE, link.channel.port)
    old.sendto(old_side.pack(heartbeat(), v1=True), to)
    new.sendto(new_side.pack(heartbeat()), to)
    assert until(lambda: not received(link) and len(link.channel.peers) == 2)
    rates = mavlink.MAVLink_scaled_imu2_message(5, 1, 2, 3, 4, 5, 6, 7, 8, 9, temperature=1234)
    for message in (attitude(1), mavlink.MAVLink_current_mode_message(0, 4, 4), rates):
        link.send(message)
    link.channel.poll(time.monotonic())
    data = old.recv(1000)
    assert data[0] == 0xFE
    decoded = v10.MAVLink(None).parse_buffer(data)
    assert [(m.get_type(), m.get_seq()) for m in decoded] == [("ATTITUDE", 0), ("SCALED_IMU2", 1)]
    assert decoded[0].time_boot_ms == 1 and decoded[1].zmag == 9
    packet = new.recv(1000)
    assert packet[0] == 0xFD and [m.get_seq() for m in Station().parse(packet)] == [0, 1, 2]
    old.sendto(old_side.pack(heartbeat()), to)  # it can speak the newer one after all
    received(link)
    send_now(link, heartbeat())
    assert old.recv(1000)[0] == 0xFD


@pytest.mark.parametrize("is_server", [False, True])
def test_datagrams_of_both_versions_hold_at_most_1000_bytes(is_server):
    """Frames of MAVLink 1 keep the trailing zeros that those of MAVLink 2 lose."""
    peer = udp_socket()
    link = link_of(UdpIn(HERE, 0) if is_server else UdpOut(*peer.getsockname()))
    if not is_server:
        send_now(link, heartbeat())
    address = (HERE, link.channel.port) if is_server else peer.recvfrom(1000)[1]
    peer.sendto(Station().pack(heartbeat(), v1=True), address)
    assert until(lambda: received(link))
    for _ in range(10):
        link.send(mavlink.MAVLink_file_transfer_protocol_message(0, 255, 190, bytes(251)))
    link.channel.close()
    sizes = [len(peer.recv(65536)) for _ in range(4)]
    assert sum(sizes) == 10 * (8 + 254) and max(sizes) <= 1000


def test_tcp_client_is_answered_in_its_mavlink_version():
    link = link_of(TcpIn(HERE, 0))
    (side,) = connected(link.channel)
    side.sendall(Station().pack(heartbeat(), v1=True))
    assert until(lambda: received(link))
    send_now(link, attitude(3))
    assert v10.MAVLink(None).parse_buffer(side.recv(1000))[0].time_boot_ms == 3
    side.close()


def test_peer_count_is_bounded_and_silent_peers_expire():
    link, sockets = link_of(UdpIn(HERE, 0)), [udp_socket() for _ in range(udp.MAX_PEERS + 2)]
    for one in sockets:
        one.sendto(Station().pack(heartbeat()), (HERE, link.channel.port))
    assert len(received(link)) == len(sockets)  # all are accepted, though not all can be answered
    assert len(link.channel.peers) == udp.MAX_PEERS
    assert link.loss_reports() == ["2 frames of peers beyond 8"]
    now = time.monotonic()
    link.channel.poll(now)
    assert len(link.channel.peers) == udp.MAX_PEERS
    link.channel.poll(now + udp.PEER_TIMEOUT + 1.0)
    assert not link.channel.peers


def test_occupied_ports_give_one_line_error():
    udp_in, tcp_in = UdpIn(HERE, 0), TcpIn(HERE, 0)
    with pytest.raises(TelemetryError, match=f"udpin:127.0.0.1:{udp_in.port}: Address already in use"):
        UdpIn(HERE, udp_in.port)
    with pytest.raises(TelemetryError, match=f"tcpin:127.0.0.1:{tcp_in.port}: Address already in use"):
        TcpIn(HERE, tcp_in.port)
    tcp_in.close()
    endpoints = [Endpoint("udpin", "a", HERE, 0), Endpoint("udpin", "b", HERE, udp_in.port)]
    with pytest.raises(TelemetryError):
        open_links(endpoints, MavlinkOptions())
    udp_in.close()


# ---- TCP ----


def connected(channel, clients=1):
    found = [closed_later(socket.create_connection((HERE, channel.port), 60.0)) for _ in range(clients)]
    assert until(lambda: channel.poll(time.monotonic()) or len(channel.clients) == clients)
    return found


def frames_of(data):
    """Return the messages of a stream, none of which is torn."""
    messages = Station().parse(data)
    assert not [m for m in messages if m.get_type() == "BAD_DATA"]
    return messages


def test_server_receives_from_all_clients():
    link = link_of(TcpIn(HERE, 0))
    a, b = connected(link.channel, 2)
    send_now(link, attitude(1))
    assert a.recv(1000) == b.recv(1000)
    pieces = Station().pack(attitude(5)), Station(254).pack(attitude(6))
    a.sendall(pieces[0][:20])
    b.sendall(pieces[1][:11])  # streams do not mix
    assert not received(link)
    a.sendall(pieces[0][20:])
    b.sendall(pieces[1][11:])
    assert sorted(m.time_boot_ms for m in received(link) + received(link)) == [5, 6]


@pytest.mark.parametrize("resets", [False, True])
def test_disconnected_client_is_removed(resets):
    link = link_of(TcpIn(HERE, 0))
    for _ in range(3):
        (client,) = connected(link.channel)
        if resets:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\x00\x00\x00\x00\x00\x00\x00")
        client.close()
        for i in range(20 * resets):
            send_now(link, attitude(i))
        # a reset shows in writing alone, with nothing read
        assert until(
            lambda: not ((not resets and received(link)) or link.channel.poll(time.monotonic()) or link.channel.clients)
        )
    assert link.send(heartbeat())


def test_a_broken_stream_is_no_slow_one():
    def broken(data):
        raise ConnectionResetError

    stream = Stream(lambda n: b"", broken, lambda: None)
    assert [stream.put(bytes(5000)) for _ in range(30)] == [True] + [False] * 29
    assert not stream.is_open and stream.dropped == 0


def test_excess_clients_are_rejected():
    link = link_of(TcpIn(HERE, 0))
    clients = connected(link.channel, tcp.MAX_CLIENTS)
    with socket.create_connection((HERE, link.channel.port), 2.0) as extra:
        assert until(lambda: link.channel.poll(time.monotonic()) or link.loss_reports())
        assert extra.recv(100) == b""
    assert link.loss_reports() == ["1 clients beyond 8 turned away"]
    clients[0].close()
    assert until(
        lambda: (
            received(link) or link.channel.poll(time.monotonic()) or len(link.channel.clients) == tcp.MAX_CLIENTS - 1
        )
    )


def test_stalled_client_is_closed_after_a_timeout():
    link = link_of(TcpIn(HERE, 0))
    (client,) = connected(link.channel)
    while link.send(odometry()):
        pass
    now = time.monotonic()
    for i in range(100):  # s: the kernel may yet take a little, now and then
        link.channel.poll(now + i)
    assert not link.channel.clients
    assert "1 clients closed that took nothing" in link.loss_reports()
    client.close()


def test_send_timeout_restarts_with_progress():
    out = Stream(None, Taker([None, None, None, 2, None, None, None]), None)
    out.put(b"frame")
    assert out.flush(10.0)
    assert out.flush(10.0 + stream.STALL_TIME - 0.1)
    assert not out.flush(10.0 + stream.STALL_TIME + 0.1)
    assert out.flush(20.0)  # two bytes are taken
    assert out.flush(21.0)
    assert out.flush(21.0 + stream.STALL_TIME - 0.1)
    assert not out.flush(21.0 + stream.STALL_TIME)


class Taker:
    """Takes a few bytes at a time, or fails."""

    def __init__(self, sizes):
        self.sizes, self.taken = list(sizes), b""

    def __call__(self, data):
        size = self.sizes.pop(0) if self.sizes else len(data)
        if size is None:
            raise BlockingIOError
        self.taken += data[:size]
        return len(data[:size])


def test_partially_sent_frames_arrive_complete():
    taker = Taker([3, None, 5, None, 1, 1000])
    out = Stream(None, taker, None, limit=100)
    frames = [bytes([i]) * 30 for i in range(6)]
    kept = [frame for frame in frames if out.put(frame)]
    assert out.dropped == len(frames) - len(kept) > 0
    for _ in range(10):
        assert out.flush(0.0)
    assert taker.taken == b"".join(kept)


def test_tcp_client_waits_for_its_server_and_reconnects_after_a_restart(monkeypatch):
    monkeypatch.setattr(tcp, "_RETRY_PERIOD", 0.0)
    port = free_port()
    link = link_of(TcpOut(HERE, port))
    assert not send_now(link, attitude(0))  # there is no server yet
    server = socket.create_server((HERE, port))
    assert until(lambda: link.channel.poll(time.monotonic()) or link.channel._stream is not None)
    side, _ = server.accept()
    side.settimeout(60.0)
    send_now(link, attitude(1))
    assert frames_of(side.recv(1000))[0].time_boot_ms == 1
    side.sendall(Station().pack(heartbeat()))
    assert until(lambda: received(link))
    server.close()
    side.close()

    def lost():
        received(link)
        link.channel.poll(time.monotonic())
        return link.channel._stream is None

    assert until(lost)
    assert not link.send(attitude(2))
    for _ in range(5):
        lost()  # nobody is there
    with socket.create_server((HERE, port)) as server:
        assert until(lambda: not lost())
        side, _ = server.accept()
        side.settimeout(60.0)
        send_now(link, attitude(3))
        assert frames_of(side.recv(1000))[0].time_boot_ms == 3
        side.close()
    link.channel.close()
    assert link.loss_reports() == ["2 frames dropped while there was no server"]


# ---- serial ----

pty = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")


@pytest.fixture
def line():
    """Yield the other end of a serial line, and a link on it."""
    ours, theirs = os.openpty()
    yield ours, link_of(Serial(os.ttyname(theirs), 57600))
    os.close(ours)
    os.close(theirs)


def come_to(terminal, count, station=None):
    """Return the given number of messages from the other end of a line, which may be slow."""
    os.set_blocking(terminal, False)
    station, found = station or Station(), []

    def look():
        try:
            found.extend(station.parse(os.read(terminal, 4096)))
        except BlockingIOError:
            return False
        return len(found) >= count

    assert until(look)
    return found


@pty
def test_serial_line_is_bidirectional_and_8_bit_clean(line):
    ours, link = line
    for message in (odometry(0x0D0A1113), attitude(0x03040D1A)):  # bytes that terminals like to eat
        send_now(link, message)
    assert [m.get_type() for m in come_to(ours, 2)] == ["ODOMETRY", "ATTITUDE"]
    every = mavlink.MAVLink_encapsulated_data_message(1, list(range(253)))
    frame = Station().pack(every)
    os.write(ours, b"junk" + frame[:100])
    assert not received(link)
    os.write(ours, frame[100:] + Station().pack(heartbeat()))
    found = []
    assert until(lambda: found.extend(received(link)) or len(found) == 2)
    assert [m.get_type() for m in found] == ["ENCAPSULATED_DATA", "HEARTBEAT"]


@pty
def test_blocked_serial_line_drops_whole_frames(line):
    ours, link = line
    sent = [link.send(attitude(i)) for i in range(2000)]
    station, found = Station(), []

    def more():
        link.channel.poll(time.monotonic())
        found.extend(come_to(ours, 1, station))
        return len(found) == sent.count(True)

    assert until(more)
    assert [m.time_boot_ms for m in found] == [i for i, went in enumerate(sent) if went]
    assert 0 < sent.count(True) < len(sent)
    link.channel.close()
    assert link.loss_reports() == [f"{sent.count(False)} frames dropped on a slow line"]


@pty
def test_serial_device_is_reopened_after_disconnection(tmp_path, caplog):
    path = tmp_path / "ttyUSB0"
    ours, theirs = os.openpty()
    path.symlink_to(os.ttyname(theirs))
    link = link_of(Serial(str(path), 115200))
    os.close(theirs)
    os.close(ours)
    path.unlink()
    now = time.monotonic()
    assert until(lambda: received(link) or link.channel.poll(now) or link.channel._stream is None)
    assert not link.send(heartbeat())
    link.channel.poll(now + 2.0)
    assert link.channel._stream is None
    ours, theirs = os.openpty()
    path.symlink_to(os.ttyname(theirs))
    link.channel.poll(now + 4.0)
    assert send_now(link, attitude(9))
    assert come_to(ours, 1)[0].time_boot_ms == 9
    assert [record.message.split(" ", 2)[2] for record in caplog.records] == ["is gone", "is back"]
    os.close(ours)
    os.close(theirs)


@pty
def test_invalid_serial_devices_are_rejected(tmp_path):
    with pytest.raises(TelemetryError, match="serial:/dev/none: No such file"):
        Serial("/dev/none", 57600)
    with pytest.raises(TelemetryError, match=r"baud is 57601, expected one that the system knows, such as .*57600"):
        Serial("/dev/none", 57601)
    (tmp_path / "file").touch()
    with pytest.raises(TelemetryError, match="Inappropriate ioctl"):
        Serial(str(tmp_path / "file"), 57600)


# ---- logs ----


def test_tlog_timestamps_follow_simulation_time(tmp_path):
    path = tmp_path / "dive.tlog"
    before = time.time()
    link = link_of(Tlog(str(path)))
    times = [0.0, 0.5, 1.0, 0.7, float("nan"), float("inf"), 2.0]  # never back
    for t in times:
        link.channel.simulated = t
        assert link.send(attitude(1))
        link.channel.send(Station().pack(heartbeat()))
    link.channel.close()
    found = read_log(path)
    assert [m.get_type() for m in found] == ["ATTITUDE", "HEARTBEAT"] * len(times)
    stamps = [m._timestamp for m in found[::2]]
    assert [s - stamps[0] for s in stamps] == pytest.approx([0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 2.0], abs=1e-5)
    assert before - 0.01 <= stamps[0] <= time.time()
    assert path.stat().st_size % 1 == 0 and path.read_bytes()[8] == 0xFD
    assert not link.loss_reports()


def test_tlog_of_a_fast_run_has_no_future_timestamps(tmp_path):
    path = tmp_path / "fast.tlog"
    link = link_of(Tlog(str(path)))
    link.channel.advance_start(600.0)
    for link.channel.simulated in (0.0, 600.0):
        link.send(attitude(1))
    link.channel.close()
    first, last = (m._timestamp for m in read_log(path))
    assert last - first == pytest.approx(600.0, abs=1e-5) and last <= time.time()  # LogReplayLink.cc, _parseTimestamp


@pytest.mark.parametrize(("rate", "seconds"), [(None, 12.0), (10.0, 12.0), (1.0, 0.0), (0.5, 0.0)])
def test_lead_over_wall_clock_depends_on_duration_and_rate(rate, seconds):
    assert max_lead(load_scenario("paper", ["time.duration=12"]), rate) == seconds


def test_a_log_is_never_overwritten(tmp_path):
    path = tmp_path / "dive.tlog"
    path.write_bytes(b"precious")
    with pytest.raises(TelemetryError, match=r"dive.tlog: File exists"):
        Tlog(str(path))
    assert path.read_bytes() == b"precious"


def test_unused_tlog_leaves_no_file(tmp_path):
    path = tmp_path / "dive.tlog"
    Tlog(str(path)).close()
    assert not path.exists()


class FullDisk:
    """Takes 1000 bytes in pieces, and then no more until it is emptied."""

    def __init__(self, file):
        self.file, self.room = file, 1000

    def write(self, data):
        if not self.room:
            raise OSError(errno.ENOSPC, "No space left on device")
        size = min(len(data), self.room, 77)
        self.room -= size
        return self.file.write(data[:size])

    def close(self):
        self.file.close()


def test_full_disk_is_reported_once_and_truncates_no_frame(tmp_path, caplog):
    path = tmp_path / "dive.tlog"
    channel = Tlog(str(path))
    channel._file = disk = FullDisk(channel._file)
    link = link_of(channel)
    sent = [link.send(odometry(i + 1)) for i in range(5000)]
    assert not sent[-1]  # what waits is bounded
    disk.room = 10**9
    link.channel.close()
    assert [m.time_usec for m in read_log(path)] == [i + 1 for i, went in enumerate(sent) if went]
    assert len(caplog.records) == 1 and "No space left" in caplog.text
    assert any("frames not logged" in trouble for trouble in link.loss_reports())
