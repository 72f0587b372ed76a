"""Setpoints, manual control and obstacles."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from controller.quaternion import from_axis_angle
from controller.regions.region_set import shape_center
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.speed import terminal_speed
from cosim.simulation.commands.commands import (
    AddObstacle,
    ChangeSetting,
    ManualControl,
    RemoveObstacle,
    SetDepth,
    SetHeading,
    SetMode,
    SetTarget,
)
from plant_fmu import load_vehicle
from tests.cosim.mavlink.station import ACCEPTED, DENIED, NAN, UNSUPPORTED, Station, close_to, long, scenario
from tests.cosim.mavlink.stubs import message

POSITION, WITH_VELOCITY, VELOCITY = 0b110111111000, 0b110111000000, 0b110111000111
EAST = {"attitude.yaw": math.pi / 2, "quaternion.e0": (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))}
NOSE_UP = {"quaternion.e0": tuple(from_axis_angle(np.array([0.0, 1.0, 0.0]), math.pi / 2))}
MANUAL, HOLD, REACH = ({"commands.mode": mode} for mode in (0.0, 1.0, 2.0))
REPOSITION, YAW, SPEED = 192, 115, 178
GLOBE = LocalFrame(55.9097, -3.3203)
NEUTRAL = ManualControl((0.0,) * 6)


def local(frame=1, mask=POSITION, place=(3.0, 4.0, 5.0), speed=(0.0, 0.0, 0.0), yaw=0.0):
    return mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *place, *speed, 0, 0, 0, yaw, 0)


def velocity(speed, frame=1, mask=VELOCITY, **more):
    return local(frame, mask, (0.0, 0.0, 0.0), speed, **more)


def ignored(mask):
    """Return a set-point with an acceleration and a yaw rate."""
    sent = velocity((0.1, 0, 0), mask=mask)
    sent.afx, sent.yaw_rate = 0.1, 0.2
    return sent


def where(position):
    latitude, longitude, altitude = GLOBE.to_global(position)
    return round(latitude * 1e7), round(longitude * 1e7), altitude


FAR = (30.0, -20.0, 4.0)
X, Y, Z = where(FAR)


def globe(frame, mask=POSITION):
    return mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, mask, X, Y, Z, *[0] * 8)


def obstacle(number=1, frame=1, place=(4.0, 5.0, 6.0)):
    return mavlink.MAVLink_obstacle_distance_3d_message(0, 0, frame, number, *place, 0.1, 20.0)


def sticks(x=0, y=0, z=500, r=0, s=0, t=0, extensions=0):
    return message("MANUAL_CONTROL", target=1, x=x, y=y, z=z, r=r, s=s, t=t, enabled_extensions=extensions)


def override(*pulses):
    return mavlink.MAVLink_rc_channels_override_message(1, 1, *pulses, *[0xFFFF] * (8 - len(pulses)))


def command_int(number, frame, numbers, x, y, z):
    return mavlink.MAVLink_command_int_message(1, 1, frame, number, 0, 0, *numbers, x, y, z)


def altitude_change(deeper):
    """APMFirmwarePlugin::guidedModeChangeAltitude."""
    return local(frame=7, mask=0xFFF8, place=(0.0, 0.0, deeper))


PULSES = override(1500, 1500, 1700, 1500, 1900, 1300)  # pitch roll up yaw forward right
HERE = (1.0, 2.0, 5.0), 0.3  # of the snapshot, with the target at (8, 0, 5)
THERE = SetTarget((3.0, 4.0, 5.0))
AHEAD = ManualControl((0.5, 0, 0, 0, 0, 0), by_gain=False)  # of a full stick, by the default gain

SCRIPTS = {
    "a repeated set-point once": [*[local()] * 20, local(place=(3.5, 4.0, 5.0)), [THERE, SetTarget((3.5, 4.0, 5.0))]],
    **{f"frame {frame}": [EAST, local(frame), [SetTarget(position)]] for frame, position in
       ((1, (3, 4, 5)), (7, (4, 6, 10)), (8, (-3, 5, 10)), (9, (-3, 5, 10)), (12, (-3, 5, 10)))},
    **{f"unsupported global frame {frame}": [globe(frame), []] for frame in (1, 11)},
    "velocity and yaw": [
        local(mask=WITH_VELOCITY, speed=(0.1, 0.2, 0.0)), local(mask=POSITION & ~1024, yaw=1.0, place=(1, 1, 1)),
        [SetTarget((3.0, 4.0, 5.0), None, (0.1, 0.2, 0.0)), SetTarget((1.0, 1.0, 1.0)), SetHeading(1.0)]],
    "depth alone keeps the horizontal target": [local(mask=POSITION | 0b011, place=(NAN, NAN, 2.0)),
                                                [SetTarget((8.0, 0.0, 2.0))]],
    "a velocity in the body's frame": [EAST, velocity((0.2, 0.0, 0.0), frame=8), [SetTarget(*HERE, (0.0, 0.2, 0.0))]],
    # MAVSDK's set_velocity_ned, sent again at 20 Hz, and then no more
    "a velocity moves the target from the present position, until it is stale": [
        *[velocity((0.2, 0.0, -0.1)), 0.06] * 20, velocity((0.0, 0.3, 0.0)),
        [SetTarget(*HERE, (0.2, 0.0, -0.1)), SetTarget(*HERE, (0.0, 0.3, 0.0))], 2.9, [], 0.2, [SetTarget(*HERE)],
        "No velocity for 3 s: the vehicle stays"],
    "a depth as ArduSub's ALT_HOLD takes it: an altitude alone, in any frame, at each message": [
        {"commands.mode": 6.0}, local(), globe(0, 0xFFFB), globe(1, 0xFFFB), globe(6), globe(0, 0xFFFF),
        [SetDepth(4.0)] * 3],
    "no mask, which ArduSub drops": [local(mask=0), globe(0, 0), []],
    "another mode": [HOLD, local(), sticks(x=1000), PULSES, []],
    "sticks in reach": [sticks(x=1000), PULSES, []],
    # PX4's pattern: stream set-points, then switch to offboard; ArduPilot's: at once, before a snapshot shows it
    "a set-point before its mode": [
        HOLD, "Mode: Position hold", *[local(), 0.06] * 10, [], None, REACH, [THERE], HOLD, (long(176, 1, 4), ACCEPTED),
        local(), [SetMode("reach"), THERE]],
    "a repeated set-point after another mode": [local(), HOLD, REACH, local(), [THERE] * 2],
    "set-points that wait": [
        HOLD, "Mode: Position hold", *[local(), 0.1] * 29, None, *[local(), 0.1] * 3,
        "Set-points wait: the mode is position hold, they apply in region reaching", []],
    "the speed of the law": [
        (long(SPEED, 0.0, -1.0), ACCEPTED), [], (long(SPEED, 0.0, 0.2), ACCEPTED), (long(SPEED, 0.0, -2.0), ACCEPTED),
        [ChangeSetting("law.gains.speed", speed) for speed in (0.2, scenario().law.gains.speed)]],
    "a position in the local frame, in none, and nowhere": [
        (command_int(REPOSITION, 1, (-1, 1, 0, NAN), 10_000, 20_000, 3.0), ACCEPTED), [SetTarget((1.0, 2.0, 3.0))],
        (command_int(REPOSITION, 11, (-1, 1, 0, NAN), X, Y, Z), UNSUPPORTED),
        (command_int(REPOSITION, 0, (-1, 1, 0, NAN), 0, 0, 0.0), DENIED), []],
    "no position, as QGroundControl pauses PX4": [
        *((long(REPOSITION, -1.0, 1.0, 0.0, *numbers), ACCEPTED) for numbers in ((), (0.5,), (NAN, NAN, NAN, -2.0))),
        [SetMode("hold"), SetMode("hold"), SetHeading(0.5), SetTarget((1.0, 2.0, 2.0))]],
    "headings": [
        EAST, (long(YAW, 30.0, 0.0, 1.0, 0.0), ACCEPTED), (long(YAW, 30.0, 0.0, -1.0, 1.0), ACCEPTED),
        (long(YAW, NAN, 0.0, 1.0, 0.0), DENIED), [SetHeading(math.radians(30)), SetHeading(math.radians(60))]],
    "QGroundControl's change of altitude, made twice": [
        altitude_change(1.5), 0.5, altitude_change(1.5), 2.0, {"position.z": 6.5}, altitude_change(1.5),
        [SetTarget((1.0, 2.0, 6.5)), SetTarget((1.0, 2.0, 8.0))]],
    **{f"an obstacle in frame {frame}, hardly moved": [
        EAST, obstacle(frame=frame), obstacle(frame=frame, place=(4.0, 5.02, 6.0)), [AddObstacle(1, position, 0.5)]]
       for frame, position in ((1, (4, 5, 6)), (12, (1 - 5, 2 + 4, 5 + 6)), (20, (4, 5, 6)))},
    "an obstacle ahead of a vehicle with its nose up": [NOSE_UP, obstacle(frame=12, place=(2.0, 0.0, 0.0)),
                                                        [AddObstacle(1, (1.0, 2.0, 3.0), 0.5)]],
    "an obstacle that moves": [obstacle(), obstacle(place=(4.0, 5.5, 6.0)),
                               [AddObstacle(1, (4.0, 5.0, 6.0), 0.5), AddObstacle(1, (4.0, 5.5, 6.0), 0.5)]],
    "obstacles in unknown frames, and nowhere": [obstacle(frame=8), obstacle(place=(NAN, 0.0, 0.0)), []],
    "obstacles without room, until one is stale": [
        *map(obstacle, (1, 2, 3)), [AddObstacle(number, (4.0, 5.0, 6.0), 0.5) for number in (1, 2)],
        "no room for obstacle 3", 4.0, obstacle(1), 2.0, obstacle(3),
        [RemoveObstacle(2), AddObstacle(3, (4.0, 5.0, 6.0), 0.5)]],
    "sticks that stop": [MANUAL, sticks(x=1000), 2.9, [AHEAD], 0.3, [NEUTRAL], "Lost manual control", 5.0, []],
    "sticks before and after arming": [{**MANUAL, "commands.armed": 0.0}, sticks(x=1000), MANUAL, sticks(x=1000),
                                       [AHEAD] * 2],
}  # fmt: skip


@pytest.mark.parametrize("steps", SCRIPTS.values(), ids=SCRIPTS)
def test_setpoints_obstacles_and_sticks_become_commands(station, steps):
    station.play({}, *steps)
    waiting = [text for text in station.wire.of("STATUSTEXT") if text.text.startswith("Set-points wait")]
    assert all(text.severity == mavlink.MAV_SEVERITY_NOTICE for text in waiting)


GUIDED = mavlink.MAVLink_mission_item_message


def go_to(current=2, frame=3, place=(55.9098, -3.3202, -4.0), command=16):
    """QGroundControl's "go to location" for ArduPilot, a float32 of degrees."""
    return GUIDED(1, 1, 0, frame, command, current, 1, 0, 0, 0, 0, *place)


@pytest.mark.parametrize(
    ("sent", "replies", "commands", "tolerance"),
    [
        *((globe(frame), [], [SetTarget(FAR)], 0.02) for frame in (0, 3, 5, 6)),
        (command_int(REPOSITION, 0, (-1.0, 1.0, 0.0, 0.5), X, Y, Z), ["COMMAND_ACK"],
         [SetTarget(FAR), SetHeading(0.5)], 0.02),
        (long(REPOSITION, -1.0, 1.0, 0.0, NAN, X / 1e7, Y / 1e7, Z), ["COMMAND_ACK"],
         [SetTarget(FAR)], 3.0),  # a float32 of degrees
        (go_to(), ["MISSION_ACK"], [SetTarget((*GLOBE.to_local(55.9098, -3.3202, 0.0)[:2], 4.0))], 0.5),
        (go_to(current=3), ["MISSION_ACK"], [SetTarget((8.0, 0.0, 4.0))], 0.0),  # the target's depth alone
        (go_to(place=(55.9097, -3.3203, NAN)), ["MISSION_ACK"],
         [SetTarget((*GLOBE.to_local(55.9097, -3.3203, 0.0)[:2], 5.0))], 0.5),
    ],
)  # fmt: skip
def test_positions_on_the_globe_are_reached(station, sent, replies, commands, tolerance):
    station.play({})
    answers = station.send(sent)
    assert [answer.get_type() for answer in answers] == replies
    assert {answer.type if replies == ["MISSION_ACK"] else answer.result for answer in answers} <= {ACCEPTED}
    assert close_to(station.commanded(), commands, tolerance)


@pytest.mark.parametrize(
    ("sent", "kind"),
    [
        (go_to(frame=10), "UNSUPPORTED_FRAME"), (go_to(command=17), "UNSUPPORTED"), (go_to(place=(0, 0, 0)), "DENIED"),
        (go_to(place=(math.inf, -3.3, -4.0)), "INVALID"),
    ],
)  # fmt: skip
def test_invalid_goto_locations_are_refused(station, sent, kind):
    assert station.send(sent)[-1].type == getattr(mavlink, f"MAV_MISSION_{kind}")
    assert station.commanded() == []


@pytest.mark.parametrize(("sent", "words"), [
    *((invalid, "") for invalid in (
        local(mask=0b110111111111), local(mask=0b111111111100), local(mask=POSITION | 1), local(frame=4),
        local(frame=20), local(place=(NAN, 0, 0)), local(place=(math.inf, 0, 0)), local(place=(1e6, 0, 0)),
        local(mask=0b111000111000), local(mask=WITH_VELOCITY, speed=(NAN, 0, 0)),
        local(mask=WITH_VELOCITY, speed=(1e4, 0, 0)))),
    (ignored(0b010111000111), "yaw rates are not followed"),
    *((ignored(mask), "accelerations are not followed") for mask in (0b110000111000, 0b110000111111)),
])  # fmt: skip
def test_invalid_setpoint_is_rejected_with_one_text(station, sent, words):
    station.play({}, *[sent] * 5, [], words)
    assert len([t for t in station.wire.texts if t.startswith("Refused")]) == 1


def test_every_rejection_reason_is_eventually_reported(station):
    station.play({}, *(local(frame=20 + k % 3) for k in range(6)))
    assert len(station.wire.texts) == 1
    station.wait(2.1)
    texts = station.wire.texts
    assert [sum(f"frame {frame};" in text for text in texts) for frame in (20, 21, 22)] == [2, 1, 1]
    assert any("(2 times)" in text for text in texts if "frame 21;" in text)


def test_targets_above_water_or_outside_a_region_are_accepted_with_a_warning():
    kept_in = scenario(name="harbour")
    station = Station("ardusub", of=kept_in)
    (region,) = [r.region for r in kept_in.regions if r.region.keep == "in"][:1]
    station.play({}, local(place=(1000.0, 0.0, -1.5)), [SetTarget((1000.0, 0.0, -1.5))])
    texts = station.wire.texts
    assert "Warning: target 1.5 m above the surface" in texts
    assert any(text.startswith("Warning: target ") and text.endswith(f"m outside {region.name}") for text in texts)
    station.wire.clear()
    station.play(3.0, local(place=tuple(map(float, shape_center(region.shape)))))
    assert not any("outside" in text for text in station.wire.texts)


def test_default_and_maximum_speed_are_those_of_law_and_vehicle(station):
    assert terminal_speed(load_vehicle("bluerov2_heavy")) == pytest.approx(0.85, abs=0.01)  # 13.7 v + 141 v² = 113 N
    station.play((long(SPEED, 0.0, 0.2), ACCEPTED), (long(SPEED, 0.0, -2.0), ACCEPTED))
    (value,) = station.send(message("PARAM_REQUEST_READ", 1, param_id=b"LAW_SPEED", param_index=-1))
    assert value.param_value == pytest.approx(scenario().law.gains.speed)
    assert Station(of=scenario(name="paper")).command(SPEED, 1.0, 0.6) == UNSUPPORTED


def test_invalid_speeds_are_rejected_with_text():
    station = Station("ardusub", of=scenario("vehicle='bluerov2_heavy'", name="pipe-inspection"))
    for speed in (-0.5, 99.0, 0.0, NAN, math.inf, 1.2):
        station.play({}, (long(SPEED, 0.0, speed), DENIED), 2.1, "Refused: a speed of", [])


def test_first_commanding_station_keeps_control_until_silent(station):
    nine = local(place=(9.0, 9.0, 9.0))
    station.send(local())
    station.send(nine, system=250)
    assert station.command(REPOSITION, -1, 1, system=250) == DENIED
    station.now += 3.1
    station.send(nine, system=250)
    station.send(local(place=(1.0, 9.0, 9.0)))
    assert station.commanded() == [THERE, SetTarget((9.0, 9.0, 9.0))]


@pytest.mark.parametrize(
    ("profile", "sent", "wrench"),
    [
        ("ardusub", sticks(x=1000, y=-500), (1.0, -0.5, 0, 0, 0, 0)),
        ("ardusub", sticks(z=1000, r=250), (0, 0, -1.0, 0, 0, 0.25)),  # up
        ("px4", sticks(z=0), (0, 0, 1.0, 0, 0, 0)),
        ("generic", sticks(z=-1000), (0, 0, 1.0, 0, 0, 0)),
        ("generic", sticks(z=0, s=500, t=-500, extensions=3), (0, 0, 0, -0.5, 0.5, 0)),
        ("ardusub", sticks(s=500, t=-500), None),
        ("ardusub", sticks(x=0x7FFF, y=-0x8000, z=0x7FFF, r=100), (0, -1.0, 0, 0, 0, 0.1)),
    ],
)
def test_manual_control_is_applied_in_manual_mode(profile, sent, wrench):
    gain = 0.5 if profile == "ardusub" else 1.0  # other profiles leave the gain to the run
    commands = [ManualControl(tuple(gain * part for part in wrench), by_gain=gain == 1.0)] if wrench else []
    Station(profile).play(MANUAL, sent, sent, commands)


@pytest.mark.parametrize("mode", [0.0, 5.0, 6.0])
def test_rc_override_maps_to_axes_in_ardusub_order(station, mode):
    # where the depth is kept, the stick up asks for a rate beyond a fifth of its way, times the pilot gain of 0.5
    up = 0.5 if mode < 6.0 else (0.5 - 0.1) / (1.0 - 0.1)
    station.play(
        {"commands.mode": mode}, PULSES, [ManualControl((1.0, -0.5, -up, 0.0, 0.0, 0.0), by_gain=False)],
        override(0xFFFF, 0xFFFF, 0, 0xFFFF, 0xFFFF, 1500),  # up released, forward as it is
        [ManualControl((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), by_gain=False)], 3.1, [NEUTRAL],
    )  # fmt: skip
