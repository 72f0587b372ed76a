"""Obstacle messages: a horizontal scan and the nearest points."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink
from scipy.spatial.transform import Rotation

from cosim.scenario.region_tables import PARKED_POSITION
from tests.cosim.mavlink.station import Station, scenario, set_parameter

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
    quaternion = Rotation.from_euler("ZYX", angles).as_quat(scalar_first=True)
    return {"quaternion.e0": tuple(quaternion), "attitude.roll": tuple(angles[::-1])}


def seen(offset, radius):
    """Return the row values of a dynamic obstacle at an offset from the vehicle [m, NED]."""
    return {"seen 1.shift.x": tuple(HERE + offset - PARKED_POSITION), "seen 1.clearance": math.hypot(*offset) - radius}


def distances_of(station):
    (message,) = station.request(330)
    return list(message.distances)


def scan(station, time=1.0, **row):
    station.look(time, **row)
    return distances_of(station)


def detected(distances):
    return {i: d for i, d in enumerate(distances) if d != NOTHING}


def test_obstacle_distance_fields_follow_the_specification():
    stood = station()
    stood.look(12.5)
    (message,) = stood.request(330)
    assert (message.time_usec, message.increment, message.increment_f, message.angle_offset) == (12_500_000, 5, 5.0, 0)
    assert (message.min_distance, message.max_distance, len(message.distances)) == (0, 2000, 72)
    kind = mavlink.MAV_FRAME_BODY_FRD, mavlink.MAV_DISTANCE_SENSOR_UNKNOWN
    assert (message.frame, message.sensor_type) == kind


# where the sphere is, its radius, and the attitude; sector and distance of the nearest point [cm], None for neither
PLACES = [
    *(((0.0, 6.0, 0.0), 1.0, {"yaw": yaw}, sector, 500) for yaw, sector in
      ((90, AHEAD), (0, RIGHT), (-90, BEHIND), (180, LEFT), (75, 3), (-135, 45))),
    ((6.0, 6.0, 0.0), 1.0, {}, 9, 749),  # clockwise
    ((0.0, 6.0, 1.05), 1.0, {}, None, None),  # below the plane of the scan
    ((0.0, 6.0, -0.8), 1.0, {}, RIGHT, 540), ((0.0, 20.5, 0.0), 1.0, {}, RIGHT, 1950),
    ((0.0, 21.5, 0.0), 1.0, {}, None, None),
]  # fmt: skip


@pytest.mark.parametrize(("offset", "radius", "turned", "sector", "distance"), PLACES)
def test_obstacle_is_in_the_sector_of_its_bearing_in_a_level_scan(offset, radius, turned, sector, distance):
    stood = station(offset, radius)
    distances = scan(stood, **attitude(**turned))
    if sector is None:
        assert detected(distances) == {}
        return
    assert distances[sector] == min(distances) == pytest.approx(distance, abs=1)
    assert abs(distances[sector - 1] - distances[(sector + 1) % 72]) <= 1  # it lies evenly about the sector's middle
    assert scan(stood, **attitude(roll=30.0, pitch=-50.0, **turned)) == distances


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
    stood.send(set_parameter("SR1_RADIUS", 2.5))
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
    distances = distances_of(stood)
    assert distances[RIGHT] == 500 and distances[LEFT] == NOTHING


def test_the_nearest_points_are_those_of_the_scan():
    stood = station()
    stood.look(1.0, **attitude(yaw=90.0), **seen((-4.0, 0.0, 0.0), 0.5), **{"SR1.clearance": 5.0})
    points = {m.obstacle_id: (m.x, m.y, m.z) for m in stood.request(11037)}
    assert list(points) == [4, 1]
    assert points[4] == pytest.approx((0.0, 3.5, 0.0), abs=1e-6) and points[1] == pytest.approx((5, 0, 0), abs=1e-6)
    distances = distances_of(stood)
    assert distances[AHEAD] == 500 and distances[RIGHT] == 350
