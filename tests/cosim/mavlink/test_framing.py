"""Frames in datagrams and streams with garbage in between, checked against pymavlink's codec."""

import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import all as v10
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.wire.framing import StreamReader, encode_v1, message_infos
from tests.cosim.mavlink.stubs import Codec, attitude, heartbeat, message, odometry, open_filter

KINDS = {number: kind.msgname for number, kind in mavlink.mavlink_map.items()}


def with_checksum(frame, number):
    """Return a frame with the checksum of a message with that number."""
    crc = mavlink.x25crc(bytes(frame[1:]) + bytes([mavlink.mavlink_map[number].crc_extra])).crc
    return bytes(frame) + struct.pack("<H", crc)


def read(rx, data):
    """Return the messages of a datagram, their names, and what was counted beside accepted ones."""
    pairs = list(rx.read_datagram(data))
    assert all(frame == m.get_msgbuf() and frame in data for frame, m in pairs)
    messages = [m for _, m in pairs]
    counts = {name: n for name in rx.stats.__slots__ if name != "accepted" and (n := getattr(rx.stats, name))}
    return messages, [m.get_type() for m in messages], counts


def stream(data, size, reader=None):
    """Return the frames that a stream gives in pieces of a size, and their messages."""
    reader = reader or StreamReader(open_filter())
    return [pair for i in range(0, len(data), size) for pair in reader.read(data[i : i + size])]


def test_frames_of_mavlink_1_are_those_of_its_dialect():
    """Whatever MAVLink 2 cuts off or adds; by pymavlink's own dialect of MAVLink 1."""
    codec, old = mavlink.MAVLink(None, 7, 1), v10.MAVLink(None, 7, 1)
    for number, name in KINDS.items():
        for value in (0, 3):
            sent = message(name, value)
            frame = encode_v1(bytes(sent.pack(codec)), 5)
            assert (frame is None) == (number > 255)
            if number in v10.mavlink_map and number < 256:
                old.seq, kind = 5, v10.mavlink_map[number]
                fields = [getattr(sent, f"_{field}_raw", getattr(sent, field)) for field in kind.fieldnames]
                assert frame == bytes(kind(*fields).pack(old)), name


@pytest.mark.parametrize("v1", [False, True])
def test_every_message_passes_only_if_addressed_to_the_vehicle(v1):
    station = Codec()
    for number, name in KINDS.items():
        if v1 and number > 255:
            continue
        frame = station.pack(message(name, 3), v1)
        (messages, _, counts), (foreign, _, others) = (read(open_filter(own=(system, 1)), frame) for system in (3, 4))
        if name == "SETUP_SIGNING":
            assert not messages and counts == {"setup_signing": 1}
            continue
        assert [m.to_dict() for m in messages] == [station.parse(frame)[0].to_dict()]
        meant = any(field in mavlink.mavlink_map[number].fieldnames for field in ("target_system", "target"))
        assert len(foreign) == (not meant) and others == ({"foreign": 1} if meant else {})


@pytest.mark.parametrize(
    ("sent", "sender", "outcome"),
    [
        (message("PARAM_REQUEST_LIST"), (255, 190), ""),  # to all: zeros are cut off
        (message("PARAM_REQUEST_LIST", target_system=1, target_component=77), (255, 190), ""),
        (message("MANUAL_CONTROL", 1), (255, 190), ""), (message("MANUAL_CONTROL", 2), (255, 190), "foreign"),
        (heartbeat(), (1, 1), "own"), (heartbeat(), (1, 191), ""),  # a companion of ours
        (heartbeat(), (245, 190), "system"), (message("SETUP_SIGNING", 1), (255, 190), "setup_signing"),
    ],
)  # fmt: skip
def test_frames_are_accepted_by_target_and_sender(sent, sender, outcome):
    rx = open_filter(allowed=frozenset({1, 255}))
    messages, _, counts = read(rx, Codec(*sender).pack(sent))
    assert len(messages) == (not outcome) and counts == ({outcome: 1} if outcome else {})


def test_unknown_message_is_dropped_without_its_neighbors():
    station, rx = Codec(), open_filter()
    unknown = bytearray(station.pack(attitude(1)))
    unknown[7:10] = (0xABCDEF).to_bytes(3, "little")
    data = station.pack(heartbeat()) + unknown + station.pack(attitude(2))
    assert read(rx, data)[1:] == (["HEARTBEAT", "ATTITUDE"], {"unknown": 1})
    assert rx.stats.rejected() == {}  # nothing that a user need hear of
    reader = StreamReader(rx := open_filter())
    assert [m.get_type() for _, m in reader.read(data)] == ["HEARTBEAT", "ATTITUDE"] and rx.stats.unknown == 1


@pytest.mark.parametrize("bad", [b"\xfd\xff\x00", b"\xfe", b"\xfd" * 300, b"\xfe" * 300, b"junk", b"", None])
def test_malformed_datagram_loses_no_following_frame(bad):
    station, rx, times = Codec(), open_filter(), list(range(50))
    bad = station.pack(odometry())[:100] if bad is None else bad
    frames = [station.pack(attitude(i)) for i in times]
    assert not read(rx, bad)[0]
    assert [m.time_boot_ms for frame in frames for m in read(rx, frame)[0]] == times
    # and in one stream, however it is cut
    assert [m.time_boot_ms for _, m in stream(bad + b"".join(frames), 7)] == times


@pytest.mark.medium
def test_corrupted_frame_is_rejected_and_the_stream_continues():
    station = Codec()
    good = station.pack(odometry())
    for i in range(len(good) * 8):
        bad = bytearray(good)
        bad[i // 8] ^= 1 << i % 8
        messages, _, counts = read(open_filter(), bytes(bad))
        assert not messages and counts
        after = b"".join(station.pack(attitude(t)) for t in range(8))
        assert [m.get_type() for _, m in stream(bytes(bad) + after, 4096)] == ["ATTITUDE"] * 8


def test_decoder_error_counts_as_malformed():
    """Unknown incompatibility flags must not be ignored."""
    frame = bytearray(Codec().pack(heartbeat()))
    frame[2] = 2
    assert read(open_filter(), with_checksum(frame[:-2], 0)) == ([], [], {"malformed": 1})


def test_longer_payload_of_a_newer_dialect_is_truncated_in_mavlink_2():
    payload = struct.pack("<IBBBBB", 7, 12, 0, 0, 4, 3) + b"new"
    head = bytes([0xFD, len(payload), 0, 0, 0, 255, 190, 0, 0, 0])
    ((message,), _, _) = read(open_filter(), with_checksum(head + payload, 0))
    assert message.custom_mode == 7 and message.mavlink_version == 3
    old = bytes([0xFE, len(payload), 0, 255, 190, 0])  # in MAVLink 1 no field may be added
    assert read(open_filter(), with_checksum(old + payload, 0)) == ([], [], {"checksum": 1})


def test_stream_buffer_holds_at_most_one_frame():
    reader = StreamReader(open_filter())
    for data in (b"\xfd" * 5000, b"\xfe\xff" * 5000, random.Random(1).randbytes(20000), bytes(20000)):
        for i in range(0, len(data), 97):
            list(reader.read(data[i : i + 97]))
            assert len(reader._rest) <= 280


def test_stream_reader_matches_pymavlink():
    station, rng = Codec(), random.Random(0)
    sent = [station.pack(message(name, 3)) for name in KINDS.values() if name != "SETUP_SIGNING"]
    data, reader, frames = b"".join(sent), StreamReader(open_filter(own=None)), []
    rest = data
    while rest:
        size = rng.randrange(1, 400)
        frames += [frame for frame, _ in reader.read(rest[:size])]
        rest = rest[size:]
    assert frames == sent == [m.get_msgbuf() for m in station.parse(data)]


frames = st.sampled_from(
    [Codec().pack(m) for m in (heartbeat(), attitude(5), odometry(), message("PARAM_REQUEST_LIST", 1))]
    + [Codec().pack(heartbeat(), v1=True)]
)
pieces = st.lists(st.binary(max_size=300) | frames | frames.map(lambda f: f[:-3]) | frames.map(lambda f: f[3:]))


@given(pieces, st.integers(1, 600))
def test_arbitrary_bytes_raise_nothing_and_invent_no_frame(parts, chunk):
    data = b"".join(parts)
    read(open_filter(), data)
    assert all(frame in data for frame, _ in stream(data, chunk))


@given(st.sampled_from(sorted(message_infos())), st.binary(max_size=255), st.booleans(), st.integers(0, 255))
def test_valid_checksum_with_any_payload_raises_nothing(number, payload, v1, flags):
    head = bytes([0xFD, len(payload), flags, 0, 0, 255, 190]) + number.to_bytes(3, "little")
    if v1 and number < 256:
        head = bytes([0xFE, len(payload), 0, 255, 190, number])
    frame = with_checksum(head + payload, number) + bytes(13 * (flags & 1))
    read(open_filter(), frame)
    stream(frame, 4096)
