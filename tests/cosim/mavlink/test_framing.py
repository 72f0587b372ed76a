"""Frames in datagrams and streams with garbage in between, checked against pymavlink's codec."""

import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v10 import all as v10

from cosim.mavlink.wire.framing import StreamReader, encode_v1, message_infos
from tests.cosim.mavlink.stubs import Station, attitude, heartbeat, mavlink, odometry, open_filter, request_list


def any_message(kind, value=3):
    """Return a message of a class with a value in all of its fields."""
    values = []
    for name in kind.fieldnames:
        array = kind.array_lengths[kind.ordered_fieldnames.index(name)]
        sort = kind.fieldtypes[kind.fieldnames.index(name)]
        if sort == "char":
            values.append(bytes([120 * value // 3]) * max(array, 1))
        else:
            values.append([value] * array if array else value)
    return kind(*values)


def test_frames_of_mavlink_1_are_those_of_its_dialect():
    """Whatever MAVLink 2 cuts off or adds; by pymavlink's own dialect of MAVLink 1."""
    codec, old = mavlink.MAVLink(None, 7, 1), v10.MAVLink(None, 7, 1)
    for number, kind in mavlink.mavlink_map.items():
        for value in (0, 3):
            frame = encode_v1(bytes(any_message(kind, value).pack(codec)), 5)
            assert (frame is None) == (number > 255)
            if number in v10.mavlink_map and number < 256:
                old.seq = 5
                assert frame == bytes(any_message(v10.mavlink_map[number], value).pack(old)), kind.msgname


def names(frames):
    return [message.get_type() for _, message in frames]


def refusals(counts):
    return {name: getattr(counts, name) for name in counts.__slots__ if name != "accepted" and getattr(counts, name)}


@pytest.mark.parametrize("v1", [False, True])
def test_every_message_passes_only_if_addressed_to_the_vehicle(v1):
    station = Station()
    for number, kind in mavlink.mavlink_map.items():
        if v1 and number > 255:
            continue
        frame = station.pack(any_message(kind), v1)
        ours, theirs = open_filter(own=(3, 1)), open_filter(own=(4, 1))
        found = list(ours.read_datagram(frame))
        if kind.msgname == "SETUP_SIGNING":
            assert not found and ours.stats.setup_signing == 1
            continue
        assert names(found) == [kind.msgname]
        assert found[0][0] == frame
        assert found[0][1].to_dict() == station.parse(frame)[0].to_dict()
        meant = any(name in kind.fieldnames for name in ("target_system", "target"))
        assert len(list(theirs.read_datagram(frame))) == (not meant)
        assert theirs.stats.foreign == meant


def test_broadcast_and_any_component_targets_are_accepted():
    rx, station = open_filter(), Station()
    assert names(rx.read_datagram(station.pack(request_list(0)))) == ["PARAM_REQUEST_LIST"]  # zeros are cut off
    assert names(rx.read_datagram(station.pack(mavlink.MAVLink_param_request_list_message(1, 77))))
    assert names(rx.read_datagram(station.pack(mavlink.MAVLink_manual_control_message(1, 1, 2, 3, 4, 0))))
    assert not names(rx.read_datagram(station.pack(mavlink.MAVLink_manual_control_message(2, 1, 2, 3, 4, 0))))
    assert refusals(rx.stats) == {"foreign": 1}


def test_own_frames_and_disallowed_systems_are_rejected():
    rx = open_filter(allowed=frozenset({1, 255}))
    assert not list(rx.read_datagram(Station(1, 1).pack(heartbeat())))
    assert not list(rx.read_datagram(Station(245, 190).pack(heartbeat())))
    assert len(list(rx.read_datagram(Station(1, 191).pack(heartbeat())))) == 1  # a companion of ours
    assert len(list(rx.read_datagram(Station(255, 190).pack(heartbeat())))) == 1
    assert refusals(rx.stats) == {"own": 1, "system": 1}


def test_setup_signing_message_is_ignored():
    rx = open_filter()
    assert not list(rx.read_datagram(Station().pack(mavlink.MAVLink_setup_signing_message(1, 1, [1] * 32, 5))))
    assert refusals(rx.stats) == {"setup_signing": 1}


def test_unknown_message_is_dropped_without_its_neighbors():
    station = Station()
    unknown = bytearray(station.pack(attitude(1)))
    unknown[7:10] = (0xABCDEF).to_bytes(3, "little")
    rx = open_filter()
    data = station.pack(heartbeat()) + unknown + station.pack(attitude(2))
    assert names(rx.read_datagram(data)) == ["HEARTBEAT", "ATTITUDE"]
    assert refusals(rx.stats) == {"unknown": 1}
    assert rx.stats.rejected() == {}  # nothing that a user need hear of
    rx = open_filter()
    assert names(StreamReader(rx).read(data)) == ["HEARTBEAT", "ATTITUDE"]
    assert refusals(rx.stats) == {"unknown": 1}


@pytest.mark.parametrize("bad", [b"\xfd\xff\x00", b"\xfe", b"\xfd" * 300, b"\xfe" * 300, b"junk", b"", None])
def test_malformed_datagram_loses_no_following_frame(bad):
    station = Station()
    bad = station.pack(odometry())[:100] if bad is None else bad
    frames = [station.pack(attitude(i)) for i in range(50)]
    rx = open_filter()
    assert not list(rx.read_datagram(bad))
    assert [m.time_boot_ms for frame in frames for _, m in rx.read_datagram(frame)] == list(range(50))
    reader = StreamReader(open_filter())  # and in one stream, however it is cut
    data = bad + b"".join(frames)
    found = [m.time_boot_ms for i in range(0, len(data), 7) for _, m in reader.read(data[i : i + 7])]
    assert found == list(range(50))


@pytest.mark.medium
def test_corrupted_frame_is_rejected_and_the_stream_continues():
    station = Station()
    good = station.pack(odometry())
    for i in range(len(good) * 8):
        bad = bytearray(good)
        bad[i // 8] ^= 1 << i % 8
        rx = open_filter()
        assert not list(rx.read_datagram(bytes(bad)))
        assert sum(refusals(rx.stats).values()) >= 1
        reader = StreamReader(open_filter())
        after = b"".join(station.pack(attitude(t)) for t in range(8))
        assert names(reader.read(bytes(bad) + after)) == ["ATTITUDE"] * 8


def test_decoder_error_counts_as_malformed():
    """Unknown incompatibility flags must not be ignored."""
    frame = bytearray(Station().pack(heartbeat()))
    frame[2] = 2
    crc = mavlink.x25crc(bytes(frame[1:-2]) + bytes([mavlink.MAVLink_heartbeat_message.crc_extra])).crc
    frame[-2:] = struct.pack("<H", crc)
    rx = open_filter()
    assert not list(rx.read_datagram(bytes(frame)))
    assert refusals(rx.stats) == {"malformed": 1}


def test_longer_payload_of_a_newer_dialect_is_truncated():
    payload = struct.pack("<IBBBBB", 7, 12, 0, 0, 4, 3) + b"new"
    head = bytes([0xFD, len(payload), 0, 0, 0, 255, 190, 0, 0, 0]) + payload
    crc = mavlink.x25crc(head[1:] + bytes([mavlink.MAVLink_heartbeat_message.crc_extra])).crc
    ((_, message),) = open_filter().read_datagram(head + struct.pack("<H", crc))
    assert message.custom_mode == 7 and message.mavlink_version == 3


def test_stream_buffer_holds_at_most_one_frame():
    rng = random.Random(1)
    reader = StreamReader(open_filter())
    for data in (b"\xfd" * 5000, b"\xfe\xff" * 5000, rng.randbytes(20000), bytes(20000)):
        for i in range(0, len(data), 97):
            list(reader.read(data[i : i + 97]))
            assert len(reader._rest) <= 280


def test_stream_reader_matches_pymavlink():
    station, rng = Station(), random.Random(0)
    sent = [station.pack(any_message(kind)) for kind in mavlink.mavlink_map.values() if kind.msgname != "SETUP_SIGNING"]
    data = b"".join(sent)
    reader, found = StreamReader(open_filter(own=None)), []
    at = 0
    while at < len(data):
        size = rng.randrange(1, 400)
        found += [frame for frame, _ in reader.read(data[at : at + size])]
        at += size
    assert found == sent
    assert [m.get_msgbuf() for m in station.parse(data)] == sent


frames = st.sampled_from(
    [Station().pack(m) for m in (heartbeat(), attitude(5), odometry(), request_list())]
    + [Station().pack(heartbeat(), v1=True)]
)
pieces = st.lists(st.binary(max_size=300) | frames | frames.map(lambda f: f[:-3]) | frames.map(lambda f: f[3:]))


@given(pieces, st.integers(1, 600))
def test_arbitrary_bytes_raise_nothing_and_invent_no_frame(parts, chunk):
    data = b"".join(parts)
    rx = open_filter()
    list(rx.read_datagram(data))
    reader = StreamReader(open_filter())
    for i in range(0, len(data), chunk):
        for frame, _ in reader.read(data[i : i + chunk]):
            assert frame in data


@given(st.sampled_from(sorted(message_infos())), st.binary(max_size=255), st.booleans(), st.integers(0, 255))
def test_valid_checksum_with_any_payload_raises_nothing(number, payload, v1, flags):
    if v1 and number < 256:
        head = bytes([0xFE, len(payload), 0, 255, 190, number])
    else:
        head = bytes([0xFD, len(payload), flags, 0, 0, 255, 190]) + number.to_bytes(3, "little")
    body = head + payload
    crc = mavlink.x25crc(body[1:] + bytes([mavlink.mavlink_map[number].crc_extra])).crc
    frame = body + struct.pack("<H", crc) + bytes(13 * (flags & 1))
    list(open_filter().read_datagram(frame))
    list(StreamReader(open_filter()).read(frame))
