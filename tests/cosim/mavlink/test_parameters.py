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
from cosim.simulation.commands.commands import ChangeSetting
from cosim.simulation.commands.settings import LiveSettings
from tests.cosim.mavlink.station import NAN, Station, scenario, set_parameter
from tests.cosim.mavlink.stubs import message
from tests.examples import examples

REAL32, INT32 = 9, 6
LIST = message("PARAM_REQUEST_LIST", 1)


def read(station, name, index=-1):
    """Return the one reply to a request of a parameter."""
    (reply,) = station.send(message("PARAM_REQUEST_READ", 1, param_id=name.encode(), param_index=index))
    return reply


def value_of(station, name):
    return read(station, name).param_value


def put(station, name, value, kind=REAL32):
    """Set a parameter; return the replies in their order: the number of an error, the name and value sent back."""
    replies = [r for r in station.send(set_parameter(name, value, kind)) if r.get_type() != "STATUSTEXT"]
    return [r.error if r.get_type() == "PARAM_ERROR" else (r.param_id, r.param_value) for r in replies]


def listed(station, seconds=0.1):
    """Return the list of parameters that a request brings."""
    station.wire.clear()
    station.send(LIST)
    station.wait(seconds)
    return station.wire.of("PARAM_VALUE")


@pytest.mark.medium(fast=6)
@pytest.mark.parametrize("name", list_scenarios())
def test_every_setting_has_a_name_of_its_own_and_none_of_a_station_parameter(name):
    shipped = load_scenario(name)
    keys = [setting.key for setting in LiveSettings(shipped if shipped.goal_then else scenario(name=name))]
    names = parameter_names(keys)
    assert len(set(names.values())) == len(keys)
    assert all(0 < len(n) <= 16 and n == n.upper() for n in names.values())
    for profile in ("ardusub", "px4"):
        assert not set(names.values()) & set(station_parameters(Station(profile).context))


def test_parameter_list_waits_for_free_link_capacity(station):
    """What a slow line has no room for would be lost, and asked for again one by one."""
    station.wire.room = False
    assert listed(station, 1.0) == []
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
    values = listed(station)
    assert [v.param_index for v in values] == list(range(len(values)))
    assert {(v.param_count, v.param_type) for v in values} == {(len(values), REAL32)}
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
    "COM_RC_LOSS_T", "COM_LOW_BAT_ACT", "NAV_RCL_ACT", "NAV_DLL_ACT", "COM_DL_LOSS_T", "SYS_HAS_MAG",
]  # fmt: skip


@pytest.mark.parametrize(("profile", "names"), [("ardusub", SUB), ("px4", PX4)])
def test_qgroundcontrol_finds_its_parameters_without_setup(profile, names):
    station = Station(profile, loss_action="surface")
    values = {name: value_of(station, name) for name in names}
    if profile == "ardusub":  # APMSensorsComponent::setupComplete
        assert all(values[f"COMPASS_DEV_ID{i}"] == 0 for i in ("", 2, 3))
        assert any(values[f"INS_ACCOFFS_{axis}"] != 0 for axis in "XYZ")
        assert [values[f"SERVO{i}_FUNCTION"] for i in (8, 9)] == [40, 0]  # motor 8, and there is no ninth
    else:  # AirframeComponent, SensorsComponent and PX4RadioComponent::setupComplete
        assert values["SYS_AUTOSTART"] != 0 and values["CAL_ACC0_ID"] != 0 and values["CAL_GYRO0_ID"] != 0
        assert values["SYS_HAS_MAG"] == 0 and values["COM_RC_IN_MODE"] == 1
        assert values["NAV_DLL_ACT"] == 3  # land
    assert put(station, names[0], 5.0)[0] == mavlink.MAV_PARAM_ERROR_READ_ONLY


def test_the_frame_is_that_of_the_vehicle():
    heavy = scenario(name="pipe-inspection")
    assert heavy.vehicle.name == "bluerov2_heavy"
    assert value_of(Station("ardusub", of=heavy), "FRAME_CONFIG") == 2.0  # vectored_6dof
    six_thrusters = scenario("vehicle=bluerov2", name="pipe-inspection")
    assert value_of(Station("ardusub", of=six_thrusters), "FRAME_CONFIG") == 1.0  # vectored
    assert value_of(Station("px4", of=heavy), "SYS_AUTOSTART") == 60002.0


def test_a_flood_of_requests_makes_one_list(station):
    for _ in range(1000):
        station.send(LIST)
    assert len(station.wire.of("PARAM_VALUE")) == 50
    station.autopilot.tick(station.now + 0.02)
    assert len(station.wire.of("PARAM_VALUE")) <= 100


def test_request_during_a_listing_restarts_it(station):
    station.send(LIST)
    count = station.wire.of("PARAM_VALUE")[0].param_count
    assert {v.param_index for v in listed(station, 0.2)} == set(range(count))


def test_parameter_is_readable_by_name_and_by_index(station):
    value = read(station, "GOAL_RADIUS")
    same = read(station, "", value.param_index)
    assert (value.param_id, value.param_value) == (same.param_id, same.param_value) == ("GOAL_RADIUS", 0.5)


@pytest.mark.parametrize(("name", "index"), [("NO_SUCH", -1), ("", 9999), ("GOAL_RADIUS", 32767), ("", -1)])
def test_missing_parameter_gives_param_error(station, name, index):
    error = read(station, name, index)
    assert (error.get_type(), error.error) == ("PARAM_ERROR", mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST)
    assert (error.target_system, error.target_component) == (255, 190)


def test_parameter_can_be_set(station):
    ((name, value),) = put(station, "GOAL_RADIUS", 0.7)
    assert (name, value) == ("GOAL_RADIUS", pytest.approx(0.7, rel=1e-7))
    assert station.commanded() == [ChangeSetting("goal.radius", 0.7)]  # with the digits that were meant
    assert value_of(station, "GOAL_RADIUS") == value


def test_former_names_with_centre_are_read_and_set(station):
    assert (read(station, "GOAL_CENTRE_X").param_id, value_of(station, "GOAL_CENTRE_X")) == ("GOAL_CENTRE_X", 8.0)
    assert put(station, "SR1_CENTRE_Y", 0.5) == [("SR1_CENTRE_Y", 0.5)]
    assert station.commanded() == [ChangeSetting("regions.SR1.shape.center.1", 0.5)]
    assert value_of(station, "SR1_CENTER_Y") == 0.5
    assert read(station, "SR1_CENTRE").error == mavlink.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_unchanged_value_submits_no_command(station):
    for value in listed(station):
        *errors, back = put(station, value.param_id, value.param_value)
        assert back == (value.param_id, value.param_value) and errors in ([], [mavlink.MAV_PARAM_ERROR_READ_ONLY])
    assert station.commanded() == []


@pytest.mark.parametrize(
    ("name", "value", "error", "words"),
    [
        ("NO_SUCH", 1.0, "DOES_NOT_EXIST", None), ("SYSID_THISMAV", 2.0, "READ_ONLY", None),
        ("GOAL_RADIUS", -1.0, "VALUE_OUT_OF_RANGE", ""), ("GOAL_RADIUS", NAN, "VALUE_OUT_OF_RANGE", ""),
        ("LAW_SPEED", -1.0, "VALUE_OUT_OF_RANGE", ""), ("ARB_RAMP", 1e9, "VALUE_OUT_OF_RANGE", "expected 0 to 1000"),
        ("FS_GCS_ENABLE", 2.5, "VALUE_OUT_OF_RANGE", "1 warn"), ("FS_GCS_TIMEOUT", 0.0, "VALUE_OUT_OF_RANGE", "to 120"),
    ],
)  # fmt: skip
def test_invalid_value_is_rejected_and_the_old_value_returned(station, name, value, error, words):
    before = [(name, value_of(station, name))] if name != "NO_SUCH" else []
    assert put(station, name, value) == [getattr(mavlink, f"MAV_PARAM_ERROR_{error}"), *before]
    station.play([], words)


def test_read_only_rejects_parameter_changes():
    station = Station(commands=False)
    assert put(station, "GOAL_RADIUS", 0.7) == [mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED, ("GOAL_RADIUS", 0.5)]


def test_an_integer_is_cast_for_ardupilot_alone(each_station):
    put(each_station, "GOAL_RADIUS", 2.0, INT32)
    is_cast = each_station.profile.name == "ardusub"
    assert each_station.commanded() == ([ChangeSetting("goal.radius", 2.0)] if is_cast else [])


def test_full_queue_leaves_the_value_unchanged(station):
    for i in range(300):
        put(station, "GOAL_RADIUS", 1.0 + i)
    assert len(station.commanded()) == 256
    settings = {setting.key: setting.value for setting in station.context.settings}
    assert value_of(station, "GOAL_RADIUS") == settings["goal.radius"] == 256.0


def crc_by_bits(data):
    """CRC-32 of IEEE 802.3, reflected, begun with 0 and not inverted: as QGroundControl's table has it."""
    state = 0
    for byte in data:
        state ^= byte
        for _ in range(8):
            state = state >> 1 ^ (0xEDB88320 if state & 1 else 0)
    return state


def test_px4_parameter_hash_identifies_the_list():
    station, kind = Station("px4"), mavlink.MAV_PARAM_TYPE_UINT32
    first, *values = listed(station)
    assert (first.param_id, first.param_index, first.param_type) == ("_HASH_CHECK", 65535, kind)
    pairs = sorted((v.param_id.encode(), struct.pack("<f", v.param_value)) for v in values)
    by_hand = b"".join(name + value for name, value in pairs)
    assert struct.unpack("<I", struct.pack("<f", first.param_value))[0] == crc_by_bits(by_hand)
    station.send(LIST)
    put(station, "_HASH_CHECK", first.param_value, kind)
    station.wire.clear()
    station.wait(0.1)
    assert station.wire.of("PARAM_VALUE") == []
    assert value_of(station, "_HASH_CHECK") == first.param_value
    assert hash_parameters({}) == 0


@settings(max_examples=examples(200))
@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_shortest_decimal_round_trips_as_float32(value):
    short = shorten_float32(value)
    assert struct.pack("<f", short) == struct.pack("<f", value)
    digits = [len(Decimal(repr(x)).normalize().as_tuple().digits) for x in (short, value)]  # without zeros at both ends
    assert digits[0] <= digits[1]
