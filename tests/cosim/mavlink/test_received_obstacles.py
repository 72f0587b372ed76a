"""Obstacle messages: a horizontal scan and the nearest points."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink
from scipy.spatial.transform import Rotation

from cosim.mavlink.wire.options import PROFILES
from cosim.scenario.region_tables import PARKED_POSITION
from tests.cosim.mavlink.station import Station, scenario

NOTHING, UNKNOWN = 2001, 0xFFFF
AHEAD, RIGHT, BEHIND, LEFT = 0, 18, 36, 54
HERE = np.array([1.0, 2.0, 5.0])  # of the station's vehicle [m, NED]


def station(center=(1.0, 8.0, 5.0), radius=1.0, **options):
    """Return a station whose only obstacle is a sphere, by default 6 m east of the vehicle."""
    where = f"regions.SR1.shape.center={list(map(float, center))}"
    return Station(of=scenario(where, f"regions.SR1.shape.radius={radius}"), **options)


def at(north, east, down):
    """Return a place so far from the vehicle."""
    return HERE + np.array([north, east, down])


def attitude(roll=0.0, pitch=0.0, yaw=0.0):
    """Return what a row has of it [degrees], by SciPy."""
    angles = np.radians([yaw, pitch, roll])
    x, y, z, w = Rotation.from_euler("ZYX", angles).as_quat()
    return {"quaternion.e0": (w, x, y, z), "attitude.roll": tuple(angles[::-1])}


def seen(offset, radius):
    """Return the row values of a dynamic obstacle at an offset from the vehicle [m, NED]."""
    shift = tuple(HERE + offset - PARKED_POSITION)
    return {"seen 1.shift.x": shift, "seen 1.clearance": math.hypot(*offset) - radius}


def request(station, number=330):
    station.wire.clear()
    assert station.command(512, number) == mavlink.MAV_RESULT_ACCEPTED
    return station.wire.of(mavlink.mavlink_map[number].msgname)


def scan(station, time=1.0, **row):
    station.look(time, **row)
    (message,) = request(station)
    return list(message.distances)


def met(distances):
    return {i: d for i, d in enumerate(distances) if d != NOTHING}


# ---- the message ---------------------------------------------------------------------------------------------------


def test_obstacle_distance_fields_follow_the_specification():
    stood = station()
    stood.look(12.5)
    (message,) = request(stood)
    assert (message.time_usec, message.increment, message.increment_f, message.angle_offset) == (
        12_500_000,
        5,
        5.0,
        0.0,
    )
    assert (message.min_distance, message.max_distance) == (0, 2000)
    assert message.frame == mavlink.MAV_FRAME_BODY_FRD
    assert message.sensor_type == mavlink.MAV_DISTANCE_SENSOR_UNKNOWN
    assert len(message.distances) == 72


@pytest.mark.parametrize("profile", PROFILES)
def test_obstacle_distance_is_streamed_at_1_hz(profile):
    stood = station(profile=profile)
    stood.look(0.0)
    stood.wire.clear()
    for k in range(1, 501):
        stood.look(0.01 * k)
    assert stood.wire.counts()["OBSTACLE_DISTANCE"] == 5


# ---- where things are ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("yaw", "sector"), [(90, AHEAD), (0, RIGHT), (-90, BEHIND), (180, LEFT), (75, 3), (-135, 45)])
def test_obstacle_is_in_the_sector_of_its_bearing(yaw, sector):
    distances = scan(station(), **attitude(yaw=yaw))
    assert distances[sector] == min(distances) == 500
    assert abs(distances[sector - 1] - distances[(sector + 1) % 72]) <= 1  # it lies evenly about the sector's middle


def test_sectors_go_clockwise():
    distances = scan(station(center=at(6.0, 6.0, 0.0)))
    assert distances[9] == pytest.approx(100.0 * (math.sqrt(72.0) - 1.0), abs=1)
    assert set(met(distances)) <= set(range(7, 12))


def test_each_sector_holds_its_nearest_obstacle():
    distances = scan(station(center=at(6.0, 0.0, 0.0), radius=2.0))
    for i, distance in enumerate(distances):
        near, far = (math.radians(max(abs((i + 36) % 72 - 36) * 5.0 + s, 0.0)) for s in (-2.5, 2.5))
        nearest, farthest = (
            6.0 * math.cos(a) - math.sqrt(4.0 - (6.0 * math.sin(a)) ** 2) if a < math.asin(2.0 / 6.0) else math.inf
            for a in (near, far)
        )
        if nearest == math.inf:
            assert distance == NOTHING
        elif farthest < math.inf:
            assert 100.0 * nearest - 1.0 <= distance <= 100.0 * farthest + 1.0


@pytest.mark.medium(fast=13)
@pytest.mark.parametrize("bearing", np.radians(np.arange(0.0, 360.0, 7.3)))
def test_obstacle_of_documented_size_is_always_detected(bearing):
    away = 19.6 * np.array([math.cos(bearing), math.sin(bearing), 0.0])
    assert met(scan(station(center=HERE + away, radius=0.3)))


def test_scan_plane_stays_horizontal():
    level = scan(station(), **attitude(yaw=40.0))
    assert scan(station(), **attitude(roll=30.0, pitch=-50.0, yaw=40.0)) == level


def test_obstacles_above_or_below_are_excluded():
    assert met(scan(station(center=at(0.0, 6.0, 1.05)))) == {}
    assert met(scan(station(center=at(0.0, 6.0, -0.8))))[RIGHT] == 540


def test_empty_sector_holds_maximum_plus_one():
    assert scan(station(center=at(0.0, 21.5, 0.0))) == [NOTHING] * 72
    assert min(scan(station(center=at(0.0, 20.5, 0.0)))) == 1950


def test_inside_an_obstacle_all_distances_are_minimal():
    assert scan(station(center=at(0.0, 0.3, 0.0))) == [0] * 72


def test_only_keep_out_obstacle_regions_are_scanned():
    base = ["regions.SR1.shape.center=[90.0, 0.0, 5.0]"]
    near = "regions.{}.shape={{type='sphere', center=[4.0, 2.0, 5.0], radius=1.0}}"
    other = Station(of=scenario(*base, near.format("SR2")))  # of the criterion shape
    assert met(scan(other)) == {}
    obstacle = Station(of=scenario(*base, near.format("SR2"), "regions.SR2.criterion='obstacle'"))
    assert min(scan(obstacle)) == 200
    within = [
        "intersection=[]",
        "regions.SR1.keep='in'",
        "regions.SR1.shape.center=[1.0, 2.0, 5.0]",
        "regions.SR1.shape.radius=4.0",
    ]
    assert met(scan(Station(of=scenario(*within)))) == {}
    turns = "regions.SR1.shape={type='orientation', quaternion=[1.0, 0.0, 0.0, 0.0], tolerance=0.5}"
    assert met(scan(Station(of=scenario(turns)))) == {}


# ---- what changes --------------------------------------------------------------------------------------------------


def test_a_moving_region_is_where_it_is_now():
    stood = station()
    assert scan(stood)[RIGHT] == 500
    assert scan(stood, 2.0, **{"SR1.shift.x": (0.0, 3.0, 0.0)})[RIGHT] == 800
    assert scan(stood, 3.0, **{"SR1.shift.x": (0.0, -12.0, 0.0)})[LEFT] == 500
    assert scan(stood, 4.0)[RIGHT] == 500


def test_dynamic_obstacle_width_follows_its_clearance():
    stood = station(center=(90.0, 0.0, 0.0))
    assert met(scan(stood)) == {}
    for radius in (0.5, 1.5):
        distances = scan(stood, **seen((0.0, 6.0, 0.0), radius))
        assert distances[RIGHT] == pytest.approx(600 - 100 * radius, abs=1)
        widest = math.degrees(math.asin(radius / 6.0))
        assert all(abs(5 * i - 90) <= widest + 2.5 for i in met(distances))
    assert met(scan(stood)) == {}  # forgotten


def test_before_the_first_snapshot_only_scenario_obstacles_are_reported():
    stood = station(center=(0.0, 6.0, 1.0))  # the scenario begins at depth 1
    stood.wait(3.0)  # streams go by the wall clock
    assert stood.wire.of("OBSTACLE_DISTANCE_3D") == []
    (message,) = request(stood)
    assert message.distances[RIGHT] == 500 and message.distances[LEFT] == NOTHING


def test_a_changed_setting_changes_the_scan():
    stood = station()
    assert scan(stood)[RIGHT] == 500
    send = mavlink.MAVLink_param_set_message
    stood.send(send(1, 1, b"SR1_RADIUS", 2.5, mavlink.MAV_PARAM_TYPE_REAL32))
    assert scan(stood)[RIGHT] == 350
    stood.look(0.0)  # the run begins again, with the scenario's numbers
    assert scan(stood)[RIGHT] == 500


@pytest.mark.parametrize("lost", [{"position.x": (math.nan, 2.0, 5.0)}, {"attitude.yaw": math.nan}])
def test_nan_values_are_reported_as_unknown(lost):
    assert scan(station(), **lost) == [UNKNOWN] * 72


# ---- the nearest points --------------------------------------------------------------------------------------------


def test_the_nearest_points_are_those_of_the_scan():
    stood = station()
    both = {**attitude(yaw=90.0), **seen((-4.0, 0.0, 0.0), 0.5), "SR1.clearance": 5.0}
    stood.look(1.0, **both)
    first, second = request(stood, 11037)
    assert (first.obstacle_id, second.obstacle_id) == (4, 1)
    assert (first.x, first.y, first.z) == pytest.approx((0.0, 3.5, 0.0), abs=1e-6)
    assert (second.x, second.y, second.z) == pytest.approx((5.0, 0.0, 0.0), abs=1e-6)
    (message,) = request(stood)
    assert message.distances[AHEAD] == 500 and message.distances[RIGHT] == 350
