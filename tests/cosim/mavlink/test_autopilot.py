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
from tests.cosim.mavlink.station import ACCEPTED, COLUMNS, REJECTED, Station, Wire, long, row, set_parameter
from tests.cosim.mavlink.stubs import message
from tests.examples import examples

COMMANDS = [
    16, 17, 20, 21, 22, 115, 176, 178, 179, 192, 193, 224, 246, 252, 262, 300, 400, 410, 510, 511, 512, 519, 520,
]  # fmt: skip
ARM = long(400, 1, fill=0.0)


@cache
def any_station(**options):
    station = Station(**options)
    station.look()
    return station


def number(type_name):
    if type_name == "float":
        return st.sampled_from([0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 3.4e38, 1e-40]) | st.floats(width=32)
    if type_name == "double":
        return st.floats()
    bits = int(type_name.removeprefix("u").removeprefix("int").removesuffix("_t"))
    low, high = (0, 2**bits - 1) if type_name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return st.sampled_from([low, high, 0, 1, 2, 3]) | st.integers(low, high)


def fields(kind):
    """Return a strategy for each field of a message."""
    for field, type_name in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = kind.array_lengths[kind.ordered_fieldnames.index(field)]
        value = st.binary(max_size=length) if type_name == "char" else number(type_name)
        values = st.lists(value, min_size=length, max_size=length) if length and type_name != "char" else value
        yield {"target_system": st.sampled_from([0, 1, 1, 1, 7]), "target_component": st.sampled_from([0, 1])}.get(
            field, values
        )


@st.composite
def messages(draw):
    kinds, handled = mavlink.mavlink_map, any_station().autopilot._handlers
    known = st.sampled_from([i for i in sorted(kinds) if kinds[i].msgname in handled])
    kind = kinds[draw(known | st.sampled_from(sorted(kinds)))]
    sent = kind(*map(draw, fields(kind)))
    try:
        sent.pack(mavlink.MAVLink(None))
    except (struct.error, OverflowError, TypeError):
        return message("HEARTBEAT")  # these fields cannot be packed
    return sent


@st.composite
def commands(draw):
    """Draw a command that is understood, with any parameters."""
    number_of = draw(st.sampled_from(COMMANDS))
    numbers = [draw(number("float") | st.floats(-10.0, 10.0, width=32)) for _ in range(7)]
    if draw(st.booleans()):
        return mavlink.MAVLink_command_long_message(1, 1, number_of, 0, *numbers)
    frame, x, y = draw(st.integers(0, 21)), draw(number("int32_t")), draw(number("int32_t"))
    return mavlink.MAVLink_command_int_message(1, 1, frame, number_of, 0, 0, *numbers[:4], x, y, numbers[4])


@pytest.fixture(scope="module")
def stations():
    return [any_station(profile=profile) for profile in PROFILES]


@settings(max_examples=examples(100), deadline=None)
@given(st.lists(messages(), min_size=1, max_size=4), commands())
def test_no_message_raises_an_exception_and_a_command_is_acknowledged_once(stations, sent, command):
    for station in stations:
        for each in sent:
            station.send(each, system=250)
        station.now += 3.1  # system 250 may have taken control
        station.acknowledged(command)
        station.wait(0.04)
        station.now += 3.1
        station.commanded()
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
                station.send(long(512, message_id, fill=0.0))
        station.wire.clear()


def test_documented_messages_are_streamed_at_their_rates(station):
    promised = {
        "HEARTBEAT": 1.0, "SYS_STATUS": 2.0, "SYSTEM_TIME": 1.0, "ATTITUDE": 10.0, "ATTITUDE_QUATERNION": 10.0,
        "LOCAL_POSITION_NED": 10.0, "GLOBAL_POSITION_INT": 5.0, "VFR_HUD": 5.0, "NAV_CONTROLLER_OUTPUT": 2.0,
        "SERVO_OUTPUT_RAW": 5.0, "SCALED_PRESSURE": 5.0, "SCALED_PRESSURE2": 5.0, "BATTERY_STATUS": 1.0,
        "HOME_POSITION": 1.0, "GPS_GLOBAL_ORIGIN": 0.2, "GPS_RAW_INT": 1.0, "EXTENDED_SYS_STATE": 1.0,
        "CURRENT_MODE": 0.5, "AVAILABLE_MODES_MONITOR": 0.2, "AHRS2": 10.0, "EKF_STATUS_REPORT": 2.0,
        "OBSTACLE_DISTANCE": 1.0,
    }  # fmt: skip
    for k in range(1, 2001):
        station.look(0.01 * k)
    counts = station.wire.counts()
    assert {name: counts[name] for name in promised} == {name: round(20 * rate) for name, rate in promised.items()}
    times = [m.time_boot_ms for m in station.wire.of("ATTITUDE")]
    assert times == list(range(100, 20_001, 100))


def test_heartbeat_is_sent_every_wall_clock_second(station):
    station.autopilot.tick(station.now)
    station.wire.clear()
    for k in range(1, 26):  # far slower than the wall clock
        station.wait(0.4)
        station.look(0.001 * k)
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


def test_heartbeats_are_not_starved_by_other_messages(each_station):
    # Mission Planner gives up when 200 packets go by without one
    for k in range(500):
        each_station.look(0.01 * k, **{"goal.clearance": (-3.0, 2.0, 2.0, 2.0, 3.0, 3.0)})
    indices = [i for i, m in enumerate(each_station.wire.got) if m.get_type() == "HEARTBEAT"]
    assert max(np.diff(indices)) <= 150


def test_heartbeat_identifies_the_emulated_autopilot(each_station):
    beat = each_station.request(0)[-1]
    kind = {"ardusub": (3, 4), "px4": (12, 6 << 16), "generic": (0, 6 << 16)}[each_station.profile.name]
    assert (beat.type, beat.autopilot, beat.custom_mode, beat.mavlink_version) == (12, *kind, 3)
    assert beat.base_mode & 1 and beat.base_mode & 128 and beat.system_status == mavlink.MAV_STATE_ACTIVE
    assert (beat.get_srcSystem(), beat.get_srcComponent()) == (1, 1)


def test_last_message_is_a_standby_heartbeat(station):
    station.autopilot.close(station.now)
    assert station.wire.got[-1].system_status == mavlink.MAV_STATE_STANDBY
    assert station.wire.texts[-1] == "The run has ended"


@pytest.mark.parametrize(("component", "replies"), [(100, 0), (1, 1), (0, 1)])
def test_messages_for_other_components_are_ignored(station, component, replies):
    arm = message("COMMAND_LONG", command=400, param1=1, target_system=1, target_component=component)
    assert len(station.send(arm)) == replies == len(station.commanded())


@settings(max_examples=examples(150), deadline=None)
@given(st.one_of(messages(), commands()))
def test_read_only_vehicle_applies_no_command(sent):
    station = any_station(commands=False)
    station.play(sent, 0.02, [])
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


@pytest.mark.parametrize("last", [5.0, 0.0])
def test_commands_between_runs_are_rejected(last):
    """What is accepted is followed by the run that the station sees, not by the one after it."""
    station, radius = Station(), set_parameter("SR1_RADIUS", 0.75)
    station.look(last)
    assert station.acknowledged(ARM) == ACCEPTED
    (before,) = station.send(message("PARAM_REQUEST_READ", 1, param_id=b"SR1_RADIUS", param_index=-1))
    station.commands.end_run()
    station.play((ARM, REJECTED), "Refused: the run is over")
    assert station.send(radius)[-1].param_value == before.param_value
    station.play([])
    station.look(0.0)
    station.play("The run has restarted", (ARM, ACCEPTED))
    assert station.send(radius)[-1].param_value == 0.75
    assert len(station.commanded()) == 2
