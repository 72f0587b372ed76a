"""Parameters: read, set, rejected, and as a file."""

import struct
from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from cosim.mavlink.services.packed_parameters import hash_parameters
from cosim.mavlink.services.parameter_names import parameter_names
from cosim.mavlink.services.parameter_protocol import shorten_float32
from cosim.mavlink.services.station_parameters import station_parameters
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios
from cosim.simulation.commands import LiveSettings
from cosim.simulation.commands.commands import ChangeSetting
from tests.cosim.mavlink.station import NAN, Station, scenario
from tests.examples import examples

REAL32, INT32 = 9, 6
LIST = mavlink.MAVLink_param_request_list_message(1, 1)


def read(station, name, index=-1):
    return station.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), index))


def put(station, name, value, kind=REAL32):
    return station.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, kind))


@pytest.mark.parametrize("name", list_scenarios())
def test_every_setting_has_a_name_of_its_own(name):
    keys = [setting.key for setting in LiveSettings(load_scenario(name, ["commands.enabled=true"]))]
    names = parameter_names(keys)
    assert len(set(names.values())) == len(keys)
    assert all(0 < len(n) <= 16 and n == n.upper() for n in names.values())


def test_parameter_list_waits_for_free_link_capacity(station):
    """What a slow line has no room for would be lost, and asked for again one by one."""
    station.wire.room = False
    station.send(LIST)
    station.wait(1.0)
    assert station.wire.counts()["PARAM_VALUE"] == 0
    station.wire.room = True
    station.wait(1.0)
    values = station.wire.of("PARAM_VALUE")
    assert [v.param_index for v in values] == list(range(values[0].param_count))


def test_parameter_names_are_readable():
    keys = {
        "law.gains.k_p1": "LAW_K_P1", "regions.SR1.gain": "SR1_GAIN", "regions.SR1.shape.radius": "SR1_RADIUS",
        "goal.radius": "GOAL_RADIUS", "arbiter.ramp": "ARB_RAMP", "limit.force": "LIM_FORCE",
        "plant.parameters.thrust_min[8]": "THR_MIN_8", "law.gains.position_bandwidth": "LAW_POSITION_BW",
    }  # fmt: skip
    assert parameter_names(keys) == keys


@settings(max_examples=examples(50))
@given(st.lists(st.text(max_size=25), unique=True, max_size=12))
def test_parameter_names_are_unique_for_any_keys(keys):
    names = parameter_names(keys)
    assert len(set(names.values())) == len(keys) and all(0 < len(n) <= 16 for n in names.values())
    assert names == parameter_names(keys)


def test_parameter_list_is_complete(station):
    station.send(LIST)
    station.wait(0.1)
    values = station.wire.of("PARAM_VALUE")
    assert [v.param_index for v in values] == list(range(len(values)))
    assert {v.param_count for v in values} == {len(values)}
    assert {v.param_type for v in values} == {REAL32}
    by_name = {v.param_id: v.param_value for v in values}
    assert by_name["GOAL_RADIUS"] == 0.5 and by_name["SYSID_THISMAV"] == 1.0 and by_name["FRAME_CONFIG"] == 7.0


# what QGroundControl reads as it connects, then for its summary; src/AutoPilotPlugins/APM and PX4 of 2026-05-02
SUB = [
    *(f"COMPASS_DEV_ID{i}" for i in ("", 2, 3)), *(f"INS_ACCOFFS_{a}" for a in "XYZ"),
    *(f"COMPASS_OFS{i}_{a}" for i in ("", 2, 3) for a in "XYZ"), "COMPASS_DEC", "FRAME_CONFIG", "BATT_MONITOR",
    "FS_EKF_ACTION", "FS_GCS_ENABLE", "FS_GCS_TIMEOUT", "FS_OPTIONS", "FS_LEAK_ENABLE", "FS_PILOT_INPUT",
    "FS_TEMP_ENABLE", "FS_PRESS_ENABLE", *(f"SERVO{i}_FUNCTION" for i in range(5, 15)),
]  # fmt: skip
PX4 = [
    "SYS_AUTOSTART", "CAL_ACC0_ID", "CAL_GYRO0_ID", *(f"CAL_MAG{i}_ID" for i in range(3)), "COM_RC_IN_MODE",
    *(f"RC_MAP_{stick}" for stick in ("ROLL", "PITCH", "YAW", "THROTTLE", "FLAPS", "AUX1", "AUX2")), "MAV_SYS_ID",
    *(f"COM_FLTMODE{i}" for i in range(1, 7)), "RTL_RETURN_ALT", "RTL_DESCEND_ALT", "RTL_LAND_DELAY",
    "COM_RC_LOSS_T", "COM_LOW_BAT_ACT", "NAV_RCL_ACT", "NAV_DLL_ACT", "COM_DL_LOSS_T",
]  # fmt: skip


@pytest.mark.parametrize(("profile", "names"), [("ardusub", SUB), ("px4", PX4)])
def test_qgroundcontrol_finds_its_parameters_without_setup(profile, names):
    station = Station(profile, loss_action="surface")
    values = {name: read(station, name)[0].param_value for name in names}
    if profile == "ardusub":  # APMSensorsComponent::setupComplete
        assert all(values[f"COMPASS_DEV_ID{i}"] == 0 for i in ("", 2, 3))
        assert any(values[f"INS_ACCOFFS_{axis}"] != 0 for axis in "XYZ")
        assert read(station, "SERVO8_FUNCTION")[0].param_value == 40  # motor 8, and there is no ninth
        assert values["SERVO9_FUNCTION"] == 0
    else:  # AirframeComponent, SensorsComponent and PX4RadioComponent::setupComplete
        assert values["SYS_AUTOSTART"] != 0 and values["CAL_ACC0_ID"] != 0 and values["CAL_GYRO0_ID"] != 0
        assert read(station, "SYS_HAS_MAG")[0].param_value == 0 and values["COM_RC_IN_MODE"] == 1
        assert values["NAV_DLL_ACT"] == 3  # land
    error, _ = put(station, names[0], 5.0)
    assert error.error == mavlink.MAV_PARAM_ERROR_READ_ONLY


def test_the_frame_is_that_of_the_vehicle():
    heavy = scenario(name="pipe-inspection")
    assert heavy.vehicle.name == "bluerov2_heavy"
    assert read(Station("ardusub", of=heavy), "FRAME_CONFIG")[0].param_value == 2.0  # vectored_6dof
    assert read(Station("px4", of=heavy), "SYS_AUTOSTART")[0].param_value == 60002.0


@pytest.mark.medium(fast=6)
@pytest.mark.parametrize("name", list_scenarios())
def test_parameter_names_do_not_collide_with_station_parameters(name):
    keys = [setting.key for setting in LiveSettings(scenario(name=name))]
    taken = set(parameter_names(keys).values())
    for profile in ("ardusub", "px4"):
        assert not taken & set(station_parameters(Station(profile).autopilot._context))


def test_a_flood_of_requests_makes_one_list(station):
    for _ in range(1000):
        station.send(LIST)
    assert len(station.wire.of("PARAM_VALUE")) == 50
    station.autopilot.tick(station.now + 0.02)
    assert len(station.wire.of("PARAM_VALUE")) <= 100


def test_request_during_a_listing_restarts_it(station):
    station.send(LIST)
    count = station.wire.of("PARAM_VALUE")[0].param_count
    station.wire.clear()
    station.send(LIST)
    station.wait(0.2)
    assert {v.param_index for v in station.wire.of("PARAM_VALUE")} == set(range(count))


def test_parameter_is_readable_by_name_and_by_index(station):
    (value,) = read(station, "GOAL_RADIUS")
    (same,) = read(station, "", value.param_index)
    assert (value.param_id, value.param_value) == (same.param_id, same.param_value) == ("GOAL_RADIUS", 0.5)


@pytest.mark.parametrize(("name", "index"), [("NO_SUCH", -1), ("", 9999), ("GOAL_RADIUS", 32767), ("", -1)])
def test_missing_parameter_gives_param_error(station, name, index):
    (error,) = read(station, name, index)
    assert (error.get_type(), error.error) == ("PARAM_ERROR", mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
    assert (error.target_system, error.target_component) == (255, 190)


def test_parameter_can_be_set(station):
    (value,) = put(station, "GOAL_RADIUS", 0.7)
    assert value.param_value == pytest.approx(0.7, rel=1e-7)
    assert station.commanded() == [ChangeSetting("goal.radius", 0.7)]  # with the digits that were meant
    assert read(station, "GOAL_RADIUS")[0].param_value == value.param_value


def test_unchanged_value_submits_no_command(station):
    station.send(LIST)
    station.wait(0.1)
    for value in station.wire.of("PARAM_VALUE"):
        *errors, back = put(station, value.param_id, value.param_value)
        assert back.param_value == value.param_value
        assert [error.error for error in errors] in ([], [mavlink.MAV_PARAM_ERROR_READ_ONLY])
    assert station.commanded() == []


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        ("NO_SUCH", 1.0, mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST),
        ("GOAL_RADIUS", -1.0, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("GOAL_RADIUS", NAN, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("LAW_SPEED", -1.0, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("ARB_RAMP", 1e9, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("FS_GCS_ENABLE", 2.5, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("FS_GCS_TIMEOUT", 0.0, mavlink.MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE),
        ("SYSID_THISMAV", 2.0, mavlink.MAV_PARAM_ERROR_READ_ONLY),
    ],
)
def test_invalid_value_is_rejected_and_the_old_value_returned(station, name, value, error):
    before = read(station, name)[0]
    replies = [reply for reply in put(station, name, value) if reply.get_type() != "STATUSTEXT"]
    assert (replies[0].get_type(), replies[0].error) == ("PARAM_ERROR", error)
    if before.get_type() == "PARAM_VALUE":
        assert replies[1].param_value == before.param_value
    assert station.commanded() == []
    assert name != "ARB_RAMP" or "expected 0 to 1000" in "".join(station.wire.texts)


def test_read_only_rejects_parameter_changes():
    station = Station(commands=False)
    error, old = (reply for reply in put(station, "GOAL_RADIUS", 0.7) if reply.get_type() != "STATUSTEXT")
    assert error.error == mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED and old.param_value == 0.5


def test_an_integer_is_cast_for_ardupilot_alone():
    for profile, taken in (("ardusub", True), ("px4", False), ("generic", False)):
        station = Station(profile)
        put(station, "GOAL_RADIUS", 2.0, INT32)
        assert station.commanded() == ([ChangeSetting("goal.radius", 2.0)] if taken else [])


def test_full_queue_leaves_the_value_unchanged(station):
    for i in range(300):
        put(station, "GOAL_RADIUS", 1.0 + i)
    assert len(station.commanded()) == 256
    assert read(station, "GOAL_RADIUS")[0].param_value == 256.0


def crc_by_bits(data):
    """CRC-32 of IEEE 802.3, reflected, begun with 0 and not inverted: as QGroundControl's table has it."""
    state = 0
    for byte in data:
        state ^= byte
        for _ in range(8):
            state = state >> 1 ^ (0xEDB88320 if state & 1 else 0)
    return state


def test_px4_parameter_hash_identifies_the_list():
    station = Station("px4")
    first = station.send(LIST)[0]
    kind = mavlink.MAV_PARAM_TYPE_UINT32
    assert (first.param_id, first.param_index, first.param_type) == ("_HASH_CHECK", 65535, kind)
    station.wait(0.1)
    values = station.wire.of("PARAM_VALUE")[1:]
    pairs = sorted((v.param_id.encode(), struct.pack("<f", v.param_value)) for v in values)
    by_hand = b"".join(name + value for name, value in pairs)
    assert struct.unpack("<I", struct.pack("<f", first.param_value))[0] == crc_by_bits(by_hand)
    station.wire.clear()
    station.send(LIST)
    put(station, "_HASH_CHECK", first.param_value, mavlink.MAV_PARAM_TYPE_UINT32)
    station.wire.clear()
    station.wait(0.1)
    assert station.wire.of("PARAM_VALUE") == []
    assert read(station, "_HASH_CHECK")[0].param_value == first.param_value
    assert hash_parameters({}) == 0


@settings(max_examples=examples(200))
@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_shortest_decimal_round_trips_as_float32(value):
    short = shorten_float32(value)
    assert struct.pack("<f", short) == struct.pack("<f", value)
    assert significant(short) <= significant(value)


def significant(value):
    """How many digits it takes, the zeros at both ends left out."""
    return len(Decimal(repr(value)).normalize().as_tuple().digits)
