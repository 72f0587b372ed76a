"""The content of telemetry messages for a given snapshot."""

import math
from importlib import metadata

import numpy as np
import pytest
from packaging.version import Version
from pymavlink.dialects.v20 import all as mavlink

from controller.quaternion import from_axis_angle, multiply, rotation_matrix
from cosim.mavlink.messages.control import weight_names
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.row_layout import RowLayout, quaternion_to_euler
from cosim.mavlink.vehicle.view import View
from cosim.mavlink.wire.encode import Encoder
from cosim.simulation.columns import column_names
from cosim.simulation.signals import Column
from tests.cosim.mavlink.station import ACCEPTED, DENIED, Station, long, scenario

TURN = from_axis_angle(np.array([0.0, 0.0, 1.0]), 2.0)
EULER = (0.0, 0.0, 2.0)
OWN = Version(metadata.version("subreach")).release
NORTH, EAST, DOWN = rotation_matrix(TURN) @ np.array([0.5, -0.2, 0.1])
SURFACE = 1013.25  # hPa


@pytest.fixture
def station():
    station = Station("ardusub")
    station.look(
        12.5,
        **{
            "quaternion.e0": tuple(TURN), "attitude.roll": EULER, "velocity.u": (0.5, -0.2, 0.1, 0.01, 0.02, 0.03),
            "weight.obstacle": (0.7, 0.2, 0.1), "estimate.phi1": (1.0, 2.0, 3.0, 4.0), "law.constraint_slack": 0.25,
            "thruster_force[1]": (13.5, -27.0, 0.0, 54.0), "measured.acceleration.x": (0.0, 0.0, -9.80665),
        },
    )  # fmt: skip
    return station


FIELDS = {
    "ATTITUDE": {"time_boot_ms": 12_500, "yaw": 2.0, "yawspeed": 0.03},
    "ATTITUDE_QUATERNION": {"q1": math.cos(1.0), "q2": 0.0, "q4": math.sin(1.0)},
    "LOCAL_POSITION_NED": {"x": 1.0, "y": 2.0, "z": 5.0, "vx": NORTH, "vy": EAST, "vz": DOWN},
    "GLOBAL_POSITION_INT": {
        "relative_alt": -5000, "alt": -5000, "hdg": round(math.degrees(2.0) * 100), "vx": round(NORTH * 100),
        "vy": round(EAST * 100), "vz": round(DOWN * 100)},
    "VFR_HUD": {"alt": -5.0, "climb": -DOWN, "heading": 115, "throttle": 100},
    "ODOMETRY": {"frame_id": 1, "child_frame_id": 12, "estimator_type": 8, "vx": 0.5, "pose_covariance": math.nan},
    "SCALED_PRESSURE2": {"press_abs": SURFACE + 490.3325, "press_diff": 490.3325},  # 5 m of fresh water
    "SCALED_PRESSURE": {"press_abs": SURFACE},
    "ACTUATOR_OUTPUT_STATUS": {"actuator": [0.5, -1.0, 0.0, 1.0, *[0.0] * 28], "active": 0xFF},
    "POSITION_TARGET_LOCAL_NED": {"coordinate_frame": 1, "x": 8.0, "y": 0.0, "z": 5.0},
    "NAV_CONTROLLER_OUTPUT": {
        "wp_dist": round(math.hypot(7.0, 2.0)), "target_bearing": round(math.degrees(math.atan2(-2, 7)))},
    "EXTENDED_SYS_STATE": {"landed_state": mavlink.MAV_LANDED_STATE_IN_AIR},
}  # fmt: skip


@pytest.mark.parametrize("name", FIELDS)
def test_messages_match_the_snapshot(station, name):
    (sent,) = station.request(getattr(mavlink, f"MAVLINK_MSG_ID_{name}"))
    for field, expected in FIELDS[name].items():
        value = getattr(sent, field)
        value = value[0] if isinstance(value, list) and not isinstance(expected, list) else value
        assert value == pytest.approx(expected, rel=1e-6, nan_ok=True), field


def servos(of, profile="ardusub", **row):
    station = Station(profile, of=of)
    station.look(1.0, **row)
    (sent,) = station.request(36)
    return [getattr(sent, f"servo{i}_raw") for i in range(1, 10)]


def test_servo_pulses_follow_the_vehicle_table():
    """A real ArduSub that drives a BlueROV2 Heavy forward gives 1300, 1300, 1700, 1700 (measured)."""
    forward = {"thrust[1]": (10.0, 10.0, -10.0, -10.0)}
    heavy = scenario("vehicle='bluerov2_heavy'", "actuation.through='thrusters'")
    assert servos(heavy, **forward) == [1300, 1300, 1700, 1700, 1500, 1500, 1500, 1500, 0]
    assert servos(heavy, "px4", **forward) == [1600, 1600, 1400, 1400, 1500, 1500, 1500, 1500, 0]  # linear, unsigned
    # without a table linear in order
    assert servos(scenario(), **{"thrust[1]": (13.5, -27.0, 0.0, 54.0)})[:4] == [1700, 1100, 1500, 1900]


def test_estimator_flags_tell_whether_the_position_is_known(station):
    for position, known in (((1.0, 2.0, -5.0), 8 | 16 | 32), ((1.0, math.nan, -5.0), 0)):
        station.look(1.0, **{"position.x": position})
        for number in (193, 230):
            (status,) = station.request(number)
            assert status.flags == 1 | 2 | 4 | known


def test_times_wrap(station):
    station.look(5000.0)
    assert station.request(36)[0].time_usec == 5_000_000_000 % 2**32
    station.look(5e6)
    assert station.request(30)[0].time_boot_ms == 5_000_000_000 % 2**32


def test_sensors_checked_by_mavsdk_are_healthy(station):
    (status,) = station.request(1)
    bits = 1 | 2 | 4 | 32 | mavlink.MAV_SYS_STATUS_PREARM_CHECK
    for field in ("present", "enabled", "health"):
        assert getattr(status, f"onboard_control_sensors_{field}") & bits == bits
    assert status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_GEOFENCE


def test_weights_and_estimates_are_sent_as_named_values(station):
    values = {m.name: m.value for m in station.request(251)}
    assert all(len(name) <= 10 for name in values)
    expected = {"w_obstacle": 0.7, "phi4": 4.0, "goal_clear": -3.0, "qp_slack": 0.25, "clearance": 2.0, "thrust": 1.0}
    assert {name: values[name] for name in expected} == pytest.approx(expected)


def test_debug_arrays_hold_weights_clearances_and_thrusts(station):
    arrays = {m.array_id: m for m in station.request(350)}
    names = {1: "weights", 2: "values", 3: "clearances", 4: "thrusts", 5: "law"}
    assert {i: m.name for i, m in arrays.items()} == names
    assert arrays[1].data[3:6] == pytest.approx([0.7, 0.2, 0.1])
    assert arrays[3].data[:4] == [-3.0, 2.0, 2.0, 2.0] and arrays[4].data[:2] == [13.5, -27.0]


def test_rangefinder_is_reported_only_above_a_bottom(station):
    assert [station.request(number) for number in (132, 173, 11038)] == [[]] * 3
    station.look(13.0, **{"altitude": 2.5, "measured.altitude": 2.5})
    sensor, finder, depth = (station.request(number)[0] for number in (132, 173, 11038))
    assert (sensor.current_distance, sensor.orientation, finder.distance, depth.distance) == (250, 25, 2.5, 2.5)


def test_armed_vehicle_is_in_air_even_on_the_bottom(station):
    for values, landed in (({"bottom_contact": 1.0}, "IN_AIR"), ({"commands.armed": 0.0}, "ON_GROUND")):
        station.play(values)
        assert station.request(245)[0].landed_state == getattr(mavlink, f"MAV_LANDED_STATE_{landed}")


@pytest.mark.parametrize(
    ("profile", "flight", "custom"),
    [
        ("ardusub", 4 << 24 | 5 << 16, b"subreach"),
        ("px4", 1 << 24 | 15 << 16, bytes([*reversed(OWN), 0, 0, 0, 0, 0])),
        ("generic", OWN[0] << 24 | OWN[1] << 16 | OWN[2] << 8 | 255, b"subreach"),
    ],
)
def test_version_matches_the_emulated_autopilot(profile, flight, custom):
    (version,) = Station(profile).request(148)
    assert version.flight_sw_version == flight  # ends in 255 if official, which QGroundControl compares with the newest
    assert version.middleware_sw_version == OWN[0] << 24 | OWN[1] << 16 | OWN[2] << 8 | 255
    assert bytes(version.flight_custom_version) == custom


def test_initial_position_is_reported_before_the_first_step():
    (local,) = Station(of=scenario("initial.position=[1.0, 2.0, 3.0]")).request(32)
    assert (local.x, local.y, local.z) == (1.0, 2.0, 3.0)


def test_global_origin_and_home_can_be_set():
    station, place = Station(), (470_000_000, 80_000_000, 12_000)
    station.look()
    (origin, _) = station.send(mavlink.MAVLink_set_gps_global_origin_message(1, *place))
    assert origin.get_type() == "GPS_GLOBAL_ORIGIN"
    assert (origin.latitude, origin.longitude, origin.altitude) == place
    (globe,) = station.request(33)
    assert globe.lat == pytest.approx(470_000_000, abs=200) and (globe.alt, globe.relative_alt) == (7000, -5000)
    station.play((long(179, 1.0), ACCEPTED))  # here
    (home,) = station.request(242)
    assert (home.latitude, home.longitude, home.altitude, home.z) == (globe.lat, globe.lon, 12_000, 0.0)
    station.play((long(179, 0.0), DENIED))  # nowhere
    station.send(mavlink.MAVLink_set_gps_global_origin_message(1, 2**31 - 1, 0, 0))
    assert station.request(49)[0].latitude == 470_000_000


def ecef(latitude, longitude, altitude):
    """WGS84 in earth-centered coordinates, from the ellipsoid's axes."""
    a, b = 6378137.0, 6356752.314245
    lat, lon = math.radians(latitude), math.radians(longitude)
    n = a * a / math.hypot(a * math.cos(lat), b * math.sin(lat))
    return np.array([
        (n + altitude) * math.cos(lat) * math.cos(lon), (n + altitude) * math.cos(lat) * math.sin(lon),
        (n * b * b / (a * a) + altitude) * math.sin(lat),
    ])  # fmt: skip


@pytest.mark.parametrize("latitude", [-80.0, -33.0, 0.0, 55.9097, 70.0])
@pytest.mark.parametrize("offset", [(100.0, 0.0, 0.0), (0.0, 100.0, 5.0), (-70.0, 70.0, 30.0)])
def test_local_frame_matches_the_ellipsoid(latitude, offset):
    frame = LocalFrame(latitude, 179.9999)
    here, there = ecef(latitude, 179.9999, 0.0), ecef(*frame.to_global(offset))
    lat, lon = math.radians(latitude), math.radians(179.9999)
    axes = np.array([
        [-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat)],
        [-math.sin(lon), math.cos(lon), 0.0],
        [-math.cos(lat) * math.cos(lon), -math.cos(lat) * math.sin(lon), -math.sin(lat)],
    ])  # fmt: skip
    # the plane leaves the ellipsoid by s^2 / 2 R, 0.8 mm at 100 m; meridians draw together a little more near the poles
    assert axes @ (there - here) == pytest.approx(offset, abs=0.01)
    assert frame.to_local(*frame.to_global(offset)) == pytest.approx(offset, abs=1e-6)


def test_the_local_frame_stays_finite_at_the_pole():
    assert all(map(math.isfinite, LocalFrame(90.0, 0.0).to_global((1.0, 1.0, 1.0))))


# ---- fields ----


def test_out_of_range_values_are_clamped_to_the_field():
    make, coder = Encoder(mavlink), mavlink.MAVLink(None)
    sent = make("GLOBAL_POSITION_INT", -1, math.inf, -math.inf, 1e300, math.nan, 1e9, -1e9, 0.6, math.nan)
    assert sent.pack(coder)
    assert (sent.time_boot_ms, sent.lat, sent.lon, sent.alt) == (0, 2**31 - 1, -(2**31), 2**31 - 1)
    assert (sent.relative_alt, sent.vx, sent.vy, sent.vz, sent.hdg) == (0, 32767, -32768, 1, 65535)
    for name, *values in (
        ("ATTITUDE", 0, math.inf, 1e300, math.nan, 0, 0, 0), ("BATTERY_STATUS", 0, 0, 0, 0, [1] * 20, 0, 0, 0, 0),
        ("STATUSTEXT", 6, "größer" * 20, 0, 0), ("ACTUATOR_OUTPUT_STATUS", 0, 0, [1.0]),
    ):  # fmt: skip
        assert make(name, *values).pack(coder)


def test_euler_angles_are_those_of_the_plant():
    for angles in ((0.1, 0.2, 0.3), (-2.0, -1.5, 3.0), (0.0, 0.0, -3.1)):
        roll, pitch, yaw = (from_axis_angle(axis, angle) for axis, angle in zip(np.eye(3), angles, strict=True))
        assert quaternion_to_euler(multiply(yaw, multiply(pitch, roll)).tolist()) == pytest.approx(angles, abs=1e-9)


def test_weight_names_of_custom_criteria_are_unique():
    assert weight_names(("obstacle", "shape", "depth")) == ["w_obstacle", "w_shape", "w_depth"]
    assert weight_names(("visibility", "visibilitx", "v")) == ["w_visibili", "w_visibil2", "w_v"]


def test_the_weights_and_memberships_of_four_criteria_are_sent():
    four = scenario(name="inspection-visibility")
    names = column_names(four)
    row, values = np.zeros(len(names)), {"weight": [0.5, 0.25, 0.125, 0.75], "membership": [1.0, 0.0, 0.5, 0.25]}
    for of, numbers in values.items():
        first = names.index(f"{of}.obstacle")
        row[first : first + 4] = numbers
    view = View(RowLayout(four, [Column(name, "", "") for name in names]), row)
    assert {"weight": view.weights, "membership": view.memberships} == values
    assert dict(zip(weight_names(view.criteria), view.weights, strict=True))["w_visibili"] == 0.75
