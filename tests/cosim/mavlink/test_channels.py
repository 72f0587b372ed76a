"""Channels: each kind against a peer of the standard library or pymavlink."""

import errno
import os
import select
import socket
import time

import pytest
from pymavlink.dialects.v10 import all as v10
from pymavlink.dialects.v20 import all as v20

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
from tests.cosim.mavlink import stubs
from tests.cosim.mavlink.stubs import HERE, Codec, attitude, closed_later, heartbeat, link_of, odometry, until

pty = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")


def received(link):
    return [message for _, message in link.receive(time.perf_counter() + 60.0)]


def collect(link, count):
    """Return the messages that a link receives until there are as many."""
    messages = []
    assert until(lambda: messages.extend(received(link)) or len(messages) >= count)
    return messages


def works(link):
    """Let a link's channel read and write; return nothing."""
    received(link)
    link.channel.poll(time.monotonic())


def send_now(link, message):
    """Send a message at once; return whether there was room for it."""
    sent = link.send(message)
    link.channel.poll(time.monotonic())
    return sent


def connected(channel, clients=1):
    sockets = [closed_later(socket.create_connection((HERE, channel.port), 60.0)) for _ in range(clients)]
    assert until(lambda: channel.poll(time.monotonic()) or len(channel.clients) == clients)
    return sockets


class Line:
    """A serial line: the other end's file, and the path of the device."""

    def __init__(self):
        self.end, self._device = os.openpty()
        self.path, self._open = os.ttyname(self._device), True
        closed_later(self)

    def fileno(self):
        return self.end

    def close(self):
        for file in (self.end, self._device) if self._open else ():
            os.close(file)
        self._open = False


def ends(kind):
    """Return a link of a kind, and its peer: a connected socket, or a line."""
    if kind == "serial":
        peer = Line()
        return link_of(Serial(peer.path, 57600)), peer
    if kind == "tcpin":
        link = link_of(TcpIn(HERE, 0))
        return link, *connected(link.channel)
    if kind == "tcp":
        with socket.create_server((HERE, 0)) as server:
            return link_of(TcpOut(*server.getsockname())), closed_later(server.accept()[0])
    peer = stubs.udp_socket()
    link = link_of(UdpIn(HERE, 0) if kind == "udpin" else UdpOut(*peer.getsockname()))
    send_now(link, heartbeat())
    peer.connect((HERE, link.channel.port) if kind == "udpin" else peer.recvfrom(1000)[1])
    return link, peer


def receive_messages(peer, count, parser=None):
    """Receive messages at a peer, as many as `count` or more, none torn; return them and their first byte."""
    parser, messages, data = parser or v20.MAVLink(None), [], b""
    while len(messages) < count:
        assert select.select([peer], [], [], 60.0)[0]
        data += (chunk := os.read(peer.fileno(), 4096))
        messages += parser.parse_buffer(chunk) or ()
    return messages, data[0]


@pytest.mark.parametrize("kind", ["udpout", "udpin", "tcp", "tcpin", pytest.param("serial", marks=pty)])
def test_any_bytes_pass_both_ways_and_a_peer_is_answered_in_its_version(kind):
    """What pymavlink's own dialect of that version decodes; some bytes terminals like to eat."""
    link, peer = ends(kind)
    every, times = stubs.message("ENCAPSULATED_DATA", 1, data=list(range(253))), [0x0D0A1113, 0x03040D1A]
    for v1, dialect in ((True, v10), (False, v20)):
        frame = Codec().pack(every, v1)
        if not link.channel.datagrams:
            os.write(peer.fileno(), b"junk" + frame[:100])
            assert not received(link)
            frame = frame[100:]
        os.write(peer.fileno(), frame + Codec().pack(heartbeat(), v1))
        assert [m.get_type() for m in collect(link, 2)] == ["ENCAPSULATED_DATA", "HEARTBEAT"]
        for boot_ms in times:
            send_now(link, attitude(boot_ms))
        messages, marker = receive_messages(peer, 2, dialect.MAVLink(None))
        assert [m.time_boot_ms for m in messages] == times and marker == (0xFE if v1 else 0xFD)


# ---- UDP ----


def test_udpout_accepts_only_its_configured_peer():
    link, peer = ends("udpout")
    stubs.udp_socket().sendto(Codec().pack(attitude(1)), peer.getpeername())
    peer.send(Codec().pack(attitude(2)))
    assert [m.time_boot_ms for m in collect(link, 1)] == [2]


def test_udpout_survives_absent_peer_and_late_peer_receives_frames():
    port = stubs.free_port()
    link = stubs.udp_link(port)
    for _ in range(50):
        assert send_now(link, heartbeat())
        assert not received(link)
    late = stubs.udp_socket(port)
    send_now(link, attitude(7))
    assert receive_messages(late, 1)[0][0].time_boot_ms == 7
    link.channel.close()
    assert not link.loss_reports()


def test_udpin_answers_peers_with_accepted_frames_each_in_its_version():
    """By MAVLink's specification an old one has neither extensions nor ids above 255."""
    link, (old, new, bad) = link_of(UdpIn(HERE, 0)), [stubs.udp_socket() for _ in range(3)]
    assert send_now(link, heartbeat())  # to nobody
    for peer, data in (
        (old, Codec().pack(heartbeat(), v1=True)), (new, Codec(254).pack(heartbeat())), (bad, b"\xfd\xff\x00"),
        (bad, Codec(1, 1).pack(heartbeat())),  # as if it were we
    ):  # fmt: skip
        peer.sendto(data, (HERE, link.channel.port))
    assert until(lambda: works(link) or len(link.channel.peers) == 2)
    for message in (attitude(1), stubs.message("CURRENT_MODE", 4), stubs.message("SCALED_IMU2", 9)):
        link.send(message)
    works(link)
    messages, _ = receive_messages(old, 2, v10.MAVLink(None))
    assert [(m.get_type(), m.get_seq()) for m in messages] == [("ATTITUDE", 0), ("SCALED_IMU2", 1)]
    assert messages[0].time_boot_ms == 1 and messages[1].zmag == 9
    assert [m.get_seq() for m in receive_messages(new, 3)[0]] == [1, 2, 3]
    assert not select.select([bad], [], [], 0.0)[0]


@pytest.mark.parametrize("kind", ["udpin", "udpout"])
def test_datagrams_of_both_versions_hold_at_most_1000_bytes(kind):
    """Frames of MAVLink 1 keep the trailing zeros that those of MAVLink 2 lose."""
    link, peer = ends(kind)
    peer.send(Codec().pack(heartbeat(), v1=True))
    collect(link, 1)
    for _ in range(10):
        link.send(stubs.message("FILE_TRANSFER_PROTOCOL"))
    link.channel.close()
    sizes = [len(peer.recv(65536)) for _ in range(4)]
    assert sum(sizes) == 10 * (8 + 254) and max(sizes) <= 1000


def test_peer_count_is_bounded_and_silent_peers_expire():
    link, sockets = link_of(UdpIn(HERE, 0)), [stubs.udp_socket() for _ in range(udp.MAX_PEERS + 2)]
    for peer in sockets:
        peer.sendto(Codec().pack(heartbeat()), (HERE, link.channel.port))
    assert len(received(link)) == len(sockets)  # all are accepted, though not all can be answered
    assert len(link.channel.peers) == udp.MAX_PEERS and link.loss_reports() == ["2 frames of peers beyond 8"]
    now = time.monotonic()
    for later, peers in ((0.0, udp.MAX_PEERS), (udp.PEER_TIMEOUT + 1.0, 0)):
        link.channel.poll(now + later)
        assert len(link.channel.peers) == peers


@pytest.mark.parametrize("kind", [UdpIn, TcpIn])
def test_occupied_ports_give_one_line_error(kind):
    channel, name = closed_later(kind(HERE, 0)), kind.__name__.lower()
    with pytest.raises(TelemetryError, match=f"{name}:127.0.0.1:{channel.port}: Address already in use"):
        open_links([Endpoint(name, "a", HERE, 0), Endpoint(name, "b", HERE, channel.port)], MavlinkOptions())


# ---- TCP ----


def test_server_receives_from_all_clients():
    link = link_of(TcpIn(HERE, 0))
    clients = connected(link.channel, 2)
    send_now(link, attitude(1))
    assert clients[0].recv(1000) == clients[1].recv(1000)
    frames = Codec().pack(attitude(5)), Codec(254).pack(attitude(6))
    for cut in (slice(0, 20), slice(20, None)):  # streams do not mix
        assert not received(link)
        for client, frame in zip(clients, frames, strict=True):
            client.sendall(frame[cut])
    assert sorted(m.time_boot_ms for m in collect(link, 2)) == [5, 6]


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
        look = works if not resets else lambda link: link.channel.poll(time.monotonic())
        assert until(lambda look=look: look(link) or not link.channel.clients)
    assert link.send(heartbeat())


def test_excess_clients_are_rejected():
    link = link_of(TcpIn(HERE, 0))
    clients = connected(link.channel, tcp.MAX_CLIENTS)
    with socket.create_connection((HERE, link.channel.port), 2.0) as extra:
        assert until(lambda: works(link) or link.loss_reports())
        assert extra.recv(100) == b""
    assert link.loss_reports() == ["1 clients beyond 8 turned away"]
    clients[0].close()
    assert until(lambda: works(link) or len(link.channel.clients) == tcp.MAX_CLIENTS - 1)


def test_stalled_client_is_closed_after_a_timeout():
    link, client = ends("tcpin")
    while link.send(odometry()):
        pass
    now = time.monotonic()
    for i in range(100):  # s: the kernel may yet take a little, now and then
        link.channel.poll(now + i)
    assert not link.channel.clients and client
    assert "1 clients closed that took nothing" in link.loss_reports()


def test_tcp_client_waits_for_its_server_and_reconnects_after_a_restart(monkeypatch):
    monkeypatch.setattr(tcp, "_RETRY_PERIOD", 0.0)
    port = stubs.free_port()
    link = link_of(TcpOut(HERE, port))

    def is_connected():
        works(link)
        return link.channel._stream is not None

    for boot_ms in (1, 3):
        assert not send_now(link, attitude(0))  # there is no server
        for _ in range(5):
            assert not is_connected()
        with socket.create_server((HERE, port)) as server:
            assert until(is_connected)
            peer = closed_later(server.accept()[0])
            send_now(link, attitude(boot_ms))
            assert receive_messages(peer, 1)[0][0].time_boot_ms == boot_ms
        peer.close()
        assert until(lambda: not is_connected())
    assert link.loss_reports() == ["2 frames dropped while there was no server"]


# ---- streams ----


class Taker:
    """Takes a few bytes at a time, or none for None, or fails."""

    def __init__(self, *sizes):
        self.sizes, self.taken = list(sizes), b""

    def __call__(self, data):
        size = self.sizes.pop(0) if self.sizes else len(data)
        if size is None:
            raise BlockingIOError
        if size < 0:
            raise ConnectionResetError
        self.taken += data[:size]
        return len(data[:size])


def test_a_broken_stream_is_no_slow_one():
    broken = Stream(lambda n: b"", Taker(*[-1] * 30), lambda: None)
    assert [broken.put(bytes(5000)) for _ in range(30)] == [True] + [False] * 29
    assert not broken.is_open and broken.dropped == 0


def test_send_timeout_restarts_with_progress():
    out, late = Stream(None, Taker(None, None, None, 2, None, None, None), None), stream.STALL_TIME
    out.put(b"frame")
    times = (10.0, 10.0 + late - 0.1, 10.0 + late + 0.1, 20.0, 21.0, 21.0 + late - 0.1, 21.0 + late)
    assert [out.flush(at) for at in times] == [True, True, False, True, True, True, False]  # at 20 two bytes are taken


def test_partially_sent_frames_arrive_complete():
    taker = Taker(3, None, 5, None, 1, 1000)
    out = Stream(None, taker, None, limit=100)
    frames = [bytes([i]) * 30 for i in range(6)]
    kept = [frame for frame in frames if out.put(frame)]
    assert out.dropped == len(frames) - len(kept) > 0
    for _ in range(10):
        assert out.flush(0.0)
    assert taker.taken == b"".join(kept)


# ---- serial ----


@pty
def test_blocked_serial_line_drops_whole_frames():
    link, peer = ends("serial")
    sent = [link.send(attitude(i)) for i in range(2000)]
    parser, messages = v20.MAVLink(None), []
    while len(messages) < sent.count(True):
        works(link)
        messages += receive_messages(peer, 1, parser)[0]
    assert [m.time_boot_ms for m in messages] == [i for i, went in enumerate(sent) if went]
    assert 0 < sent.count(True) < len(sent)
    link.channel.close()
    assert link.loss_reports() == [f"{sent.count(False)} frames dropped on a slow line"]


@pty
def test_serial_device_is_reopened_after_disconnection(tmp_path, caplog):
    path, line = tmp_path / "ttyUSB0", Line()
    path.symlink_to(line.path)
    link = link_of(Serial(str(path), 115200))
    line.close()
    path.unlink()
    now = time.monotonic()
    assert until(lambda: received(link) or link.channel.poll(now) or link.channel._stream is None)
    assert not link.send(heartbeat())
    link.channel.poll(now + 2.0)
    assert link.channel._stream is None
    line = Line()
    path.symlink_to(line.path)
    link.channel.poll(now + 4.0)
    assert send_now(link, attitude(9))
    assert receive_messages(line, 1)[0][0].time_boot_ms == 9
    assert [record.message.split(" ", 2)[2] for record in caplog.records] == ["is gone", "is back"]


@pty
@pytest.mark.parametrize(
    ("device", "baud", "words"),
    [
        ("/dev/none", 57600, "serial:/dev/none: No such file"),
        ("/dev/none", 57601, r"baud is 57601, expected one that the system knows, such as .*57600"),
        ("file", 57600, "Inappropriate ioctl"),
    ],
)
def test_invalid_serial_devices_are_rejected(tmp_path, device, baud, words):
    (tmp_path / "file").touch()
    with pytest.raises(TelemetryError, match=words):
        Serial(str(tmp_path / device), baud)


# ---- logs ----


def test_tlog_timestamps_follow_simulation_time(tmp_path):
    path, before = tmp_path / "dive.tlog", time.time()
    link = link_of(Tlog(str(path)))
    times = [0.0, 0.5, 1.0, 0.7, float("nan"), float("inf"), 2.0]  # never back
    for link.channel.simulated in times:
        assert link.send(attitude(1))
        link.channel.send(Codec().pack(heartbeat()))
    link.channel.close()
    messages = stubs.read_log(path)
    assert [m.get_type() for m in messages] == ["ATTITUDE", "HEARTBEAT"] * len(times)
    stamps = [m._timestamp for m in messages[::2]]
    assert [s - stamps[0] for s in stamps] == pytest.approx([0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 2.0], abs=1e-5)
    assert before - 0.01 <= stamps[0] <= time.time()
    assert path.read_bytes()[8] == 0xFD and not link.loss_reports()


def test_tlog_of_a_fast_run_has_no_future_timestamps(tmp_path):
    path = tmp_path / "fast.tlog"
    link = link_of(Tlog(str(path)))
    link.channel.advance_start(600.0)
    for link.channel.simulated in (0.0, 600.0):
        link.send(attitude(1))
    link.channel.close()
    first, last = (m._timestamp for m in stubs.read_log(path))
    assert last - first == pytest.approx(600.0, abs=1e-5) and last <= time.time()  # LogReplayLink.cc, _parseTimestamp


@pytest.mark.parametrize(("rate", "seconds"), [(None, 12.0), (10.0, 12.0), (1.0, 0.0), (0.5, 0.0)])
def test_lead_over_wall_clock_depends_on_duration_and_rate(rate, seconds):
    assert max_lead(load_scenario("paper", ["time.duration=12"]), rate) == seconds


def test_a_log_is_never_overwritten_and_an_unused_one_leaves_no_file(tmp_path):
    path = tmp_path / "dive.tlog"
    Tlog(str(path)).close()
    assert not path.exists()
    path.write_bytes(b"precious")
    with pytest.raises(TelemetryError, match=r"dive.tlog: File exists"):
        Tlog(str(path))
    assert path.read_bytes() == b"precious"


class FullDisk:
    """Takes 1000 bytes in pieces, and then no more until it is emptied."""

    def __init__(self, file):
        self.file, self.room, self.close = file, 1000, file.close

    def write(self, data):
        if not self.room:
            raise OSError(errno.ENOSPC, "No space left on device")
        size = min(len(data), self.room, 77)
        self.room -= size
        return self.file.write(data[:size])


def test_full_disk_is_reported_once_and_truncates_no_frame(tmp_path, caplog):
    path = tmp_path / "dive.tlog"
    channel = Tlog(str(path))
    channel._file = disk = FullDisk(channel._file)
    link = link_of(channel)
    sent = [link.send(odometry(i + 1)) for i in range(5000)]
    assert not sent[-1]  # what waits is bounded
    disk.room = 10**9
    link.channel.close()
    assert [m.time_usec for m in stubs.read_log(path)] == [i + 1 for i, went in enumerate(sent) if went]
    assert len(caplog.records) == 1 and "No space left" in caplog.text
    assert any("frames not logged" in trouble for trouble in link.loss_reports())
