"""Signatures: compatible with pymavlink both ways; forged and replayed frames are rejected."""

import hashlib
import os
import socket
import time
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.errors import TelemetryError
from cosim.mavlink.wire import signing
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.link import Link, Signer, open_links
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.mavlink.wire.signing import MAX_STREAMS, SigningClock, Verifier, load_key, timestamp_file
from tests.cosim.mavlink.stubs import KEY, SOURCE, Station, attitude, heartbeat, open_filter

MINUTE = 60 * 100_000


def now():
    return int((time.time() - 1420070400) * 1e5)  # seconds from 1970 to 2015


def filter_and_clock():
    clock = SigningClock()
    return open_filter(Verifier(KEY, clock)), clock


def accepts(rx, frame):
    return len(list(rx.read_datagram(frame))) == 1


def rejected(rx):
    c = rx.stats
    names = ("unsigned", "forged", "replayed", "old", "ahead", "crowded", "checksum", "malformed")
    return {name: getattr(c, name) for name in names if getattr(c, name)}


class Captured:
    """A channel that keeps what is sent."""

    datagrams, losses = True, {}

    def __init__(self):
        self.frames = []

    def send(self, frame, frame_v1=None):
        self.frames.append(frame)
        return True


def signed_link(clock, link=3):
    return Link("test", Captured(), open_filter(), SOURCE, signer=Signer(KEY, clock, link))


def test_pymavlink_accepts_own_signatures_and_rejects_altered_frames():
    link, station = signed_link(SigningClock()), Station(key=KEY)
    for i in range(20):
        assert link.send(attitude(i))
    assert [m.get_type() for f in link.channel.frames for m in station.parse(f)] == ["ATTITUDE"] * 20
    assert station.codec.signing.goodsig_count == 20
    frame = link.channel.frames[-1]
    assert frame[-13] == 3  # the link
    assert frame[-6:] == hashlib.sha256(KEY + frame[:-6]).digest()[:6]  # by the specification
    assert [m.get_type() for m in station.parse(frame)] == ["BAD_DATA"]  # once more
    other = Station(key=bytes(32))
    assert [m.get_type() for m in other.parse(frame)] == ["BAD_DATA"]


def test_timestamps_rise_on_all_links_and_over_a_restart(monkeypatch):
    clock = SigningClock()
    a, b = signed_link(clock, 0), signed_link(clock, 1)
    before = now()
    for i in range(100):
        a.send(attitude(i))
        b.send(attitude(i))
    stamps = [int.from_bytes(f[-12:-6], "little") for pair in zip(a.channel.frames, b.channel.frames, strict=True)
              for f in pair]  # fmt: skip
    assert all(y > x for x, y in zip(stamps, stamps[1:], strict=False))
    assert before <= stamps[0] <= now()
    assert SigningClock().next() > stamps[-1] - 1000  # a new process begins at its wall clock
    monkeypatch.setattr(signing.time, "time", lambda: 1.6e9)  # the clock is set back while we run
    a.send(attitude(0))
    assert int.from_bytes(a.channel.frames[-1][-12:-6], "little") > stamps[-1]


def test_frame_signed_by_pymavlink_is_accepted_once():
    rx, _ = filter_and_clock()
    station = Station(key=KEY)
    frames = [station.pack(attitude(i)) for i in range(10)]
    assert all(accepts(rx, frame) for frame in frames)
    assert not any(accepts(rx, frame) for frame in frames)
    assert rejected(rx) == {"replayed": 10}


def test_forged_unsigned_and_version_1_frames_are_refused_and_counted():
    rx, _ = filter_and_clock()
    assert not accepts(rx, Station(key=bytes(32)).pack(heartbeat()))
    good = bytearray(Station(key=KEY).pack(heartbeat()))
    for i in range(len(good) - 13, len(good)):  # link, timestamp and hash
        bad = bytearray(good)
        bad[i] ^= 1
        assert not accepts(rx, bytes(bad))
    assert rejected(rx) == {"forged": 14}
    assert not accepts(rx, Station().pack(heartbeat()))
    assert not accepts(rx, Station().pack(heartbeat(), v1=True))
    assert rejected(rx) == {"forged": 14, "unsigned": 2}
    assert accepts(rx, bytes(good))


def test_forged_timestamp_does_not_block_the_real_sender():
    """A timestamp of the far future counts only with a good signature."""
    rx, clock = filter_and_clock()
    station = Station(key=KEY)
    assert accepts(rx, station.pack(heartbeat()))
    assert not accepts(rx, Station(key=bytes(32), stamp=(1 << 48) - 2).pack(heartbeat()))
    assert accepts(rx, station.pack(heartbeat()))
    assert clock.now < now() + MINUTE


def test_new_stream_may_lag_at_most_one_minute():
    rx, _ = filter_and_clock()
    assert accepts(rx, Station(key=KEY, link=1, stamp=now() - MINUTE + 100_000).pack(heartbeat()))
    late = Station(key=KEY, link=2, stamp=now() - MINUTE - 100_000)
    assert not accepts(rx, late.pack(heartbeat()))
    assert rejected(rx) == {"old": 1}


def test_sender_with_fast_clock_accepts_own_frames():
    clock = SigningClock()
    rx, link = open_filter(Verifier(KEY, clock)), signed_link(clock)
    station = Station(key=KEY, stamp=now() + MINUTE - 200_000)
    station.codec.signing.timestamp += 6_100_000  # so far that ours look old to it
    link.send(heartbeat())
    assert [m.get_type() for m in station.parse(link.channel.frames[-1])] == ["BAD_DATA"]
    station.codec.signing.timestamp -= 6_100_000
    assert accepts(rx, station.pack(heartbeat()))
    link.send(heartbeat())
    assert [m.get_type() for m in station.parse(link.channel.frames[-1])] == ["HEARTBEAT"]


def test_clock_one_hour_ahead_is_rejected_without_lockout():
    rx, clock = filter_and_clock()
    for k in range(5):  # nor does one that creeps ahead, a minute at a time
        accepts(rx, Station(key=KEY, link=k, stamp=now() + (k + 1) * MINUTE - 100_000).pack(heartbeat()))
    assert rejected(rx) == {"ahead": 4}
    assert not accepts(rx, Station(key=KEY, link=9, stamp=now() + 60 * MINUTE).pack(heartbeat()))
    assert rejected(rx) == {"ahead": 5} and clock.now < now() + MINUTE
    assert accepts(rx, Station(key=KEY, link=10, stamp=now()).pack(heartbeat()))


def test_frame_received_on_two_links_counts_as_replay():
    verifier = Verifier(KEY, SigningClock())
    frame = Station(key=KEY).pack(heartbeat())
    assert accepts(open_filter(verifier), frame)
    assert not accepts(open_filter(verifier), frame)


def test_streams_are_bounded_and_forgotten_only_when_a_repeat_would_be_too_old():
    rx, clock = filter_and_clock()
    begin = now()
    first = Station(key=KEY, link=0, stamp=begin).pack(heartbeat())
    assert accepts(rx, first)
    for link in range(1, MAX_STREAMS):
        assert accepts(rx, Station(key=KEY, link=link, stamp=begin + 10 * link).pack(heartbeat()))
    extra = Station(key=KEY, link=200, stamp=begin + MINUTE - 100_000).pack(heartbeat())
    assert not accepts(rx, extra)
    assert rejected(rx) == {"crowded": 1}
    clock.advance_to(begin + MINUTE + 100_000)  # time goes by
    assert accepts(rx, extra)
    assert not accepts(rx, first)
    assert rejected(rx) == {"crowded": 1, "old": 1}


def test_without_a_key_signed_frames_are_read_as_any():
    assert accepts(open_filter(), Station(key=KEY).pack(heartbeat()))


def key_file(tmp_path, content, mode=0o600):
    path = tmp_path / "key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


RAW = bytes(range(128, 160))
POSIX = pytest.mark.skipif(os.name != "posix", reason="modes of files are POSIX's")


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (RAW, RAW),
        (KEY.hex().encode(), KEY),
        (KEY.hex().upper().encode() + b"\n", KEY),
        (b"correct horse\n", hashlib.sha256(b"correct horse").digest()),
        ("Öl\r\n".encode(), hashlib.sha256("Öl".encode()).digest()),
        (b"a" * 32, hashlib.sha256(b"a" * 32).digest()),
        (bytes(32), bytes(32)),
        (b"a" * 4096, hashlib.sha256(b"a" * 4096).digest()),
    ],
)
def test_key_files_are_read(tmp_path, content, key):
    assert load_key(key_file(tmp_path, content)) == key


@pytest.mark.parametrize(
    ("content", "mode", "words"),
    [
        *((content, 0o600, "expected 32 bytes, 64 hexadecimal digits or a passphrase")
          for content in (b"", b" \n", b"\xff" * 31, b"\xff" * 33, b"two\nlines")),
        (b"a" * 4097, 0o600, "more than 4096 bytes"),  # refused rather than cut
        pytest.param(KEY, 0o644, "mode is 644, expected 600", marks=POSIX),
    ],
)  # fmt: skip
def test_files_without_a_key_of_their_own_are_rejected(tmp_path, content, mode, words):
    with pytest.raises(TelemetryError, match=words):
        load_key(key_file(tmp_path, content, mode))
    with pytest.raises(TelemetryError, match=r"none: the key cannot be read: No such file"):
        load_key(tmp_path / "none")


def test_signature_matches_published_example():
    """The golden frame: key of 42s, made from the specification with hashlib and a bitwise checksum alone."""
    head = bytes([9, 1, 0, 0, 255, 190, 0, 0, 0, 7, 0, 0, 0, 6, 8, 0, 0, 3])  # HEARTBEAT of a ground station
    crc = 0xFFFF
    for byte in (*head, 50):  # 50: its CRC_EXTRA
        t = byte ^ crc & 0xFF
        t = (t ^ t << 4) & 0xFF
        crc = crc >> 8 ^ t << 8 ^ t << 3 ^ t >> 4
        crc &= 0xFFFF
    body = b"\xfd" + head + crc.to_bytes(2, "little") + b"\x05" + now().to_bytes(6, "little")
    frame = body + hashlib.sha256(b"*" * 32 + body).digest()[:6]
    rx = open_filter(Verifier(b"*" * 32, SigningClock()))
    ((_, message),) = rx.read_datagram(frame)
    assert (message.custom_mode, message.type, message.autopilot) == (7, 6, 8)


# ---- across restarts ----


class Restarts:
    """A vehicle that is killed and started again, with a clock of its own."""

    def __init__(self, file, monkeypatch):
        self.file, self.wall = file, 1.8e9
        monkeypatch.setattr(signing, "time", SimpleNamespace(time=lambda: self.wall, monotonic=lambda: self.wall))
        self.start()

    def start(self, after=0.0):
        self.wall += after
        self.clock = SigningClock(self.file)
        self.rx, self.link = open_filter(Verifier(KEY, self.clock)), signed_link(self.clock)
        return self

    def stamp(self, ahead=0.0):
        return round((self.wall + ahead - 1420070400) * 1e5)

    def sends(self):
        self.link.send(heartbeat())
        return int.from_bytes(self.link.channel.frames[-1][-12:-6], "little")


@pytest.fixture
def vehicle(tmp_path, monkeypatch):
    return Restarts(tmp_path / "state" / "signing" / "name", monkeypatch)


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["restart", "receive", "send"]),
            st.floats(0.0, 5.0) | st.floats(0.0, 600.0),  # s that go by before
            st.floats(-50.0, 50.0),  # s by which the peer's clock is ahead
            st.integers(0, 2),  # link of the peer
        ),
        max_size=60,
    )
)
def test_no_frame_is_accepted_twice_and_no_timestamp_used_twice_over_any_restarts(tmp_path_factory, steps):
    with pytest.MonkeyPatch.context() as patch:
        vehicle = Restarts(tmp_path_factory.mktemp("state") / "name", patch)
        captured, sent = [], []
        for what, after, ahead, link in steps:
            vehicle.wall += after
            if what == "restart":
                vehicle.start()
            elif what == "send":
                sent.append(vehicle.sends())
            else:
                frame = Station(key=KEY, link=link, stamp=vehicle.stamp(ahead)).pack(heartbeat())
                if accepts(vehicle.rx, frame):
                    captured.append(frame)
            assert not any(accepts(vehicle.rx, frame) for frame in captured)
        assert sent == sorted(set(sent))


def test_station_goes_on_within_two_seconds_of_a_restart_and_at_once_if_it_hears_the_vehicle(vehicle):
    assert accepts(vehicle.rx, Station(key=KEY, stamp=vehicle.stamp()).pack(heartbeat()))
    vehicle.start(after=0.3)
    assert not accepts(vehicle.rx, Station(key=KEY, stamp=vehicle.stamp()).pack(heartbeat()))
    assert rejected(vehicle.rx) == {"old": 1}
    assert accepts(vehicle.rx, Station(key=KEY, stamp=vehicle.sends() + 1).pack(heartbeat()))
    vehicle.start(after=2.5)
    assert accepts(vehicle.rx, Station(key=KEY, stamp=vehicle.stamp()).pack(heartbeat()))


def test_many_restarts_in_a_row_do_not_run_ahead_of_the_clock(vehicle):
    for _ in range(500):
        vehicle.start(after=0.3)
        assert vehicle.sends() < vehicle.stamp(3.0)
    assert vehicle.file.read_text().strip().isdigit()


def test_file_is_written_seldom(vehicle, monkeypatch):
    writes = []
    monkeypatch.setattr(signing, "write_atomic", lambda file, text: writes.append(text))
    for _ in range(1000):
        vehicle.wall += 0.01
        vehicle.sends()
        accepts(vehicle.rx, Station(key=KEY, stamp=vehicle.stamp()).pack(heartbeat()))
    assert 4 <= len(writes) <= 6  # in 10 s


def test_clock_that_was_set_back_and_damaged_files_are_refused_by_name(vehicle):
    vehicle.sends()
    vehicle.wall -= 3600.0
    with pytest.raises(
        TelemetryError, match=r"name: is 36\d\d s ahead of the clock; set the clock, or remove the file"
    ):
        vehicle.start()
    for damaged in ("", "x", "-1", "1" * 30):
        vehicle.file.write_text(damaged)
        with pytest.raises(TelemetryError, match="name: holds no timestamp; remove the file"):
            vehicle.start()
    vehicle.file.unlink()
    vehicle.start()


def test_folder_that_cannot_be_written_is_refused_at_the_start_and_warned_of_later(vehicle, tmp_path, caplog):
    vehicle.file.unlink()
    vehicle.file.mkdir()
    vehicle.wall += 10.0
    assert vehicle.sends() and "can be replayed" in caplog.text
    assert vehicle.sends() and len(caplog.records) == 1
    with pytest.raises(TelemetryError, match="name: timestamps cannot be saved: "):
        vehicle.start()
    (tmp_path / "file").touch()
    with pytest.raises(TelemetryError, match="timestamps cannot be saved: "):
        SigningClock(tmp_path / "file" / "name")


def test_each_key_and_identity_has_a_file_that_shows_nothing_of_the_key():
    names = {timestamp_file(key, who).name for key in (KEY, bytes(32)) for who in ((1, 1), (255, 190), (255, 191))}
    assert len(names) == 6
    assert not any(KEY.hex()[:8] in name or hashlib.sha256(KEY).hexdigest()[:8] in name for name in names)


def test_frame_captured_from_a_link_is_refused_by_the_next_one(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    endpoint = Endpoint("udpin", "udpin:127.0.0.1:0", host="127.0.0.1", port=0)
    frame, heard = Station(key=KEY).pack(attitude(5)), []
    for _ in range(2):
        (link,) = open_links([endpoint], MavlinkOptions(key=KEY))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as station:
            station.sendto(frame, ("127.0.0.1", link.channel.port))
            while not (link.stats.accepted or link.stats.old):
                heard += link.receive(time.perf_counter() + 60.0)
        link.channel.close()
    assert len(heard) == 1
    assert len(list(tmp_path.rglob("*-1-1"))) == 1
