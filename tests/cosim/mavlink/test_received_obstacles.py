"""Obstacle messages: a horizontal scan and the nearest points."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink
from scipy.spatial.transform import Rotation

from cosim.scenario.region_tables import PARKED_POSITION
from tests.cosim.mavlink.station import Station, scenario

NOTHING, UNKNOWN = 2001, 0xFFFF
AHEAD, RIGHT, BEHIND, LEFT = 0, 18, 36, 54
HERE = np.array([1.0, 2.0, 5.0])  # of the station's vehicle [m, NED]
SPHERE = "regions.{}.shape={{type='sphere', center=[{}, {}, {}], radius={}}}"
FAR_AWAY = "regions.SR1.shape.center=[90.0, 0.0, 5.0]"


def station(offset=(0.0, 6.0, 0.0), radius=1.0):
    """Return a station whose only obstacle is a sphere, by default 6 m east of the vehicle."""
    return Station(of=scenario(SPHERE.format("SR1", *(HERE + offset), radius)))


def attitude(roll=0.0, pitch=0.0, yaw=0.0):
    """Return the attitude of a row [degrees], by SciPy."""
    angles = np.radians([yaw, pitch, roll])
    x, y, z, w = Rotation.from_euler("ZYX", angles).as_quat()
    return {"quaternion.e0": (w, x, y, z), "attitude.roll": tuple(angles[::-1])}


def seen(offset, radius):
    """Return the row values of a dynamic obstacle at an offset from the vehicle [m, NED]."""
    return {"seen 1.shift.x": tuple(HERE + offset - PARKED_POSITION), "seen 1.clearance": math.hypot(*offset) - radius}


def request(station, number=330):
    station.wire.clear()
    assert station.command(512, number) == mavlink.MAV_RESULT_ACCEPTED
    return station.wire.of(mavlink.mavlink_map[number].msgname)


def scan(station, time=1.0, **row):
    station.look(time, **row)
    (message,) = request(station)
    return list(message.distances)


def detected(distances):
    return {i: d for i, d in enumerate(distances) if d != NOTHING}


def test_obstacle_distance_fields_follow_the_specification():
    stood = station()
    stood.look(12.5)
    (message,) = request(stood)
    assert (message.time_usec, message.increment, message.increment_f, message.angle_offset) == (12_500_000, 5, 5.0, 0)
    assert (message.min_distance, message.max_distance, len(message.distances)) == (0, 2000, 72)
    assert (message.frame, message.sensor_type) == (
        mavlink.MAV_FRAME_BODY_FRD,
        mavlink.MAV_DISTANCE_SENSOR_UNKNOWN,
    )


@pytest.mark.parametrize(("yaw", "sector"), [(90, AHEAD), (0, RIGHT), (-90, BEHIND), (180, LEFT), (75, 3), (-135, 45)])
def test_obstacle_is_in_the_sector_of_its_bearing(yaw, sector):
    distances = scan(station(), **attitude(yaw=yaw))
    assert distances[sector] == min(distances) == 500
    assert abs(distances[sector - 1] - distances[(sector + 1) % 72]) <= 1  # it lies evenly about the sector's middle


# offset and radius of the sphere; sector and distance of the nearest point [cm], or no detection
SPHERES = [
    ((6.0, 6.0, 0.0), 1.0, 9, 749),  # clockwise
    ((0.0, 6.0, 1.05), 1.0, None, None),  # below the plane of the scan
    ((0.0, 6.0, -0.8), 1.0, RIGHT, 540),
    ((0.0, 21.5, 0.0), 1.0, None, None),
    ((0.0, 20.5, 0.0), 1.0, RIGHT, 1950),
]


@pytest.mark.parametrize(("offset", "radius", "sector", "distance"), SPHERES)
def test_scan_is_level_clockwise_and_of_limited_range(offset, radius, sector, distance):
    distances = detected(scan(station(offset, radius)))
    if sector is None:
        assert distances == {}
    else:
        assert distances[sector] == min(distances.values()) == pytest.approx(distance, abs=1)


def test_each_sector_holds_its_nearest_obstacle():
    for i, distance in enumerate(scan(station((6.0, 0.0, 0.0), radius=2.0))):
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
    assert detected(scan(station((19.6 * math.cos(bearing), 19.6 * math.sin(bearing), 0.0), radius=0.3)))


def test_scan_plane_stays_horizontal():
    level = scan(station(), **attitude(yaw=40.0))
    assert scan(station(), **attitude(roll=30.0, pitch=-50.0, yaw=40.0)) == level


@pytest.mark.parametrize(
    ("east", "row", "distance"),
    [(0.3, {}, 0), (6.0, {"position.x": (math.nan, 2.0, 5.0)}, UNKNOWN), (6.0, {"attitude.yaw": math.nan}, UNKNOWN)],
)
def test_inside_an_obstacle_distances_are_0_and_of_unknown_pose_unknown(east, row, distance):
    assert scan(station((0.0, east, 0.0)), **row) == [distance] * 72


@pytest.mark.parametrize(
    ("overrides", "nearest"),
    [
        ([FAR_AWAY, SPHERE.format("SR2", 4.0, 2.0, 5.0, 1.0)], NOTHING),  # of the criterion shape
        ([FAR_AWAY, SPHERE.format("SR2", 4.0, 2.0, 5.0, 1.0), "regions.SR2.criterion='obstacle'"], 200),
        (["intersection=[]", "regions.SR1.keep='in'", SPHERE.format("SR1", *HERE, 4.0)], NOTHING),
        (["regions.SR1.shape={type='orientation', quaternion=[1.0, 0.0, 0.0, 0.0], tolerance=0.5}"], NOTHING),
    ],
)
def test_only_keep_out_obstacle_regions_are_scanned(overrides, nearest):
    assert min(scan(Station(of=scenario(*overrides)))) == nearest


def test_obstacles_are_where_and_as_large_as_they_are_now():
    stood = station()
    shifts = (((0.0, 0.0, 0.0), RIGHT, 500), ((0.0, 3.0, 0.0), RIGHT, 800), ((0.0, -12.0, 0.0), LEFT, 500))
    for time, (shift, sector, distance) in enumerate(shifts, 1):
        assert scan(stood, float(time), **{"SR1.shift.x": shift})[sector] == distance
    stood.send(mavlink.MAVLink_param_set_message(1, 1, b"SR1_RADIUS", 2.5, mavlink.MAV_PARAM_TYPE_REAL32))
    assert scan(stood, 5.0)[RIGHT] == 350
    stood.look(0.0)  # the run restarts, with the scenario's numbers
    assert scan(stood)[RIGHT] == 500


def test_dynamic_obstacle_width_follows_its_clearance():
    stood = station((90.0, 0.0, 0.0))
    for radius in (None, 0.5, 1.5, None):
        distances = scan(stood, **({} if radius is None else seen((0.0, 6.0, 0.0), radius)))
        if radius is None:
            assert detected(distances) == {}
            continue
        assert distances[RIGHT] == pytest.approx(600 - 100 * radius, abs=1)
        assert all(abs(5 * i - 90) <= math.degrees(math.asin(radius / 6.0)) + 2.5 for i in detected(distances))


def test_before_the_first_snapshot_only_scenario_obstacles_are_reported():
    stood = Station(of=scenario(SPHERE.format("SR1", 0.0, 6.0, 1.0, 1.0)))  # the scenario begins at depth 1
    stood.wait(3.0)  # streams go by the wall clock
    assert stood.wire.of("OBSTACLE_DISTANCE_3D") == []
    (message,) = request(stood)
    assert message.distances[RIGHT] == 500 and message.distances[LEFT] == NOTHING


def test_the_nearest_points_are_those_of_the_scan():
    stood = station()
    stood.look(1.0, **attitude(yaw=90.0), **seen((-4.0, 0.0, 0.0), 0.5), **{"SR1.clearance": 5.0})
    points = {m.obstacle_id: (m.x, m.y, m.z) for m in request(stood, 11037)}
    assert list(points) == [4, 1]
    assert points[4] == pytest.approx((0.0, 3.5, 0.0), abs=1e-6) and points[1] == pytest.approx((5, 0, 0), abs=1e-6)
    (message,) = request(stood)
    assert message.distances[AHEAD] == 500 and message.distances[RIGHT] == 350
