"""The wire format, against manually assembled bytes and a parser as simple as ArduPilot's."""

import json
import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cosim.errors import RunError
from cosim.sitl.json_protocol import ServoPacket, format_motion, parse_packet
from cosim.sitl.motion import Motion
from tests.cosim.sitl.stand_in import newest_line, parse

AT_REST = Motion(
    0.25, (0.0, 0.0, 0.0), (0.0, 0.0, -9.81), (1.0, 2.0, 3.0), (0.1, 0.2, 0.3), (0.0, 0.0, 0.5), (1.0, 0.0, 0.0, 0.0),
    None, (0.1, 0.2, 0.3),
)  # fmt: skip


@pytest.mark.parametrize(
    ("data", "packet"),
    [
        ("1a48 b004 39300000" + "dc05" * 15 + "6c07", ServoPacket(1200, 12345, (1500,) * 15 + (1900,))),
        ("8173 9001 ffffffff" + "0000" * 31 + "4c04", ServoPacket(400, 2**32 - 1, (0,) * 31 + (1100,))),
    ],
)
def test_packets_of_16_and_32_channels_are_decoded(data, packet):
    assert parse_packet(bytes.fromhex(data)) == packet


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x1a\x48",
        struct.pack("<HHI16H", 18459, 1200, 0, *[1500] * 16),
        struct.pack("<HHI16H", 29569, 1200, 0, *[1500] * 16),  # the other one's magic
        struct.pack("<HHI32H", 18458, 1200, 0, *[1500] * 32),
        struct.pack(">HHI16H", 18458, 1200, 0, *[1500] * 16),  # big end first
        struct.pack("<HHI16H", 18458, 1200, 0, *[1500] * 16) + b"\0",
        struct.pack("<HHI16H", 18458, 1200, 0, *[1500] * 16)[:-1],
    ],
)
def test_invalid_servo_packets_are_rejected(data):
    assert parse_packet(data) is None


def test_json_line_is_compact_and_delimited_by_newlines():
    data = format_motion(AT_REST)
    assert data == (
        b'\n{"timestamp":0.25,"imu":{"gyro":[0.0,0.0,0.0],"accel_body":[0.0,0.0,-9.81]},"position":[1.0,2.0,3.0],'
        b'"velocity":[0.1,0.2,0.3],"attitude":[0.0,0.0,0.5],"quaternion":[1.0,0.0,0.0,0.0]}\n'
    )
    assert b" " not in data


def test_the_naive_reader_refuses_blanks_behind_colons():
    """As the autopilot does, so that the test above tests something."""
    line = json.dumps(json.loads(format_motion(AT_REST)))
    with pytest.raises(ValueError, match="imu/gyro"):
        parse(line)


def test_naive_reader_matches_the_first_key_substring():
    with pytest.raises(ValueError, match="/position"):
        parse('{"position_of_home":0,' + newest_line(format_motion(AT_REST))[1:])


finite = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300)
three = st.tuples(finite, finite, finite)
motions = st.builds(Motion, finite, *[three] * 5, st.tuples(*[finite] * 4), st.none() | finite, three)


@given(motions)
def test_every_number_is_read_back_to_the_last_bit(motion):
    line = newest_line(format_motion(motion))
    said, table = parse(line), json.loads(line)
    names = ("timestamp", "gyro", "accel_body", "position", "velocity", "attitude", "quaternion", "rng_1")
    for name, value in zip(names, motion[:-1], strict=True):
        if value is None:
            assert name not in said
            continue
        assert repr(said[name]) == repr(value)  # which tells -0.0 from 0.0
    assert list(table) == [
        "timestamp", "imu", "position", "velocity", "attitude", "quaternion", *["rng_1"] * (motion.altitude is not None)
    ]  # fmt: skip
    assert list(table["imu"]) == ["gyro", "accel_body"]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["gyro", "specific_force", "position_ned", "velocity_ned", "altitude"])
def test_non_finite_state_is_never_sent(field, bad):
    value = bad if field == "altitude" else (0.0, bad, 0.0)
    with pytest.raises(RunError, match=r"t = 0.25 s: the vehicle's state is not finite"):
        format_motion(AT_REST._replace(**{field: value}))
