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
from cosim.mavlink.wire.signing import SigningClock, Verifier
from tests.cosim.mavlink.stubs import HERE, KEY, Codec, StubVehicle, attitude, link_of, open_filter, udp_socket, until


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


def times_of(messages):
    return [m.time_boot_ms for _, m in messages if m.get_type() == "ATTITUDE"]


def interspersed(count, every, codec):
    for i, data in enumerate(hostile_datagrams(count, seed=1)):
        yield data
        if i % every == 0:
            yield codec.pack(attitude(i))


def attack(count, verifier=None, key=None):
    """Receive hostile datagrams and a valid one after every hundredth; return the counts."""
    link = link_of(Script(interspersed(count, 100, Codec(key=key))), open_filter(verifier))
    assert times_of(link.receive(time.perf_counter() + 600)) == list(range(0, count, 100))
    assert link.channel.looked == count + count // 100
    return link.stats


def test_all_valid_datagrams_among_hostile_ones_are_accepted():
    counts = attack(20_000)
    assert min(counts.malformed, counts.checksum, counts.accepted) > 1000 and counts.unknown > 10
    assert counts.unsigned == counts.forged == 0


def test_with_a_key_only_signed_datagrams_are_accepted():
    counts = attack(5000, Verifier(KEY, SigningClock()), KEY)
    assert counts.accepted == 50 and counts.unsigned > 900


def test_all_valid_frames_in_a_hostile_stream_are_accepted():
    """Also frames after half a frame, which may be taken for its other half until the checksum fails."""
    data = b"".join(interspersed(5000, 20, Codec())) + bytes(300)
    reader = StreamReader(open_filter())
    messages = [m for i in range(0, len(data), 512) for m in reader.read(data[i : i + 512])]
    assert times_of(messages) == list(range(0, 5000, 20))


@pytest.mark.slow
def test_hostile_datagrams_leak_no_memory():
    rx = open_filter()

    def receive(count):
        link = link_of(Script(hostile_datagrams(count, seed=count)), rx)
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
    for module in ("thread", "wire.link"):
        monkeypatch.setattr(f"cosim.mavlink.{module}.time", clock)
    channel, vehicle, slice_ = Script(hostile_datagrams(10**9, seed=3)), Answering(clock), thread._RECEIVING
    links = LinkThread(vehicle, [link_of(channel)], step=0.01)
    for _ in range(500):
        began, before = clock.now, channel.looked
        rest = links._run_slice()
        took = clock.now - began
        assert 1 <= channel.looked - before <= slice_ / clock.LOOK
        assert slice_ < took < slice_ + clock.ANSWER + 10 * clock.LOOK  # what was begun in the slice is ended
        assert thread._REST_RECEIVING * slice_ <= rest <= thread._REST_RECEIVING * took
    assert vehicle.answered > 500


def test_a_flooded_port_neither_starves_the_stream_nor_another_link():
    flooded, quiet, vehicle, bad = UdpIn(HERE, 0), UdpIn(HERE, 0), StubVehicle(), udp_socket()
    links = LinkThread(vehicle, [link_of(flooded), link_of(quiet)], step=0.01)
    links.start()
    for i, data in enumerate(hostile_datagrams(20_000, seed=4)):
        bad.sendto(data, (HERE, flooded.port))
        if i % 100 == 0:
            links.observe(i // 100, np.array([i * 1e-4]))
    udp_socket().sendto(Codec().pack(attitude(77)), (HERE, quiet.port))
    assert until(lambda: 77 in times_of((None, m) for m in vehicle.received))
    assert until(lambda: len(vehicle.rows) == 200)
    links.close()
    assert not links.failures
    assert len(flooded.peers) <= MAX_PEERS


@pytest.mark.parametrize("before", [0, 3, 200])  # addresses that sent one frame each before the station came
@pytest.mark.parametrize("silence", [0.0, 9.0, 11.0, 3600.0])
def test_flood_of_new_addresses_does_not_displace_a_station_that_was_heard(before, silence, monkeypatch):
    """The station speaks for a minute, is silent, and speaks again, while thousands of ports send valid frames."""
    clock = SimpleNamespace(now=100.0, monotonic=lambda: clock.now)
    channel, rng = link_of(UdpIn(HERE, 0)).channel, random.Random(5)
    monkeypatch.setattr("cosim.mavlink.channels.udp.time", clock)
    station, ports = (HERE, 14550), iter(range(20_000, 60_000))

    def passes(seconds, speaks):
        for _ in range(max(1, round(seconds))):
            clock.now += 1.0
            for peer in [station] * speaks + [(HERE, next(ports)) for _ in range(rng.randrange(8))]:
                channel.record_version(peer, 2)
            channel.poll(clock.now)
            assert len(channel._peers) <= MAX_PEERS
        return station in channel.peers

    for _ in range(before):
        channel.record_version((HERE, next(ports)), 2)
        clock.now += 0.5 * PEER_TIMEOUT
    assert passes(60.0, speaks=True)
    assert passes(silence, speaks=False) == (silence < PEER_TIMEOUT)
    for _ in range(2 * MAX_PEERS):  # at once: all others that are silent go
        channel.record_version((HERE, next(ports)), 2)
    assert passes(1.0, speaks=True)
