"""Setpoints, manual control and obstacles."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from controller.quaternion import from_axis_angle
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.speed import terminal_speed
from cosim.simulation.commands.commands import (
    AddObstacle,
    ChangeSetting,
    ManualControl,
    RemoveObstacle,
    SetHeading,
    SetMode,
    SetTarget,
)
from cosim.simulation.environment import shape_center
from plant_fmu import load_vehicle
from tests.cosim.mavlink.station import NAN, Station, close_to, scenario

ACCEPTED, _, DENIED, UNSUPPORTED, _ = range(5)
POSITION, WITH_VELOCITY, VELOCITY = 0b110111111000, 0b110111000000, 0b110111000111
EAST = {"attitude.yaw": math.pi / 2, "quaternion.e0": (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))}
NOSE_UP = {"quaternion.e0": tuple(from_axis_angle(np.array([0.0, 1.0, 0.0]), math.pi / 2))}
MANUAL, HOLD = {"commands.mode": 0.0}, {"commands.mode": 1.0}
REPOSITION, YAW, SPEED = 192, 115, 178
GLOBE = LocalFrame(55.9097, -3.3203)


def local(frame=1, mask=POSITION, place=(3.0, 4.0, 5.0), speed=(0.0, 0.0, 0.0), yaw=0.0):
    return mavlink.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, mask, *place, *speed, 0, 0, 0, yaw, 0)


def velocity(speed, frame=1, mask=VELOCITY, **more):
    return local(frame, mask, (0.0, 0.0, 0.0), speed, **more)


def where(position):
    latitude, longitude, altitude = GLOBE.to_global(position)
    return round(latitude * 1e7), round(longitude * 1e7), altitude


def globe(frame):
    place = where((30.0, -20.0, 4.0))
    return mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, POSITION, *place, *[0] * 8)


def obstacle(number=1, frame=1, place=(4.0, 5.0, 6.0)):
    return mavlink.MAVLink_obstacle_distance_3d_message(0, 0, frame, number, *place, 0.1, 20.0)


def sticks(x=0, y=0, z=500, r=0, s=0, t=0, extensions=0):
    return mavlink.MAVLink_manual_control_message(1, x, y, z, r, 0, 0, extensions, s, t)


def override(*pulses):
    return mavlink.MAVLink_rc_channels_override_message(1, 1, *pulses, *[0xFFFF] * (8 - len(pulses)))


PULSES = override(1500, 1500, 1700, 1500, 1900, 1300)  # pitch roll up yaw forward right

# the vehicle's snapshot, at (1, 2, 5) with the target at (8, 0, 5); what is sent; the commands that follow
EXCHANGES = {
    "a repeated set-point once": ({}, [local()] * 20 + [local(place=(3.5, 4.0, 5.0))],
                                  [SetTarget((3.0, 4.0, 5.0)), SetTarget((3.5, 4.0, 5.0))]),
    **{f"frame {frame}": (EAST, [local(frame)], [SetTarget(position)]) for frame, position in
       ((1, (3, 4, 5)), (7, (4, 6, 10)), (8, (-3, 5, 10)), (9, (-3, 5, 10)), (12, (-3, 5, 10)))},
    **{f"global frame {frame}": ({}, [globe(frame)], [SetTarget((30.0, -20.0, 4.0))]) for frame in (0, 3, 5, 6)},
    **{f"unsupported global frame {frame}": ({}, [globe(frame)], []) for frame in (1, 11)},
    "velocity and yaw": (
        {}, [local(mask=WITH_VELOCITY, speed=(0.1, 0.2, 0.0)), local(mask=POSITION & ~1024, yaw=1.0, place=(1, 1, 1))],
        [SetTarget((3.0, 4.0, 5.0), None, (0.1, 0.2, 0.0)), SetTarget((1.0, 1.0, 1.0)), SetHeading(1.0)]),
    "depth alone keeps the horizontal target": ({}, [local(mask=POSITION | 0b011, place=(NAN, NAN, 2.0))],
                                                [SetTarget((8.0, 0.0, 2.0))]),
    "a velocity in the body's frame": (EAST, [velocity((0.2, 0.0, 0.0), frame=8)],
                                       [SetTarget((1.0, 2.0, 5.0), 0.3, (0.0, 0.2, 0.0))]),
    "another mode": (HOLD, [local(), sticks(x=1000), PULSES], []),
    "sticks in reach": ({}, [sticks(x=1000), PULSES], []),
    **{f"an obstacle in frame {frame}, hardly moved": (
        EAST, [obstacle(frame=frame), obstacle(frame=frame, place=(4.0, 5.02, 6.0))], [AddObstacle(1, position, 0.5)])
       for frame, position in ((1, (4, 5, 6)), (12, (1 - 5, 2 + 4, 5 + 6)), (20, (4, 5, 6)))},
    "an obstacle ahead of a vehicle with its nose up": (NOSE_UP, [obstacle(frame=12, place=(2.0, 0.0, 0.0))],
                                                        [AddObstacle(1, (1.0, 2.0, 3.0), 0.5)]),
    "an obstacle that moves": ({}, [obstacle(), obstacle(place=(4.0, 5.5, 6.0))],
                               [AddObstacle(1, (4.0, 5.0, 6.0), 0.5), AddObstacle(1, (4.0, 5.5, 6.0), 0.5)]),
    "obstacles in unknown frames, and nowhere": ({}, [obstacle(frame=8), obstacle(place=(NAN, 0.0, 0.0))], []),
}  # fmt: skip


@pytest.mark.parametrize(("snapshot", "sent", "commands"), EXCHANGES.values(), ids=EXCHANGES)
def test_setpoints_obstacles_and_sticks_become_commands(station, snapshot, sent, commands):
    station.look(2.0, **snapshot)
    for message in sent:
        station.send(message)
    assert close_to(station.commanded(), commands, 0.02 if "global" in str(sent[0]).lower() else 1e-6)


@pytest.mark.parametrize("message", [
    local(mask=0b110111111111), local(mask=0b111111111100), local(mask=POSITION | 1), local(frame=4), local(frame=20),
    local(place=(NAN, 0, 0)), local(place=(math.inf, 0, 0)), local(place=(1e6, 0, 0)), local(mask=0b111000111000),
    local(mask=WITH_VELOCITY, speed=(NAN, 0, 0)), local(mask=WITH_VELOCITY, speed=(1e4, 0, 0)),
])  # fmt: skip
def test_invalid_setpoint_is_rejected_with_one_text(station, message):
    for _ in range(5):
        station.send(message)
    assert station.commanded() == []
    assert len([t for t in station.wire.texts if t.startswith("Refused")]) == 1


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (velocity((0.1, 0, 0), mask=0b010111000111), "yaw rates are not followed"),
        (local(mask=0b110000111000), "accelerations are not followed"),
        (local(mask=0b110000111111), "accelerations are not followed"),
    ],
)
def test_rates_and_accelerations_are_rejected_with_text(station, message, words):
    message.afx, message.yaw_rate = 0.1, 0.2
    station.send(message)
    assert station.commanded() == [] and words in "".join(station.wire.texts)


def test_velocity_setpoint_moves_the_target_from_the_current_position_until_timeout(station):
    """MAVSDK's set_velocity_ned, sent again at 20 Hz, and then no more."""
    for _ in range(20):
        station.send(velocity((0.2, 0.0, -0.1)))
        station.wait(0.05)
    station.send(velocity((0.0, 0.3, 0.0)))
    here = (1.0, 2.0, 5.0), 0.3
    assert close_to(station.commanded(), [SetTarget(*here, (0.2, 0.0, -0.1)), SetTarget(*here, (0.0, 0.3, 0.0))])
    station.wait(2.9)
    assert station.commanded() == []
    station.wait(0.2)
    assert station.commanded() == [SetTarget(*here)]
    assert "No velocity for 3 s: the vehicle stays" in station.wire.texts


def test_setpoint_streamed_before_its_mode_is_applied_on_mode_change(station):
    """PX4's pattern: stream set-points, then switch to offboard; ArduPilot's: at once, before a snapshot shows it."""
    station.look(2.0, **HOLD)
    station.wire.clear()
    for _ in range(10):
        station.send(local())
        station.wait(0.05)
    assert station.commanded() == [] and station.wire.texts == []
    station.look(3.0)
    assert station.commanded() == [SetTarget((3.0, 4.0, 5.0))]
    station.look(4.0, **HOLD)
    station.command(176, 1, 4)
    station.send(local())
    assert station.commanded()[1:] == [SetTarget((3.0, 4.0, 5.0))]


def test_repeated_setpoint_is_applied_again_after_a_mode_change(station):
    station.send(local())
    station.look(2.0, **HOLD)
    station.look(3.0)
    station.send(local())
    assert station.commanded() == [SetTarget((3.0, 4.0, 5.0))] * 2


# ---- status texts ----


def texts(station):
    """Return the texts, each whole."""
    whole = []
    for message in station.wire.of("STATUSTEXT"):
        if message.chunk_seq:
            whole[-1] += message.text
        else:
            whole.append(message.text)
    return whole


def test_ignored_setpoints_are_announced(station):
    station.look(2.0, **HOLD)
    station.wire.clear()
    for _ in range(35):
        station.send(local())
        station.wait(0.1)
    assert texts(station) == ["Set-points wait: the mode is position hold, they apply in region reaching"]
    assert {m.severity for m in station.wire.of("STATUSTEXT")} == {mavlink.MAV_SEVERITY_NOTICE}


def test_every_rejection_reason_is_eventually_reported(station):
    for k in range(6):
        station.send(local(frame=20 + k % 3))
    assert len(station.wire.texts) == 2  # one text in two parts
    station.wait(2.1)
    said = texts(station)
    assert [sum(f"frame {frame};" in text for text in said) for frame in (20, 21, 22)] == [2, 1, 1]
    assert any("(2 times)" in text for text in said if "frame 21;" in text)


def test_targets_above_water_or_outside_a_region_are_accepted_with_a_warning():
    kept_in = scenario(name="harbour")
    station = Station("ardusub", of=kept_in)
    station.look()
    (region,) = [r.region for r in kept_in.regions if r.region.keep == "in"][:1]
    station.send(local(place=(1000.0, 0.0, -1.5)))
    assert station.commanded() == [SetTarget((1000.0, 0.0, -1.5))]
    said = texts(station)
    assert "Warning: target 1.5 m above the surface" in said
    assert any(text.startswith("Warning: target ") and text.endswith(f"m outside {region.name}") for text in said)
    station.wire.clear()
    station.wait(3.0)
    station.send(local(place=tuple(map(float, shape_center(region.shape)))))
    assert not any("outside" in text for text in texts(station))


# ---- commands ----


def test_speed_command_values_follow_the_protocol(station):
    assert terminal_speed(load_vehicle("bluerov2_heavy")) == pytest.approx(0.85, abs=0.01)  # 13.7 v + 141 v² = 113 N
    for commanded, speed in ((-1.0, None), (0.2, 0.2), (-2.0, scenario().law.gains.speed)):
        assert station.command(SPEED, 0.0, commanded) == ACCEPTED
        assert station.commanded() == ([] if speed is None else [ChangeSetting("law.gains.speed", speed)])
    (value,) = station.send(mavlink.MAVLink_param_request_read_message(1, 1, b"LAW_SPEED", -1))
    assert value.param_value == pytest.approx(scenario().law.gains.speed)
    assert Station(of=scenario(name="paper")).command(SPEED, 1.0, 0.6) == UNSUPPORTED


@pytest.mark.parametrize("speed", [-0.5, 99.0, 0.0, NAN, math.inf, 1.2])
def test_invalid_speeds_are_rejected_with_text(speed):
    station = Station("ardusub", of=scenario("vehicle='bluerov2_heavy'", name="pipe-inspection"))
    station.look()
    assert station.command(SPEED, 0.0, speed) == DENIED
    assert "Refused: a speed of" in "".join(station.wire.texts) and station.commanded() == []


def test_reposition_moves_the_target(station):
    x, y, z = where((30.0, -20.0, 4.0))
    assert station.command_int(REPOSITION, 0, (-1.0, 1.0, 0.0, 0.5), x, y, z) == ACCEPTED
    assert close_to(station.commanded(), [SetTarget((30.0, -20.0, 4.0)), SetHeading(0.5)], 0.02)
    assert station.command(REPOSITION, -1.0, 1.0, 0.0, NAN, x / 1e7, y / 1e7, z) == ACCEPTED
    assert close_to(station.commanded(), [SetTarget((30.0, -20.0, 4.0))], 3.0)  # a float32 of degrees
    assert station.command_int(REPOSITION, 1, (-1, 1, 0, NAN), 10_000, 20_000, 3.0) == ACCEPTED
    assert station.commanded() == [SetTarget((1.0, 2.0, 3.0))]
    assert station.command_int(REPOSITION, 11, (-1, 1, 0, NAN), x, y, z) == UNSUPPORTED
    assert station.command_int(REPOSITION, 0, (-1, 1, 0, NAN), 0, 0, 0.0) == DENIED


def test_reposition_without_a_position_holds_the_current_one(station):
    """As QGroundControl pauses PX4."""
    for numbers in ((), (0.5,), (NAN, NAN, NAN, -2.0)):
        assert station.command(REPOSITION, -1.0, 1.0, 0.0, *numbers) == ACCEPTED
    assert station.commanded() == [SetMode("hold"), SetMode("hold"), SetHeading(0.5), SetTarget((1.0, 2.0, 2.0))]


def test_condition_yaw_sets_the_heading(station):
    station.look(2.0, **EAST)
    assert station.command(YAW, 30.0, 0.0, 1.0, 0.0) == ACCEPTED
    assert station.command(YAW, 30.0, 0.0, -1.0, 1.0) == ACCEPTED
    assert station.command(YAW, NAN, 0.0, 1.0, 0.0) == DENIED
    assert close_to(station.commanded(), [SetHeading(math.radians(30)), SetHeading(math.radians(60))])


def test_qgroundcontrol_altitude_change_moves_the_depth(station):
    deeper = local(frame=7, mask=0xFFF8, place=(0.0, 0.0, 1.5))  # APMFirmwarePlugin::guidedModeChangeAltitude
    station.send(deeper)
    station.wait(0.5)
    station.send(deeper)  # of a stream: the same order
    station.wait(2.0)
    station.look(2.0, **{"position.z": 6.5})
    station.send(deeper)  # again, after a while
    assert station.commanded() == [SetTarget((1.0, 2.0, 6.5)), SetTarget((1.0, 2.0, 8.0))]


def go_to(station, current=2, frame=3, place=(55.9098, -3.3202, -4.0), command=16):
    """Send QGroundControl's "go to location" for ArduPilot, a float32 of degrees; return MAV_MISSION_RESULT."""
    item = mavlink.MAVLink_mission_item_message(1, 1, 0, frame, command, current, 1, 0, 0, 0, 0, *place)
    return station.send(item)[-1].type


def test_qgroundcontrol_goto_location_moves_the_target(station):
    assert go_to(station) == mavlink.MAV_MISSION_ACCEPTED
    assert close_to(station.commanded(), [SetTarget((*GLOBE.to_local(55.9098, -3.3202, 0.0)[:2], 4.0))], 0.5)
    assert go_to(station, current=3) == mavlink.MAV_MISSION_ACCEPTED
    assert station.commanded() == [SetTarget((8.0, 0.0, 4.0))]  # the target's depth alone
    assert go_to(station, frame=10) == mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    assert go_to(station, command=17) == mavlink.MAV_MISSION_UNSUPPORTED
    assert go_to(station, place=(0.0, 0.0, 0.0)) == mavlink.MAV_MISSION_DENIED
    assert go_to(station, place=(math.inf, -3.3, -4.0)) == mavlink.MAV_MISSION_INVALID
    assert station.commanded() == []
    assert go_to(station, place=(55.9097, -3.3203, NAN)) == mavlink.MAV_MISSION_ACCEPTED
    assert station.commanded()[0].position[2] == 5.0  # as deep as it is


def test_first_commanding_station_keeps_control_until_silent(station):
    station.send(local())
    station.send(local(place=(9.0, 9.0, 9.0)), system=250)
    assert station.command(REPOSITION, -1, 1, system=250) == DENIED
    station.now += 3.1
    station.send(local(place=(9.0, 9.0, 9.0)), system=250)
    station.send(local(place=(1.0, 9.0, 9.0)))
    assert station.commanded() == [SetTarget((3.0, 4.0, 5.0)), SetTarget((9.0, 9.0, 9.0))]


def test_obstacle_count_is_bounded_and_stale_obstacles_expire(station):
    for number in (1, 2, 3):
        station.send(obstacle(number))
    assert [command.number for command in station.commanded()] == [1, 2]
    assert any("no room for obstacle 3" in text for text in station.wire.texts)
    station.now += 4.0
    station.send(obstacle(1))
    station.now += 2.0
    station.send(obstacle(3))
    assert station.commanded() == [RemoveObstacle(2), AddObstacle(3, (4.0, 5.0, 6.0), 0.5)]


# ---- sticks ----


@pytest.mark.parametrize(
    ("profile", "message", "wrench"),
    [
        ("ardusub", sticks(x=1000, y=-500), (1.0, -0.5, 0, 0, 0, 0)),
        ("ardusub", sticks(z=1000, r=250), (0, 0, -1.0, 0, 0, 0.25)),  # up
        ("px4", sticks(z=0), (0, 0, 1.0, 0, 0, 0)),
        ("generic", sticks(z=-1000), (0, 0, 1.0, 0, 0, 0)),
        ("generic", sticks(z=0, s=500, t=-500, extensions=3), (0, 0, 0, -0.5, 0.5, 0)),
        ("ardusub", sticks(s=500, t=-500), (0,) * 6),
        ("ardusub", sticks(x=0x7FFF, y=-0x8000, z=0x7FFF, r=100), (0, -1.0, 0, 0, 0, 0.1)),
    ],
)
def test_manual_control_is_applied_in_manual_mode(profile, message, wrench):
    station = Station(profile)
    station.look(**MANUAL)
    station.send(message)
    station.send(message)  # unchanged
    assert station.commanded() == ([ManualControl(wrench)] if any(wrench) else [])


def test_stale_manual_control_is_zeroed(station):
    station.look(2.0, **MANUAL)
    station.send(sticks(x=1000))
    station.wait(2.9)
    assert len(station.commanded()) == 1
    station.wait(0.3)
    assert station.commanded() == [ManualControl((0.0,) * 6)]
    assert "Lost manual control" in station.wire.texts
    station.wait(5.0)
    assert station.commanded() == []


def test_manual_control_is_applied_again_after_arming(station):
    station.look(2.0, **MANUAL, **{"commands.armed": 0.0})
    station.send(sticks(x=1000))
    station.look(2.1, **MANUAL)
    station.send(sticks(x=1000))
    assert len(station.commanded()) == 2


@pytest.mark.parametrize("mode", [0.0, 5.0, 6.0])
def test_rc_override_maps_to_axes_in_ardusub_order(station, mode):
    station.look(2.0, **{"commands.mode": mode})
    station.send(PULSES)
    # where the depth is kept, the stick up asks for a rate beyond a fifth of its way, times the pilot gain of 0.5
    up = 0.5 if mode < 6.0 else (0.5 - 0.1) / (1.0 - 0.1)
    assert close_to(station.commanded(), [ManualControl((1.0, -0.5, -up, 0.0, 0.0, 0.0), by_gain=False)])
    station.send(override(0xFFFF, 0xFFFF, 0, 0xFFFF, 0xFFFF, 1500))  # up released, forward as it is
    assert close_to(station.commanded(), [ManualControl((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), by_gain=False)])
    station.wait(3.1)
    assert station.commanded()[-1] == ManualControl((0.0,) * 6)
