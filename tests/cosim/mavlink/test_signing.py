"""Signatures: compatible with pymavlink both ways; forged and replayed frames are rejected."""

import hashlib
import os
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
from tests.cosim.mavlink.stubs import KEY, SOURCE, Codec, attitude, closed_later, heartbeat, open_filter, udp_socket

MINUTE = 60 * 100_000
OTHER = bytes(32)  # another key


def now():
    return int((time.time() - 1420070400) * 1e5)  # seconds from 1970 to 2015


class Receiver:
    """A receiver of signed frames."""

    def __init__(self, clock=None, verifier=None):
        self.clock = clock or SigningClock()
        self.rx = open_filter(verifier or Verifier(KEY, self.clock))

    def accepts(self, *frames):
        """Return how many frames are accepted."""
        return sum(len(list(self.rx.read_datagram(frame))) for frame in frames)

    def accepts_from(self, key=KEY, link=7, stamp=None):
        """Return whether a new sender's heartbeat is accepted."""
        return self.accepts(signed(heartbeat(), key, link, stamp)) == 1

    def rejected(self):
        names = ("unsigned", "forged", "replayed", "old", "ahead", "crowded", "checksum", "malformed")
        return {name: n for name in names if (n := getattr(self.rx.stats, name))}


def signed(message, key=KEY, link=7, stamp=None):
    return Codec(key=key, link=link, stamp=stamp).pack(message)


@pytest.fixture
def receiver():
    return Receiver()


class Sender:
    """A link that signs, and keeps what it sends."""

    datagrams, losses = True, {}

    def __init__(self, clock, link=3):
        self.frames = []
        self.link = Link("test", self, open_filter(), SOURCE, signer=Signer(KEY, clock, link))

    def send(self, frame, frame_v1=None):
        self.frames.append(frame)
        return True

    def sign(self, message):
        """Sign and send a message; return its frame and timestamp."""
        assert self.link.send(message)
        return self.frames[-1], int.from_bytes(self.frames[-1][-12:-6], "little")


def names(station, frame):
    return [m.get_type() for m in station.parse(frame)]


def test_pymavlink_accepts_own_signatures_and_rejects_altered_frames():
    sender, station = Sender(SigningClock()), Codec(key=KEY)
    for i in range(20):
        frame, _ = sender.sign(attitude(i))
        assert names(station, frame) == ["ATTITUDE"]
    assert station.codec.signing.goodsig_count == 20
    assert frame[-13] == 3  # the link
    assert frame[-6:] == hashlib.sha256(KEY + frame[:-6]).digest()[:6]  # by the specification
    assert names(station, frame) == names(Codec(key=OTHER), frame) == ["BAD_DATA"]  # once more, and by another key


def test_timestamps_rise_on_all_links_and_over_a_restart(monkeypatch):
    clock, before = SigningClock(), now()
    a, b = Sender(clock, 0), Sender(clock, 1)
    stamps = [sender.sign(attitude(i))[1] for i in range(100) for sender in (a, b)]
    assert stamps == sorted(set(stamps)) and before <= stamps[0] <= now()
    assert SigningClock().next() > stamps[-1] - 1000  # a new process begins at its wall clock
    monkeypatch.setattr(signing.time, "time", lambda: 1.6e9)  # the clock is set back while we run
    assert a.sign(attitude(0))[1] > stamps[-1]


def test_frame_signed_by_pymavlink_is_accepted_once_on_any_link():
    verifier, station = Verifier(KEY, SigningClock()), Codec(key=KEY)
    receiver, other = Receiver(verifier=verifier), Receiver(verifier=verifier)
    frames = [station.pack(attitude(i)) for i in range(10)]
    assert (receiver.accepts(*frames), receiver.accepts(*frames), other.accepts(*frames)) == (10, 0, 0)
    assert receiver.rejected() == other.rejected() == {"replayed": 10}


def test_forged_unsigned_and_version_1_frames_are_refused_and_counted(receiver):
    good, bad = signed(heartbeat()), [signed(heartbeat(), OTHER)]
    for i in range(len(good) - 13, len(good)):  # link, timestamp and hash
        altered = bytearray(good)
        altered[i] ^= 1
        bad.append(bytes(altered))
    assert receiver.accepts(*bad) == 0 and receiver.rejected() == {"forged": 14}
    assert receiver.accepts(Codec().pack(heartbeat()), Codec().pack(heartbeat(), v1=True)) == 0
    assert receiver.rejected() == {"forged": 14, "unsigned": 2}
    assert receiver.accepts(good) == 1
    assert len(list(open_filter().read_datagram(good))) == 1  # without a key it is read as any


def test_forged_timestamp_does_not_block_the_real_sender(receiver):
    """A timestamp of the far future counts only with a good signature."""
    station = Codec(key=KEY)
    assert receiver.accepts(station.pack(heartbeat()))
    assert not receiver.accepts_from(OTHER, stamp=(1 << 48) - 2)
    assert receiver.accepts(station.pack(heartbeat()))
    assert receiver.clock.now < now() + MINUTE


def test_new_stream_may_lag_at_most_one_minute(receiver):
    assert receiver.accepts_from(link=1, stamp=now() - MINUTE + 100_000)
    assert not receiver.accepts_from(link=2, stamp=now() - MINUTE - 100_000)
    assert receiver.rejected() == {"old": 1}


def test_sender_with_fast_clock_accepts_own_frames(receiver):
    sender, station = Sender(receiver.clock), Codec(key=KEY, stamp=now() + MINUTE - 200_000)
    station.codec.signing.timestamp += 6_100_000  # so far that ours look old to it
    assert names(station, sender.sign(heartbeat())[0]) == ["BAD_DATA"]
    station.codec.signing.timestamp -= 6_100_000
    assert receiver.accepts(station.pack(heartbeat()))
    assert names(station, sender.sign(heartbeat())[0]) == ["HEARTBEAT"]


def test_clock_one_hour_ahead_is_rejected_without_lockout(receiver):
    for k in range(5):  # nor does one that creeps ahead, a minute at a time
        receiver.accepts_from(link=k, stamp=now() + (k + 1) * MINUTE - 100_000)
    assert receiver.rejected() == {"ahead": 4}
    assert not receiver.accepts_from(link=9, stamp=now() + 60 * MINUTE)
    assert receiver.rejected() == {"ahead": 5} and receiver.clock.now < now() + MINUTE
    assert receiver.accepts_from(link=10, stamp=now())


def test_streams_are_bounded_and_forgotten_only_when_a_repeat_would_be_too_old(receiver):
    begin = now()
    first, *others = (signed(heartbeat(), link=link, stamp=begin + 10 * link) for link in range(MAX_STREAMS))
    assert receiver.accepts(first, *others) == MAX_STREAMS
    extra = signed(heartbeat(), link=200, stamp=begin + MINUTE - 100_000)
    assert not receiver.accepts(extra) and receiver.rejected() == {"crowded": 1}
    receiver.clock.advance_to(begin + MINUTE + 100_000)  # time goes by
    assert receiver.accepts(extra) and not receiver.accepts(first)
    assert receiver.rejected() == {"crowded": 1, "old": 1}


def key_file(tmp_path, content, mode=0o600):
    path = tmp_path / "key"
    path.write_bytes(content)
    path.chmod(mode)
    return path


def sha256(text):
    return hashlib.sha256(text).digest()


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (bytes(range(128, 160)), bytes(range(128, 160))), (KEY.hex().encode(), KEY), (bytes(32), bytes(32)),
        (KEY.hex().upper().encode() + b"\n", KEY), (b"correct horse\n", sha256(b"correct horse")),
        ("Öl\r\n".encode(), sha256("Öl".encode())), (b"a" * 32, sha256(b"a" * 32)), (b"a" * 4096, sha256(b"a" * 4096)),
    ],
)  # fmt: skip
def test_key_files_are_read(tmp_path, content, key):
    assert load_key(key_file(tmp_path, content)) == key


POSIX = pytest.mark.skipif(os.name != "posix", reason="modes of files are POSIX's")


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


# ---- across restarts ----


class Restarts:
    """A vehicle that is killed and started again, with a clock of its own."""

    def __init__(self, file, monkeypatch):
        self.file, self.wall = file, 1.8e9
        monkeypatch.setattr(signing, "time", SimpleNamespace(time=lambda: self.wall, monotonic=lambda: self.wall))
        self.start()

    def start(self, after=0.0):
        self.wall += after
        clock = SigningClock(self.file)
        self.receiver, self.sender = Receiver(clock), Sender(clock)

    def stamp(self, ahead=0.0):
        return round((self.wall + ahead - 1420070400) * 1e5)

    def accepts(self, stamp=None):
        return self.receiver.accepts_from(stamp=self.stamp() if stamp is None else stamp)

    def sign(self):
        return self.sender.sign(heartbeat())[1]


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
                sent.append(vehicle.sign())
            else:
                frame = signed(heartbeat(), link=link, stamp=vehicle.stamp(ahead))
                captured += [frame] * vehicle.receiver.accepts(frame)
            assert not vehicle.receiver.accepts(*captured)
        assert sent == sorted(set(sent))


def test_station_goes_on_within_two_seconds_of_a_restart_and_at_once_if_it_hears_the_vehicle(vehicle):
    assert vehicle.accepts()
    vehicle.start(after=0.3)
    assert not vehicle.accepts() and vehicle.receiver.rejected() == {"old": 1}
    assert vehicle.accepts(vehicle.sign() + 1)
    vehicle.start(after=2.5)
    assert vehicle.accepts()


def test_many_restarts_in_a_row_do_not_run_ahead_of_the_clock(vehicle):
    for _ in range(500):
        vehicle.start(after=0.3)
        assert vehicle.sign() < vehicle.stamp(3.0)
    assert vehicle.file.read_text().strip().isdigit()


def test_file_is_written_seldom(vehicle, monkeypatch):
    writes = []
    monkeypatch.setattr(signing, "write_atomic", lambda file, text: writes.append(text))
    for _ in range(1000):
        vehicle.wall += 0.01
        vehicle.sign()
        vehicle.accepts()
    assert 4 <= len(writes) <= 6  # in 10 s


def test_clock_that_was_set_back_and_damaged_files_are_refused_by_name(vehicle):
    vehicle.sign()
    vehicle.wall -= 3600.0
    with pytest.raises(TelemetryError, match=r"name: is 36\d\d s ahead of the clock; set the clock, or remove"):
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
    assert vehicle.sign() and "can be replayed" in caplog.text
    assert vehicle.sign() and len(caplog.records) == 1
    with pytest.raises(TelemetryError, match="name: timestamps cannot be saved: "):
        vehicle.start()
    (tmp_path / "file").touch()
    with pytest.raises(TelemetryError, match="timestamps cannot be saved: "):
        SigningClock(tmp_path / "file" / "name")


def test_each_key_and_identity_has_a_file_that_shows_nothing_of_the_key():
    files = {timestamp_file(key, who).name for key in (KEY, OTHER) for who in ((1, 1), (255, 190), (255, 191))}
    assert len(files) == 6
    assert not any(digest.hex()[:8] in name for name in files for digest in (KEY, sha256(KEY)))


def test_frame_captured_from_a_link_is_refused_by_the_next_one(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    endpoint = Endpoint("udpin", "udpin:127.0.0.1:0", host="127.0.0.1", port=0)
    frame, messages = signed(attitude(5)), []
    for _ in range(2):
        (link,) = open_links([endpoint], MavlinkOptions(key=KEY))
        closed_later(link.channel)
        udp_socket().sendto(frame, (endpoint.host, link.channel.port))
        while not (link.stats.accepted or link.stats.old):
            messages += link.receive(time.perf_counter() + 60.0)
    assert len(messages) == 1
    assert len(list(tmp_path.rglob("*-1-1"))) == 1
