"""Hostile input causes no error, leak or delay, and valid frames in between are accepted."""

import random
import time
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.hostile import hostile_datagrams
from cosim.mavlink import thread
from cosim.mavlink.channels.udp import MAX_PEERS, PEER_TIMEOUT, UdpIn
from cosim.mavlink.thread import LinkThread
from cosim.mavlink.wire.framing import StreamReader
from cosim.mavlink.wire.link import Link
from cosim.mavlink.wire.signing import SigningClock, Verifier
from tests.cosim.mavlink.stubs import (
    KEY,
    SOURCE,
    Station,
    StubVehicle,
    attitude,
    link_of,
    open_filter,
    udp_socket,
    until,
)

HERE = "127.0.0.1"


class Script:
    """A channel that receives given datagrams."""

    datagrams = True

    def __init__(self, datagrams):
        self.coming, self.losses, self.looked = iter(datagrams), {}, 0

    def receive(self):
        data = next(self.coming, None)
        self.looked += data is not None
        return None if data is None else (0, data)

    def record_version(self, peer, version): ...

    def send(self, frame, frame_v1=None):
        return True

    def poll(self, now): ...

    def close(self): ...


def interspersed(count, every, station):
    for i, data in enumerate(hostile_datagrams(count, seed=1)):
        yield data
        if i % every == 0:
            yield station.pack(attitude(i))


def attack(count, verifier=None, station=None):
    rx, station = open_filter(verifier), station or Station()
    link = Link("test", Script(interspersed(count, 100, station)), rx, SOURCE)
    good = [m.time_boot_ms for _, m in link.receive(time.perf_counter() + 600) if m.get_type() == "ATTITUDE"]
    assert good == list(range(0, count, 100))
    assert link.channel.looked == count + count // 100
    return rx.stats


def test_all_valid_datagrams_among_hostile_ones_are_accepted():
    counts = attack(20_000)
    assert min(counts.malformed, counts.checksum, counts.accepted) > 1000 and counts.unknown > 10
    assert counts.unsigned == counts.forged == 0


def test_with_a_key_only_signed_datagrams_are_accepted():
    counts = attack(5000, Verifier(KEY, SigningClock()), Station(key=KEY))
    assert counts.accepted == 50 and counts.unsigned > 900


def test_all_valid_frames_in_a_hostile_stream_are_accepted():
    """Also frames after half a frame, which may be taken for its other half until the checksum fails."""
    station = Station()
    data = b"".join(interspersed(5000, 20, station)) + bytes(300)
    reader = StreamReader(open_filter())
    found = [m for i in range(0, len(data), 512) for _, m in reader.read(data[i : i + 512])]
    assert [m.time_boot_ms for m in found if m.get_type() == "ATTITUDE"] == list(range(0, 5000, 20))


@pytest.mark.slow
def test_hostile_datagrams_leak_no_memory():
    rx = open_filter()

    def receive(count):
        link = Link("test", Script(hostile_datagrams(count, seed=count)), rx, SOURCE)
        for _ in link.receive(time.perf_counter() + 600):
            pass
        assert link.channel.looked == count

    receive(180_000)
    tracemalloc.start()  # slow, and it need not watch all of them
    before = tracemalloc.get_traced_memory()[0]
    receive(20_000)
    after = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert rx.stats.accepted > 38_000
    assert after - before < 100_000


class Clock:
    """A clock that advances by a fixed time at each reading, and by the duration of an answer."""

    LOOK, ANSWER = 1e-5, 7e-5  # s

    def __init__(self):
        self.now = 100.0

    def perf_counter(self):
        self.now += self.LOOK
        return self.now

    monotonic = perf_counter


class Answering(StubVehicle):
    """Answers each request with as much as a careless vehicle would, which takes its time, and keeps none."""

    def __init__(self, clock):
        super().__init__()
        self.clock, self.answered = clock, 0

    def receive(self, link, message, now):
        for i in range(20):
            link.send(attitude(i))
        self.clock.now += self.clock.ANSWER
        self.answered += 1


def test_flood_consumes_a_bounded_share_of_each_cycle(monkeypatch):
    """However much is waiting, a turn ends; the thread then rests for a multiple of what it took."""
    clock = Clock()
    monkeypatch.setattr("cosim.mavlink.thread.time", clock)
    monkeypatch.setattr("cosim.mavlink.wire.link.time", clock)
    channel, vehicle = Script(hostile_datagrams(10**9, seed=3)), Answering(clock)
    links = LinkThread(vehicle, [Link("test", channel, open_filter(), SOURCE)], step=0.01)
    slice_ = thread._RECEIVING
    for _ in range(500):
        began, before = clock.now, channel.looked
        rest = links._run_slice()
        took = clock.now - began
        assert 1 <= channel.looked - before <= slice_ / clock.LOOK
        assert slice_ < took < slice_ + clock.ANSWER + 10 * clock.LOOK  # what was begun in the slice is ended
        assert thread._REST_RECEIVING * slice_ <= rest <= thread._REST_RECEIVING * took
    assert vehicle.answered > 500


def test_a_flooded_port_neither_starves_the_stream_nor_another_link():
    flooded, quiet = UdpIn(HERE, 0), UdpIn(HERE, 0)
    vehicle = StubVehicle()
    links = LinkThread(vehicle, [link_of(flooded), link_of(quiet)], step=0.01)
    links.start()
    bad, good = udp_socket(), udp_socket()
    for i, data in enumerate(hostile_datagrams(20_000, seed=4)):
        bad.sendto(data, (HERE, flooded.port))
        if i % 100 == 0:
            links.observe(i // 100, np.array([i * 1e-4]))
    good.sendto(Station().pack(attitude(77)), (HERE, quiet.port))
    assert until(lambda: any(m.get_type() == "ATTITUDE" and m.time_boot_ms == 77 for m in vehicle.received))
    assert until(lambda: len(vehicle.rows) == 200)
    links.close()
    assert not links.failures
    assert len(flooded.peers) <= MAX_PEERS


@pytest.mark.parametrize("before", [0, 3, 200])  # addresses that sent one frame each before the station came
@pytest.mark.parametrize("silence", [0.0, 9.0, 11.0, 3600.0])
def test_flood_of_new_addresses_does_not_displace_a_station_that_was_heard(before, silence, monkeypatch):
    """The station speaks for a minute, is silent, and speaks again, while thousands of ports send valid frames."""
    clock = SimpleNamespace(now=100.0, monotonic=lambda: clock.now)
    channel = UdpIn(HERE, 0)
    monkeypatch.setattr("cosim.mavlink.channels.udp.time", clock)
    ports = iter(range(20_000, 60_000))
    station, rng = (HERE, 14550), random.Random(5)

    def passes(seconds, speaks=False, floods=False):
        for _ in range(max(1, round(seconds))):
            clock.now += 1.0
            if speaks:
                channel.record_version(station, 2)
            for _ in range(rng.randrange(8) if floods else 0):
                channel.record_version((HERE, next(ports)), 2)
            channel.poll(clock.now)
            assert len(channel._peers) <= MAX_PEERS

    for _ in range(before):
        channel.record_version((HERE, next(ports)), 2)
        clock.now += 0.5 * PEER_TIMEOUT
    passes(60.0, speaks=True, floods=True)
    assert station in channel.peers
    passes(silence, floods=True)
    assert (station in channel.peers) == (silence < PEER_TIMEOUT)
    passes(1.0, speaks=True, floods=True)
    assert station in channel.peers
    channel.close()
