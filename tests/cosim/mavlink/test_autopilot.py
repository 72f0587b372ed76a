"""The complete vehicle under any message and any row values."""

import math
import struct
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.messages.message_table import message_specs
from cosim.mavlink.wire.options import PROFILES
from tests.cosim.mavlink.station import AT, COLUMNS, Station, Wire, row
from tests.examples import examples

KINDS = sorted(mavlink.mavlink_map)
RANGES = {"int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64}


def fields(kind, draw):
    """Draw a value for each field of a message."""
    for field, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = kind.array_lengths[kind.ordered_fieldnames.index(field)]
        if field == "target_system":
            yield draw(st.sampled_from([0, 1, 1, 1, 7]))
        elif field == "target_component":
            yield draw(st.sampled_from([0, 1]))
        elif type_name == "char":
            yield draw(st.binary(max_size=length))
        else:
            one = number(type_name)
            yield draw(st.lists(one, min_size=length, max_size=length)) if length else draw(one)


def number(type_name):
    if type_name == "float":
        return st.sampled_from([0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 3.4e38, 1e-40]) | st.floats(width=32)
    if type_name == "double":
        return st.floats()
    unsigned = type_name.startswith("u")
    bits = RANGES[type_name.removeprefix("u")]
    least, greatest = (0, 2**bits - 1) if unsigned else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return st.sampled_from([least, greatest, 0, 1, 2, 3]) | st.integers(least, greatest)


@st.composite
def messages(draw):
    handled = st.sampled_from([i for i in KINDS if mavlink.mavlink_map[i].msgname in any_station().autopilot._handlers])
    kind = mavlink.mavlink_map[draw(handled | st.sampled_from(KINDS))]
    return kind(*fields(kind, draw))


@st.composite
def commands(draw):
    """Draw a command that is understood, with any parameters."""
    number_of = draw(st.sampled_from(COMMANDS))
    numbers = [draw(number("float") | st.floats(-10.0, 10.0, width=32)) for _ in range(7)]
    if draw(st.booleans()):
        return mavlink.MAVLink_command_long_message(1, 1, number_of, 0, *numbers)
    frame, x, y = draw(st.integers(0, 21)), draw(number("int32_t")), draw(number("int32_t"))
    return mavlink.MAVLink_command_int_message(1, 1, frame, number_of, 0, 0, *numbers[:4], x, y, numbers[4])


@cache
def any_station(**options):
    return Station(**options)


COMMANDS = [
    16, 17, 20, 21, 22, 115, 176, 178, 179, 192, 193, 224, 246, 252, 262, 300, 400, 410, 510, 511, 512, 519, 520,
]  # fmt: skip


@pytest.fixture(scope="module")
def stations():
    made = [Station(profile) for profile in PROFILES]
    for station in made:
        station.look()
    return made


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(messages(), min_size=1, max_size=4))
def test_no_message_raises_an_exception(stations, sent):
    for station in stations:
        for message in sent:
            try:
                message.pack(mavlink.MAVLink(None))
            except (struct.error, OverflowError, TypeError):
                continue  # no message at all
            station.send(message, system=250)
        station.wait(0.04)
        station.commanded()
        station.wire.clear()


@settings(max_examples=examples(100), deadline=None)
@given(commands())
def test_a_command_is_acknowledged_once(stations, message):
    for station in stations:
        station.commanded()
        before = len(station.wire.got)
        station.send(message)
        acks = [m for m in station.wire.got[before:] if m.get_type() == "COMMAND_ACK"]
        assert [(a.command, a.target_system, a.target_component) for a in acks] == [(message.command, 255, 190)]
        station.wait(0.02)
        station.wire.clear()


@settings(max_examples=examples(20), deadline=None)
@given(st.binary(min_size=8 * len(COLUMNS), max_size=8 * len(COLUMNS)), st.integers(0, 5), st.floats())
def test_no_row_value_raises_an_exception(stations, bits, spoiled, often):
    whole, some = np.frombuffer(bits).copy(), row(time=1.0)
    whole[spoiled::4] = often
    some[spoiled::6] = whole[spoiled::6]
    for station in stations:
        for given_row in (whole, some):
            station.autopilot.observe(given_row)
            for message_id in message_specs():
                station.send(mavlink.MAVLink_command_long_message(1, 1, 512, 0, message_id, 0, 0, 0, 0, 0, 0))
        station.wire.clear()


def test_documented_messages_are_streamed_at_their_rates():
    promised = {
        "HEARTBEAT": 1.0, "SYS_STATUS": 2.0, "SYSTEM_TIME": 1.0, "ATTITUDE": 10.0, "ATTITUDE_QUATERNION": 10.0,
        "LOCAL_POSITION_NED": 10.0, "GLOBAL_POSITION_INT": 5.0, "VFR_HUD": 5.0, "NAV_CONTROLLER_OUTPUT": 2.0,
        "SERVO_OUTPUT_RAW": 5.0, "SCALED_PRESSURE": 5.0, "SCALED_PRESSURE2": 5.0, "BATTERY_STATUS": 1.0,
        "HOME_POSITION": 1.0, "GPS_GLOBAL_ORIGIN": 0.2, "GPS_RAW_INT": 1.0, "EXTENDED_SYS_STATE": 1.0,
        "CURRENT_MODE": 0.5, "AVAILABLE_MODES_MONITOR": 0.2, "AHRS2": 10.0, "EKF_STATUS_REPORT": 2.0,
        "OBSTACLE_DISTANCE": 1.0,
    }  # fmt: skip
    station = Station("ardusub")
    station.look(0.0)
    station.wire.clear()
    for k in range(1, 2001):
        station.look(0.01 * k)
    counts = station.wire.counts()
    assert {name: counts[name] for name in promised} == {name: round(20 * rate) for name, rate in promised.items()}
    times = [m.time_boot_ms for m in station.wire.of("ATTITUDE")]
    assert times == list(range(100, 20_001, 100))


def test_heartbeat_is_sent_every_wall_clock_second():
    station = Station()
    station.look(0.0)
    station.autopilot.tick(station.now)
    station.wire.clear()
    for _ in range(10):  # a step a second: far slower than the wall clock
        station.wait(1.0)
        station.look(0.001)
    assert 8 <= station.wire.counts()["HEARTBEAT"] <= 12


def test_streams_continue_by_wall_clock_while_simulation_is_paused():
    station = Station()
    station.look(0.0)
    station.wait(4.0)
    assert station.wire.counts()["ATTITUDE"] == pytest.approx(37, abs=4)  # half a second is waited for the next step
    assert {m.time_boot_ms for m in station.wire.of("ATTITUDE")} == {0}


def test_only_heartbeats_are_sent_before_the_first_snapshot():
    station = Station()
    station.wait(4.0)
    assert set(station.wire.counts()) == {"HEARTBEAT"}
    station.look(0.0)
    station.look(0.1)
    assert [m.time_boot_ms for m in station.wire.of("ATTITUDE")] == [0, 100]


@pytest.mark.parametrize("profile", PROFILES)
def test_heartbeats_are_not_starved_by_other_messages(profile):
    # Mission Planner gives up when 200 packets go by without one
    station = Station(profile)
    for k in range(500):
        station.look(0.01 * k, **{"goal.clearance": (-3.0, 2.0, 2.0, 2.0, 3.0, 3.0)})
    at = [i for i, m in enumerate(station.wire.got) if m.get_type() == "HEARTBEAT"]
    assert max(np.diff(at)) <= 150


@pytest.mark.parametrize(
    ("profile", "autopilot", "number"), [("ardusub", 3, 4), ("px4", 12, 6 << 16), ("generic", 0, 6 << 16)]
)
def test_heartbeat_identifies_the_emulated_autopilot(profile, autopilot, number):
    station = Station(profile)
    station.look()
    station.command(512, 0)
    beat = station.wire.of("HEARTBEAT")[-1]
    assert (beat.type, beat.autopilot, beat.custom_mode, beat.mavlink_version) == (12, autopilot, number, 3)
    assert beat.base_mode & 1 and beat.base_mode & 128 and beat.system_status == mavlink.MAV_STATE_ACTIVE
    assert (beat.get_srcSystem(), beat.get_srcComponent()) == (1, 1)


def test_last_message_is_a_standby_heartbeat():
    station = Station()
    station.look()
    station.autopilot.close(station.now)
    assert station.wire.got[-1].system_status == mavlink.MAV_STATE_STANDBY
    assert station.wire.texts[-1] == "The run has ended"


def test_messages_for_other_systems_are_ignored():
    station = Station()
    station.look()
    long = mavlink.MAVLink_command_long_message
    assert station.send(long(2, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)) == []
    assert station.send(long(1, 100, 400, 0, 1, 0, 0, 0, 0, 0, 0)) == []
    assert station.send(long(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), system=1, component=1) == []
    assert station.commanded() == []
    assert len(station.send(long(0, 0, 400, 0, 1, 0, 0, 0, 0, 0, 0))) == 1


def test_only_allowed_systems_are_accepted():
    station = Station(allowed_systems=frozenset({250}))
    station.look()
    arm = mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    assert station.send(arm, system=255) == [] and len(station.send(arm, system=250)) == 1


@settings(max_examples=examples(150), deadline=None)
@given(st.one_of(messages(), commands()))
def test_read_only_vehicle_applies_no_command(message):
    try:
        message.pack(mavlink.MAVLink(None))
    except (struct.error, OverflowError, TypeError):
        return
    station = any_station(commands=False)
    station.look()
    station.send(message)
    station.wait(0.02)
    assert station.commanded() == []
    station.wire.clear()


def test_each_link_has_its_own_streams():
    station, other = Station(), Wire("other")
    station.autopilot.attach(other)
    station.command(511, 30, -1.0)
    station.wire.clear(), other.clear()
    for k in range(100):
        station.look(0.01 * k)
    assert station.wire.counts()["ATTITUDE"] == 0 and other.counts()["ATTITUDE"] == 10


def test_run_restart_is_announced():
    station = Station()
    station.look(5.0)
    station.look(0.0)
    assert "The run has restarted" in station.wire.texts
    station.wire.clear()
    for k in range(1, 101):
        station.look(0.01 * k)
    assert station.wire.counts()["ATTITUDE"] == 10
    assert AT["time"] == 0


@pytest.mark.parametrize("last", [5.0, 0.0])
def test_commands_between_runs_are_rejected(last):
    """What is accepted is followed by the run that the station sees, not by the one after it."""
    station, accepted, rejected = Station(), 0, 1
    station.look(last)
    radius = mavlink.MAVLink_param_set_message(1, 1, b"SR1_RADIUS", 0.75, 9)
    assert station.command(400, 1.0) == accepted
    (before,) = station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"SR1_RADIUS", -1))
    station.commands.end_run()
    assert station.command(400, 1.0) == rejected
    assert "Refused: the run is over" in station.wire.texts
    assert station.send(radius)[-1].param_value == before.param_value
    assert station.commanded() == []
    station.look(0.0)
    assert "The run has restarted" in station.wire.texts
    assert station.command(400, 1.0) == accepted
    assert station.send(radius)[-1].param_value == 0.75
    assert len(station.commanded()) == 2
