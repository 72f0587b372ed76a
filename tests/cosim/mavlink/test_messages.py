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
from tests.cosim.mavlink.station import Station, scenario

TURN = from_axis_angle(np.array([0.0, 0.0, 1.0]), 2.0)
EULER = (0.0, 0.0, 2.0)
OWN = Version(metadata.version("subreach")).release


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


def request(station, message_id):
    station.wire.clear()
    station.command(512, message_id)
    return [m for m in station.wire.got if m.get_type() != "COMMAND_ACK"]


def test_pose_messages_match_the_snapshot(station):
    (attitude,) = request(station, 30)
    assert (attitude.time_boot_ms, attitude.yaw, attitude.yawspeed) == (12_500, 2.0, pytest.approx(0.03))
    (quaternion,) = request(station, 31)
    assert (quaternion.q1, quaternion.q4) == (pytest.approx(math.cos(1.0)), pytest.approx(math.sin(1.0)))
    (local,) = request(station, 32)
    north, east, down = rotation_matrix(TURN) @ np.array([0.5, -0.2, 0.1])
    assert (local.x, local.y, local.z) == (1.0, 2.0, 5.0)
    assert (local.vx, local.vy, local.vz) == pytest.approx((north, east, down), rel=1e-6)
    (globe,) = request(station, 33)
    assert (globe.relative_alt, globe.alt, globe.hdg) == (-5000, -5000, round(math.degrees(2.0) * 100))
    assert (globe.vx, globe.vy, globe.vz) == (round(north * 100), round(east * 100), round(down * 100))
    (hud,) = request(station, 74)
    assert (hud.alt, hud.climb, hud.heading, hud.throttle) == (-5.0, pytest.approx(-down), 115, 100)
    (odometry,) = request(station, 331)
    assert (odometry.frame_id, odometry.child_frame_id, odometry.estimator_type) == (1, 12, 8)
    assert math.isnan(odometry.pose_covariance[0]) and odometry.vx == 0.5


def test_depth_is_reported_as_pressure(station):
    (outside,), (inside,) = request(station, 137), request(station, 29)
    assert outside.press_abs == pytest.approx(1013.25 + 1000.0 * 9.80665 * 5.0 / 100.0)
    assert inside.press_abs == pytest.approx(1013.25)


def test_actuator_outputs_are_normalized_forces(station):
    (actuators,) = request(station, 375)
    assert actuators.actuator[:4] == [0.5, -1.0, 0.0, 1.0] and actuators.active == 0xFF


def servos(of, profile="ardusub", **row):
    station = Station(profile, of=of)
    station.look(1.0, **row)
    (message,) = request(station, 36)
    return [getattr(message, f"servo{i}_raw") for i in range(1, 10)]


def test_servo_pulses_follow_the_vehicle_table():
    """A real ArduSub that drives a BlueROV2 Heavy forward gives 1300, 1300, 1700, 1700 (measured)."""
    forward = {"thrust[1]": (10.0, 10.0, -10.0, -10.0)}
    heavy = scenario("vehicle='bluerov2_heavy'", "actuation.through='thrusters'")
    assert servos(heavy, **forward) == [1300, 1300, 1700, 1700, 1500, 1500, 1500, 1500, 0]
    assert servos(heavy, "px4", **forward) == [1600, 1600, 1400, 1400, 1500, 1500, 1500, 1500, 0]  # linear, unsigned


def test_vehicle_without_a_table_has_linear_pulses_in_order():
    forces = (13.5, -27.0, 0.0, 54.0)
    assert servos(scenario(), **{"thrust[1]": forces})[:4] == [1700, 1100, 1500, 1900]


def test_time_of_servos_wraps():
    station = Station()
    station.look(5000.0)
    (servo,) = request(station, 36)
    assert servo.time_usec == 5_000_000_000 % 2**32
    station.look(5e6)
    (attitude,) = request(station, 30)
    assert attitude.time_boot_ms == 5_000_000_000 % 2**32


def test_sensors_checked_by_mavsdk_are_healthy(station):
    (status,) = request(station, 1)
    for bit in (1, 2, 4, 32, mavlink.MAV_SYS_STATUS_PREARM_CHECK):
        assert status.onboard_control_sensors_present & status.onboard_control_sensors_enabled & bit
        assert status.onboard_control_sensors_health & bit
    assert status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_GEOFENCE


def test_target_messages_match_the_goal(station):
    (target,) = request(station, 85)
    assert (target.coordinate_frame, target.x, target.y, target.z) == (1, 8.0, 0.0, 5.0)
    (nav,) = request(station, 62)
    assert nav.wp_dist == round(math.hypot(7.0, 2.0)) and nav.target_bearing == round(math.degrees(math.atan2(-2, 7)))


def test_weights_and_estimates_are_sent_as_named_values(station):
    values = {m.name: m.value for m in request(station, 251)}
    assert values["w_obstacle"] == pytest.approx(0.7) and values["phi4"] == 4.0 and values["goal_clear"] == -3.0
    assert values["qp_slack"] == 0.25 and values["clearance"] == 2.0 and values["thrust"] == 1.0
    assert all(len(name) <= 10 for name in values)


def test_debug_arrays_hold_weights_clearances_and_thrusts(station):
    arrays = {m.array_id: m for m in request(station, 350)}
    assert {i: m.name for i, m in arrays.items()} == {
        1: "weights",
        2: "values",
        3: "clearances",
        4: "thrusts",
        5: "law",
    }
    assert arrays[1].data[3:6] == pytest.approx([0.7, 0.2, 0.1])
    assert arrays[3].data[:4] == [-3.0, 2.0, 2.0, 2.0] and arrays[4].data[:2] == [13.5, -27.0]


def test_obstacle_distances_are_relative_to_the_vehicle():
    station = Station()
    # SR1 of the scenario: a sphere of 0.5 m about (2, 0, 1.8); a seen one about (5, 2, 5) of 1 m
    there = np.array([5.0, 2.0, 5.0]) - [0.0, 0.0, -1e5]
    distance = math.dist((1.0, 2.0, 5.0), (2.0, 0.0, 1.8)) - 0.5
    station.look(1.0, **{
        "quaternion.e0": tuple(TURN), "attitude.roll": EULER, "seen 1.shift.x": tuple(there),
        "goal.clearance": (-3.0, distance, 2.0, 2.0, 3.0, 1e5),
    })  # fmt: skip
    found = {m.obstacle_id: (m.x, m.y, m.z) for m in request(station, 11037)}
    assert set(found) == {1, 4}
    here, back = np.array([1.0, 2.0, 5.0]), rotation_matrix(TURN).T
    towards = np.array([2.0, 0.0, 1.8]) - here
    assert found[1] == pytest.approx(back @ (towards * distance / np.linalg.norm(towards)), abs=1e-5)
    assert found[4] == pytest.approx(back @ np.array([3.0, 0.0, 0.0]), abs=1e-5)


def test_rangefinder_is_reported_only_above_a_bottom(station):
    for message_id in (132, 173, 11038):
        assert request(station, message_id) == []
    station.look(13.0, **{"altitude": 2.5, "measured.altitude": 2.5})
    assert request(station, 132)[0].current_distance == 250 and request(station, 132)[0].orientation == 25
    assert request(station, 173)[0].distance == 2.5 and request(station, 11038)[0].distance == 2.5


def test_armed_vehicle_is_in_air_even_on_the_bottom(station):
    assert request(station, 245)[0].landed_state == mavlink.MAV_LANDED_STATE_IN_AIR
    station.look(13.0, bottom_contact=1.0)
    assert request(station, 245)[0].landed_state == mavlink.MAV_LANDED_STATE_IN_AIR
    station.look(14.0, **{"commands.armed": 0.0})
    assert request(station, 245)[0].landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND


@pytest.mark.parametrize(
    ("profile", "flight", "custom"),
    [
        ("ardusub", 4 << 24 | 5 << 16, b"subreach"),
        ("px4", 1 << 24 | 15 << 16, bytes([*reversed(OWN), 0, 0, 0, 0, 0])),
        ("generic", OWN[0] << 24 | OWN[1] << 16 | OWN[2] << 8 | 255, b"subreach"),
    ],
)
def test_version_matches_the_emulated_autopilot(profile, flight, custom):
    (version,) = request(Station(profile), 148)
    assert version.flight_sw_version == flight  # ends in 255 if official, which QGroundControl compares with the newest
    assert version.middleware_sw_version == OWN[0] << 24 | OWN[1] << 16 | OWN[2] << 8 | 255
    assert bytes(version.flight_custom_version) == custom


def test_initial_position_is_reported_before_the_first_step():
    station = Station(of=scenario("initial.position=[1.0, 2.0, 3.0]"))
    (local,) = request(station, 32)
    assert (local.x, local.y, local.z) == (1.0, 2.0, 3.0)


def test_global_origin_and_home_can_be_set():
    station = Station()
    station.look()
    replies = station.send(mavlink.MAVLink_set_gps_global_origin_message(1, 470_000_000, 80_000_000, 12_000))
    assert replies[0].get_type() == "GPS_GLOBAL_ORIGIN"
    assert (replies[0].latitude, replies[0].longitude, replies[0].altitude) == (470_000_000, 80_000_000, 12_000)
    (globe,) = request(station, 33)
    assert globe.lat == pytest.approx(470_000_000, abs=200) and (globe.alt, globe.relative_alt) == (7000, -5000)
    assert station.command(179, 1.0) == mavlink.MAV_RESULT_ACCEPTED  # here
    (home,) = request(station, 242)
    assert (home.latitude, home.longitude, home.altitude, home.z) == (globe.lat, globe.lon, 12_000, 0.0)
    assert station.command(179, 0.0) == mavlink.MAV_RESULT_DENIED  # nowhere
    station.send(mavlink.MAVLink_set_gps_global_origin_message(1, 2**31 - 1, 0, 0))
    assert request(station, 49)[0].latitude == 470_000_000


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
    north, east, down = offset
    here, there = ecef(latitude, 179.9999, 0.0), ecef(*frame.to_global(offset))
    lat, lon = math.radians(latitude), math.radians(179.9999)
    axes = np.array([
        [-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat)],
        [-math.sin(lon), math.cos(lon), 0.0],
        [-math.cos(lat) * math.cos(lon), -math.cos(lat) * math.sin(lon), -math.sin(lat)],
    ])  # fmt: skip
    # the plane leaves the ellipsoid by s^2 / 2 R, 0.8 mm at 100 m; meridians draw together a little more near the poles
    assert axes @ (there - here) == pytest.approx((north, east, down), abs=0.01)
    assert frame.to_local(*frame.to_global(offset)) == pytest.approx(offset, abs=1e-6)


def test_the_local_frame_stays_finite_at_the_pole():
    assert all(map(math.isfinite, LocalFrame(90.0, 0.0).to_global((1.0, 1.0, 1.0))))


# ---- fields ----


def test_out_of_range_values_are_clamped_to_the_field():
    make = Encoder(mavlink)
    coder = mavlink.MAVLink(None)
    message = make("GLOBAL_POSITION_INT", -1, math.inf, -math.inf, 1e300, math.nan, 1e9, -1e9, 0.6, math.nan)
    message.pack(coder)
    assert (message.time_boot_ms, message.lat, message.lon, message.alt) == (0, 2**31 - 1, -(2**31), 2**31 - 1)
    assert (message.relative_alt, message.vx, message.vy, message.vz, message.hdg) == (0, 32767, -32768, 1, 65535)
    make("ATTITUDE", 0, math.inf, 1e300, math.nan, 0, 0, 0).pack(coder)
    make("BATTERY_STATUS", 0, 0, 0, 0, [1] * 20, 0, 0, 0, 0).pack(coder)
    make("STATUSTEXT", 6, "größer" * 20, 0, 0).pack(coder)
    make("ACTUATOR_OUTPUT_STATUS", 0, 0, [1.0]).pack(coder)


def test_euler_angles_are_those_of_the_plant():
    for roll, pitch, yaw in ((0.1, 0.2, 0.3), (-2.0, -1.5, 3.0), (0.0, 0.0, -3.1)):
        parts = [from_axis_angle(np.eye(3)[i], angle) for i, angle in enumerate((roll, pitch, yaw))]
        whole_turn = multiply(parts[2], multiply(parts[1], parts[0]))
        assert quaternion_to_euler(whole_turn.tolist()) == pytest.approx((roll, pitch, yaw), abs=1e-9)


def test_weight_names_of_custom_criteria_are_unique():
    assert weight_names(("obstacle", "shape", "depth")) == ["w_obstacle", "w_shape", "w_depth"]
    assert weight_names(("visibility", "visibilitx", "v")) == ["w_visibili", "w_visibil2", "w_v"]


def test_the_weights_and_memberships_of_four_criteria_are_sent():
    four = scenario(name="inspection-visibility")
    columns = [Column(name, "", "") for name in column_names(four)]
    weights, memberships = (0.5, 0.25, 0.125, 0.75), (1.0, 0.0, 0.5, 0.25)
    row = np.zeros(len(columns))
    for of, values in (("weight", weights), ("membership", memberships)):
        at = [column.name for column in columns].index(f"{of}.obstacle")
        row[at : at + 4] = values
    view = View(RowLayout(four, columns), row)
    assert (view.weights, view.memberships) == (list(weights), list(memberships))
    assert dict(zip(weight_names(view.criteria), view.weights, strict=True))["w_visibili"] == 0.75
