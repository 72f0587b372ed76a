"""The companion's parts, each against a number that stands elsewhere."""

import math
import struct
import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from cosim.command_line.cli import main
from cosim.companion.autopilot_link import NetworkLink
from cosim.companion.clock_sync import ClockSync
from cosim.companion.companion_options import CompanionOptions
from cosim.companion.companion_run import Companion
from cosim.companion.failsafes import Failsafes
from cosim.companion.frame_alignment import FrameAlignment, SceneOrigin
from cosim.companion.heading import HeadingWatch, LevelDive
from cosim.companion.pilot_watch import PilotWatch
from cosim.companion.safety import CONDITIONS, Observation, Supervisor
from cosim.companion.session import AutopilotSession
from cosim.companion.set_points import TurnLead, VelocityLead, make_attitude_message, make_velocity_target
from cosim.companion.sticks import make_manual_control, make_stick_scale, override_channels
from cosim.companion.vehicle_state import ReportedState, requested_rates
from cosim.errors import RunError
from cosim.mavlink.vehicle.ardusub_sticks import MotorMixer
from cosim.mavlink.vehicle.geodesy import LocalFrame
from cosim.mavlink.vehicle.profile import PROFILES
from cosim.mavlink.vehicle.row_layout import quaternion_to_euler
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.thrust_body import get_thrust_body
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.commands.commands import ManualControl
from plant_fmu import load_vehicle
from tests.cosim.mavlink.station import Station, scenario
from tests.cosim.mavlink.stubs import free_port, message
from tests.cosim.sitl.stand_in import VECTORED_6DOF

HEAVY = load_vehicle("bluerov2_heavy")
ARDUSUB = PROFILES["ardusub"]
SHIFT = 0.9, -1.6, 1.9


# ---- clocks ----


def test_clock_offset_uses_the_fastest_answer_since_the_autopilot_started():
    sync = ClockSync()
    assert math.isnan(sync.offset)
    for sent, took, skew in ((10.0, 0.100, 0.03), (11.0, 0.004, 0.0), (12.0, 0.060, -0.02)):
        stamp = sync.request(sent)
        sync.add_answer(round((sent + took / 2 + skew - 3.0) * 1e9), stamp, sent + took)
    assert sync.offset == pytest.approx(3.0, abs=1e-6) and sync.round_trip == pytest.approx(0.004)
    sync.add_answer(5_000_000_000, 123, 13.0)  # nobody asked for it
    assert sync.offset == pytest.approx(3.0, abs=1e-6)
    sync.add_answer(round(0.5 * 1e9), sync.request(20.0 - 0.005), 20.0 + 0.005)  # it has started again
    assert sync.offset == pytest.approx(19.5, abs=1e-6)


# ---- the frame ----


def reported(position, geodetic=None, depth=None, received_at=0.0, state=None):
    """Let a state receive position and, where they are given, latitude and longitude and the pressure of a depth."""
    state = state or ReportedState()
    x, y, z = map(float, position)
    messages = [
        message("HEARTBEAT", type=12, autopilot=3, base_mode=1),
        message("LOCAL_POSITION_NED", time_boot_ms=round(received_at * 1e3), x=x, y=y, z=z),
    ]
    if depth is not None:
        messages += [message("SCALED_PRESSURE2", press_abs=1013.25 + 1000.0 * 9.80665 * depth / 100.0)]
    if geodetic is not None:
        lat, lon = (round(angle * 1e7) for angle in geodetic[:2])
        messages += [message("GLOBAL_POSITION_INT", lat=lat, lon=lon)]
    for sent in messages:
        state.receive(1, 1, sent, received_at)
    return state


ORIGIN = (55.9097, -3.3203)


def follow(positions, origin, depth, spread=None):
    """Report positions every 0.1 s, with where the vehicle is on the globe; return the alignment and the state."""
    alignment, frame, state = FrameAlignment(origin), LocalFrame(*ORIGIN), None
    for k, position in enumerate(positions):
        geodetic = frame.to_global(tuple(spread[k])) if spread is not None else None
        state = reported(position, geodetic, depth, 0.1 * k, state)
        assert origin.surveyed or alignment.offset is None
        alignment.update(state, 0.1 * k)
    return alignment, state


def test_frame_offset_is_derived_from_global_position_and_pressure():
    true = np.array([3.0, -2.0, 4.0])
    alignment, state = follow([true + SHIFT] * 10, SceneOrigin(geodetic=ORIGIN), true[2], [true] * 10)
    assert alignment.offset == pytest.approx([-0.9, 1.6, -1.9], abs=0.02)  # 1e-7 deg is a centimeter
    assert alignment.to_scene(state.position) == pytest.approx(true, abs=0.02)


@pytest.mark.parametrize(("chosen", "first"), [(None, 2), (3, 3)])
def test_only_one_of_two_autopilots_is_flown(chosen, first):
    state = ReportedState(chosen)
    for system in (2, 3):
        for sent in (message("HEARTBEAT", type=12, autopilot=3, base_mode=1), message("LOCAL_POSITION_NED", x=system)):
            state.receive(system, 1, sent, 1.0)
    assert state.system == first and state.position[0] == first
    for target in (0, 1, 2, 3):
        for sent in (sticks(900, 500, target), mavlink.MAVLink_rc_channels_override_message(target, 1, *[1700] * 8)):
            pilot = PilotWatch((255, 191))
            pilot.receive(255, 190, sent, state, 2.0)
            assert (pilot.seen_at == 2.0) == (target in (0, first))


def test_zero_latitude_and_longitude_are_a_position_of_an_absolute_estimate():
    state = reported((0.0, 0.0, 0.0), (0.0, 0.0))
    assert state.global_position is None  # what an ArduSub without one sends
    state.receive(1, 1, message("EKF_STATUS_REPORT", flags=16), 0.0)
    assert reported((0.0, 0.0, 0.0), (0.0, 0.0), state=state).global_position == (0.0, 0.0, 0.0)


def test_an_origin_is_lost_when_the_autopilot_restarts():
    state = reported((0.0, 0.0, 0.0))
    for boot, place, has_origin in (
        (90, 5, True), (91, 5, True), (1, 0, False), (2, 0, False), (3, 5, True), (1, 5, True),
    ):  # fmt: skip
        state.receive(1, 1, message("GLOBAL_POSITION_INT", time_boot_ms=1000 * boot, lat=place, lon=place), 0.0)
        assert state.has_origin == has_origin and (state.global_position is not None) == has_origin


def test_depth_that_drifts_from_the_second_pressure_is_seen_in_a_surveyed_frame():
    """SCALED_PRESSURE2 may be the only pressure."""
    positions = [(0.0, 0.0, 2.0 + min(0.01 * k, 2.0)) for k in range(600)]
    alignment, _ = follow(positions, SceneOrigin(surveyed=(0.0, 0.0, 0.0)), 2.0)
    assert alignment.drift == pytest.approx(2.0, abs=0.1)


def test_inconsistent_positions_give_no_frame_offset():
    spread = np.random.default_rng(1).normal(0.0, 0.5, (60, 3))
    alignment, state = follow(np.zeros((60, 3)), SceneOrigin(geodetic=ORIGIN), 1.0, spread)
    assert alignment.offset is None and "agree" in alignment.missing(state)


# ---- what is sent ----


def force_of_motors(motors):
    """The wrench of an ArduSub's motor commands: force goes with the square, and our thrusters push the other way."""
    return HEAVY.thruster_matrix @ (-40.0 * motors * np.abs(motors))


def test_full_surge_of_a_bluerov2_at_half_gain_is_28_newtons():
    """As a real ArduSub was measured to give; and no stick asks for more."""
    scale = make_stick_scale(HEAVY, ARDUSUB, 0.5, "manual-control")
    assert scale.sticks(np.array([28.28, 0.0, 0.0, 0.0, 0.0, 0.0]))[0] == pytest.approx(1.0, abs=0.01)
    assert np.abs(scale.sticks(np.full(6, -1e3))).max() <= 1.0
    assert scale.sticks(np.array([math.nan, math.inf, 0, 0, 0, 0])) == pytest.approx(np.zeros(6), abs=1e-12)


@pytest.mark.parametrize(
    "wrench", [(28, 0, 0, 0, 0, 0), (7, 7, 0, 0, 0, 0), (7, -5, 2.5, 0, 0, 0.25), (0, 0, -10, 0.5, 0.5, 0)]
)
@pytest.mark.parametrize("sticks_by", ["manual-control", "rc-override"])
def test_ardusub_motor_mix_realizes_the_desired_wrench(wrench, sticks_by):
    """It adds the sticks in each motor. The pilot's gain leaves roll and pitch, and overridden channels, alone."""
    sticks = make_stick_scale(HEAVY, ARDUSUB, 0.5, sticks_by).sticks(np.array(wrench, dtype=float))
    pilot = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 0.5]) if sticks_by == "manual-control" else np.ones(6)
    made = force_of_motors(VECTORED_6DOF @ (pilot * sticks))
    assert made == pytest.approx(np.array(wrench), rel=0.01, abs=0.05)


@pytest.mark.parametrize("force", [(30.0, 60.0, 110.0), (100.0, 0.0, -150.0), (0.0, 90.0, 30.0)])
def test_a_force_beyond_the_thrusters_leaves_the_moments_whole(force):
    """AP_Motors6DOF divides all that vertical, and all that horizontal motors are asked for by the greatest above 1."""
    scale, moment = make_stick_scale(HEAVY, ARDUSUB, 1.0, "manual-control"), np.array([5.0, -3.0, 1.0])
    motors = VECTORED_6DOF @ scale.sticks(np.concatenate([force, moment]))
    for group in (slice(0, 4), slice(4, 8)):
        motors[group] /= max(1.0, np.abs(motors[group]).max())
    made = force_of_motors(motors)
    assert made[3:] == pytest.approx(moment, abs=0.05)
    assert np.dot(made[:3], force) / np.linalg.norm(force) > 30.0


@pytest.mark.parametrize("profile", ["px4", "generic"])
def test_manual_control_realizes_the_desired_wrench(profile):
    """Through the vehicle's own service for sticks, whose parts of the greatest wrench the pilot's gain scales."""
    station = Station(profile, of=scenario("vehicle='bluerov2_heavy'", name="pipe-inspection"))
    scale = make_stick_scale(HEAVY, PROFILES[profile], 0.5, "manual-control")
    wrench = np.array([10.0, -5.0, 8.0, 0.5, -0.8, 1.2])
    sent = make_manual_control(mavlink, 1, PROFILES[profile], scale.sticks(wrench), all_axes=True)
    station.play({"commands.mode": 0.0}, sent)
    (command,) = station.commanded()
    assert isinstance(command, ManualControl)
    assert 0.5 * np.array(command.wrench) / np.diag(scale.efforts) == pytest.approx(wrench, rel=0.02)


@pytest.mark.parametrize(
    ("sticks_by", "gain", "parameters", "speeds", "yaw"),  # speeds up and down [m/s], and yaw rate at 45 deg
    [
        ("manual-control", 0.5, {}, (0.5, 0.5), 4.5),
        ("rc-override", 0.5, {}, (0.5, 0.5), 4.5),
        ("manual-control", 1.0, {"ACRO_YAW_P": 3.375, "PILOT_SPEED_UP": 200.0, "PILOT_SPEED_DN": 100.0}, (2.0, 1.0),
         3.375),
        ("manual-control", 1.0, {"PILOT_SPEED_UP": 150.0, "PILOT_SPEED_DN": 0.0}, (1.5, 1.5), 4.5),
        ("manual-control", 1.0, {"JS_THR_GAIN": 0.8}, (0.5, 0.5), 4.5),
    ],
)  # fmt: skip
def test_rate_sticks_realize_the_desired_rates_in_ardusub(sticks_by, gain, parameters, speeds, yaw):
    """As its Sub::get_pilot_desired_climb_rate and pwm_to_angle_dz have it, also by its parameters."""
    scale = make_stick_scale(HEAVY, ARDUSUB, gain, sticks_by).with_rates(parameters)
    scaled = gain if sticks_by == "manual-control" else 1.0
    for rate in (0.02, -0.1, 0.2):
        throttle = 500.0 - 500.0 * scaled * parameters.get("JS_THR_GAIN", 1.0) * scale.climb_stick(rate)
        top, bottom = 500.0 + 100.0 * gain, 500.0 - 100.0 * gain
        climb = (throttle - top) / (1000.0 - top) if throttle > top else (throttle - bottom) / bottom
        assert -speeds[rate > 0.0] * climb == pytest.approx(rate)
        pulse, dead = 400.0 * scaled * scale.yaw_rate_stick(rate), 40.0 * gain
        angle = 45.0 * math.copysign(abs(pulse) - dead, pulse) / (400.0 - dead)
        assert math.radians(yaw * angle) == pytest.approx(rate)
    assert scale.climb_stick(0.0) == scale.yaw_rate_stick(0.0) == scale.yaw_rate_stick(math.nan) == 0.0


@pytest.mark.parametrize("parameters", [{"ATC_ANGLE_MAX": 30.0}, {"ANGLE_MAX": 3000.0}])
def test_lean_sticks_realize_the_desired_angles_in_ardusub(parameters):
    scale = make_stick_scale(HEAVY, ARDUSUB, 1.0, "manual-control").with_rates(parameters)
    stick = scale.lean_sticks(np.array([math.radians(15.0), math.radians(40.0)]))
    assert (400.0 * stick[0] - 30.0) / 370.0 * 30.0 == pytest.approx(15.0) and stick[1] == 1.0


def test_rc_override_follows_the_ardusub_order_and_zero_releases():
    for sent, first in (
        (override_channels(mavlink, 1, np.array([1.0, -1.0, 0.5, 0.25, -0.25, 0.1])),
         [1400, 1600, 1300, 1540, 1900, 1100]),  # pitch roll up yaw ahead right
        (override_channels(mavlink, 1, None), [0] * 6),
    ):  # fmt: skip
        assert [getattr(decoded(sent), f"chan{i}_raw") for i in range(1, 9)] == [*first, 0xFFFF, 0xFFFF]


def test_state_is_predicted_over_its_age():
    """A steady motion, 40 ms after its messages came, and with a stamp no older than that; no further than 0.1 s."""
    state = reported((1.0, 2.0, 3.0), received_at=10.0)
    state.velocity[:], state.rates[:] = (0.5, 0.0, -0.25), (0.0, 0.0, 0.3)
    state.receive(1, 1, mavlink.MAVLink_attitude_quaternion_message(0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.3), 10.0)
    position, quaternion = state.predict(10.04)
    assert position == pytest.approx([1.02, 2.0, 2.99])
    assert quaternion_to_euler(quaternion.tolist()) == pytest.approx((0.0, 0.0, 0.012))
    assert state.predict(20.0)[0] == pytest.approx([1.05, 2.0, 2.975])
    never = ReportedState()
    assert np.isnan(never.predict(0.0)[0]).all()


@pytest.mark.parametrize(
    ("profile", "steer_by", "sticks_by", "word"),
    [
        ("px4", "sticks", "manual-control", "forward stick"), ("px4", "wrench", "manual-control", "no roll and pitch"),
        ("px4", "velocity", "manual-control", "pushes nowhere"), ("px4", "attitude", "rc-override", "no sticks are"),
        ("ardusub", "velocity", "rc-override", "no sticks"), ("generic", "attitude", "rc-override", "no sticks are"),
    ],
)  # fmt: skip
def test_unsupported_setpoints_are_rejected_by_name(profile, steer_by, sticks_by, word):
    with pytest.raises(RunError, match=word):
        Companion(scenario(name="pipe-inspection"), None, CompanionOptions(profile, steer_by, sticks_by))


def test_attitude_setpoint_leads_by_the_desired_moment():
    """A second-order loop that is asked for it accelerates as the moment does."""
    lead, state = TurnLead(HEAVY), reported((0.0, 0.0, 0.0))
    inertia = np.diag(HEAVY.inertia) + np.diag(HEAVY.added_mass)[3:]
    state.rates[:] = 0.0, 0.1, 0.2
    asked = lead.attitude(np.array([0, 0, 0, 0.1, 0.0, -0.2]), state)
    angle = 2.0 * asked[1:]  # small
    acceleration = (angle / 0.3 - state.rates) / 0.3
    assert acceleration * inertia == pytest.approx([0.1, 0.0, -0.2], abs=0.01)
    far = lead.attitude(np.array([0, 0, 0, 1e3, 0.0, 0.0]), state)
    assert quaternion_to_euler(far.tolist())[0] == pytest.approx(0.1)  # the autopilot keeps it level but for so much
    still = reported((0.0, 0.0, 0.0))
    assert lead.attitude(np.full(6, math.nan), still) == pytest.approx([1.0, 0.0, 0.0, 0.0])
    assert quaternion_to_euler(lead.attitude(np.array([0, 0, 0, 0, 0, 1e3]), still).tolist())[2] == pytest.approx(0.35)


def test_three_axis_thrust_uses_the_published_attitude_target_extension():
    """MAVLink's common.xml: three floats behind type_mask, which leave the checksum as it is."""
    message = make_attitude_message(mavlink, 1, np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.25, -0.5, 0.125]))
    frame = message.pack(mavlink.MAVLink(None, 255, 191))
    assert frame[1] == 51 and struct.unpack("<3f", frame[10 + 39 : 10 + 51]) == (0.25, -0.5, 0.125)
    (found,) = mavlink.MAVLink(None).parse_buffer(frame)
    assert found.type_mask == 0b100111 and get_thrust_body(found) == (0.25, -0.5, 0.125)
    assert frame == message.pack(mavlink.MAVLink(None, 255, 191))  # it can be sent again
    without = make_attitude_message(mavlink, 1, np.array([1.0, 0.0, 0.0, 0.0]), None)
    assert decoded(without).type_mask == 0b1000111 and get_thrust_body(decoded(without)) == (0.0, 0.0, 0.0)


def test_velocity_setpoint_leads_by_the_desired_acceleration():
    def asked_for(force, speed):
        state = reported((0.0, 0.0, 0.0))
        state.velocity[:] = speed, 0.0, 0.0
        return VelocityLead(HEAVY, 0.5, 0.25).velocity(np.array([force, 0.0, 0.0, 0.0, 0.0, 0.0]), state, 0.02)

    asked = asked_for(10.0, 0.0)
    assert asked == pytest.approx([0.5 * 10.0 / (13.5 + 6.36), 0.0, 0.0])  # mass and added mass of the source
    assert asked_for(13.7 * 0.3 + 141.0 * 0.3**2, 0.3) == pytest.approx([0.3, 0.0, 0.0])
    assert asked_for(1e5, 0.0) == pytest.approx([0.8, 0.0, 0.0])
    message = make_velocity_target(mavlink, 1, asked, 0.25)
    assert message.type_mask == 0b010111000111 and message.yaw_rate == 0.25
    assert make_velocity_target(mavlink, 1, asked, None).type_mask == 0b110111000111
    assert message.coordinate_frame == mavlink.MAV_FRAME_LOCAL_NED


@pytest.mark.parametrize(("gain", "lag", "push"), [(1.0, 3.0, 0.0), (0.41, 1.55, -0.05), (0.65, 0.8, 0.06)])
def test_velocity_lead_compensates_unknown_gain_and_lag(gain, lag, push):
    """A speed is kept through a loop that is not the assumed one, with a current; without the observer it is not."""
    lead, state, period, wanted = VelocityLead(HEAVY, 2.0, 0.5), reported((0.0, 0.0, 0.0)), 0.02, 0.25
    for _ in range(1500):
        speed = state.velocity[0]
        drag = 13.7 * speed + 141.0 * speed * abs(speed)
        force = drag + 19.86 * 0.8 * (wanted - speed)
        asked = lead.velocity(np.array([force, 0.0, 0.0, 0.0, 0.0, 0.0]), state, period)[0]
        state.velocity[0] += period * ((gain * asked - speed) / lag + push)
    assert state.velocity[0] == pytest.approx(wanted, abs=0.005)


def test_a_dive_by_velocity_stays_on_the_spot_against_a_current():
    """An ArduSub that did dv/dt = 0.27 asked - 0.65 (v - 0.12 m/s) was carried 0.8 m away by a velocity of 0."""
    lead, state, period = VelocityLead(HEAVY, 2.0, 0.5), reported((0.0, 0.0, 0.0)), 0.02
    farthest = 0.0
    for _ in range(350):
        asked = lead.hold(-state.position[:2], 0.2, state, period)
        state.velocity[:2] += period * (0.27 * asked[:2] - 0.65 * (state.velocity[:2] - (0.12, -0.05)))
        state.position[:] += period * state.velocity
        farthest = max(farthest, float(np.linalg.norm(state.position[:2])))
    assert asked[2] == 0.2 and farthest < 0.15 and np.linalg.norm(state.position[:2]) < 0.1


def test_distance_without_a_fix_is_accumulated():
    """Of 3 m north and 4 m down the horizontal part, and only while the estimate says that it is relative."""
    relative, absolute = 8, 24  # flags of EKF_STATUS_REPORT and ESTIMATOR_STATUS
    alignment, state = FrameAlignment(SceneOrigin(surveyed=SHIFT)), ReportedState()
    way = [(0.0, absolute), (1.0, absolute), (2.0, relative), (4.0, relative), (9.0, absolute)]
    for k, (north, flags) in enumerate(way):
        reported((north, 0.0, 4.0 * north / 3.0), received_at=k * 0.02, state=state)
        state.receive(1, 1, mavlink.MAVLink_ekf_status_report_message(flags, *[0.0] * 5), k * 0.02)
        alignment.update(state, k * 0.02)
    assert alignment.reckoned == pytest.approx(3.0)
    state.receive(1, 1, mavlink.MAVLink_estimator_status_message(0, relative, *[0.0] * 8), 1.0)
    assert state.is_reckoned


# ---- heading ----


def attitude(state, at, yaw, rate):
    """Report a yaw and its rate at a time since boot [s]."""
    turn = [math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)]
    state.receive(1, 1, mavlink.MAVLink_attitude_quaternion_message(round(1000.0 * at), *turn, 0.0, 0.0, rate), at)


def test_a_heading_leaps_where_the_rates_do_not_explain_its_turn():
    state, watch = ReportedState(), HeadingWatch()
    state.receive(1, 1, mavlink.MAVLink_heartbeat_message(12, 3, 0, 0, 4, 3), 0.0)
    for k in range(100):  # a turn of 50 deg/s across 180 deg
        attitude(state, 0.02 * k, 3.0 + math.radians(k), math.radians(50.0))
        watch.update(state)
    assert watch.leap < 1e-5
    attitude(state, 2.0, 3.0 + math.radians(108.0), math.radians(50.0))
    watch.update(state)
    assert math.degrees(watch.leap) == pytest.approx(8.0, abs=0.01)
    watch.restart()
    attitude(state, 4.0, 0.0, 0.0)  # two seconds later nobody knows
    watch.update(state)
    assert watch.leap == 0.0


def dived(texts=(), clearance=None, armed_first=False):
    """Let a vehicle be armed and follow the dive, and return it, the state, and for how long it dived [s]."""
    state, dive = ReportedState(), LevelDive(0.6)
    dive.clearance = clearance
    state.system, state.is_armed = 1, armed_first
    state.position[:], state.velocity[:] = (0.0, 0.0, 1.0), 0.0
    dive.update(state, 0.0)
    state.is_armed = True
    for k in range(1000):
        now = 0.02 * k
        dive.update(state, now)
        if not dive.is_needed(state, now):
            return dive, state, now
        state.velocity[2] = dive.speed_down(state)
        state.position[2] += 0.02 * state.velocity[2]
        if state.position[2] > 1.5 and now < 5.0:
            state.texts.extend(texts)
    raise AssertionError("it dives on")


@pytest.mark.parametrize(
    ("texts", "clearance", "armed_first", "depth", "seconds"),
    [
        (["EKF3 IMU0 MAG0 in-flight yaw alignment complete"], None, False, 1.6, 7.0),
        ((), None, False, 1.6, 9.0),  # an older one says nothing
        ((), None, True, 1.0, 0.0), ((), 1.5, False, 1.0, 0.0), ((), 2.0, False, 1.6, 9.0),
    ],
)  # fmt: skip
def test_an_ardusub_dives_until_its_heading_is_aligned(texts, clearance, armed_first, depth, seconds, caplog):
    """Unless it was armed before, or a hard region is near below."""
    _, state, since = dived(texts, clearance and (lambda position: clearance - position[2]), armed_first)
    assert state.position[2] == pytest.approx(depth, abs=0.06) and since == pytest.approx(seconds, abs=1.0)
    assert ("too near within 0.6 m below" in caplog.text) == (clearance == 1.5)


# ---- who may steer ----


def seen(**values):
    return Observation(0.0, True, True, True, True, {name.replace("_", " "): v for name, v in values.items()})


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda condition: condition.name)
def test_steering_ends_only_beyond_a_condition_limit(condition):
    supervisor = Supervisor()
    assert supervisor.update(seen()) == "steering"
    at_limit = Observation(0.0, True, True, True, True, {condition.name: condition.limit})
    assert supervisor.update(at_limit) == "steering"
    beyond = at_limit._replace(values={condition.name: condition.limit + 0.01})
    assert supervisor.update(beyond) == condition.next_state and supervisor.reason == condition.name
    assert supervisor.update(seen()) == condition.next_state  # until somebody resumes
    supervisor.resume()
    assert supervisor.update(seen()) == "steering" and supervisor.reason == ""


def test_supervisor_states_advance_in_order():
    supervisor, diver = Supervisor(), Supervisor()
    for k, state in enumerate(("waiting", "aligning", "disarmed", "engaging", "steering")):
        assert supervisor.update(Observation(0.0, *(i < k for i in range(4)), {})) == state
    for needs_dive, is_in_mode, state in (
        (True, False, "diving"),
        (False, True, "engaging"),
        (False, True, "steering"),
    ):
        assert diver.update(Observation(0.0, True, True, True, is_in_mode, {}, needs_dive)) == state
    assert Supervisor(dry_run=True).update(Observation(0.0, True, True, False, False, {})) == "dry_run"


def sticks(x, z, target=1):
    return mavlink.MAVLink_manual_control_message(target, x, 0, z, 0, 0)


@pytest.mark.parametrize(
    ("sender", "sent", "counts"),
    [
        ((255, 191), sticks(900, 500), False),  # ours
        ((255, 190), sticks(20, 500), False),  # at rest, as an ArduSub's sticks are
        ((255, 190), sticks(0, 0), True),  # full down
        ((255, 190), sticks(0, 700), True), ((254, 1), sticks(300, 500), True),
        ((255, 190), mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0, 0, 1, 100), True),  # pitch
        ((255, 190), mavlink.MAVLink_manual_control_message(1, 0x7FFF, 0x7FFF, 0x7FFF, 0x7FFF, 0), False),
        *(((255, 190), mavlink.MAVLink_rc_channels_override_message(1, 1, 0, 65535, 1500, 1500, pwm, 0, 0, 0), counts)
          for pwm, counts in ((1700, True), (1510, False))),
    ],
)  # fmt: skip
def test_deflected_foreign_sticks_count_as_a_pilot(sender, sent, counts):
    pilot = PilotWatch((255, 191))
    pilot.receive(*sender, sent, reported((0.0, 0.0, 0.0)), 5.0)
    assert (pilot.seen_at == 5.0) == counts


def channels(pulses):
    return mavlink.MAVLink_rc_channels_message(0, 6, *np.round(pulses).astype(int).tolist(), *[0xFFFF] * 12, 0xFF)


@given(
    st.integers(0, 2**32 - 1), st.sampled_from([0.05, 0.3, 1.0]), st.floats(0.0, 1.4),
    st.integers(0, 5), st.sampled_from([-1, 1]), st.booleans(),
)  # fmt: skip
def test_only_channels_beyond_our_recent_sticks_and_off_their_rest_are_a_pilot(seed, size, delay, channel, sign, rests):
    """As an ArduSub reports them late, on any wiring; a radio rests where it was before our first stick."""
    random, state = np.random.default_rng(seed), reported((0.0, 0.0, 0.0))
    scale, pilot = make_stick_scale(HEAVY, ARDUSUB, 0.5, "manual-control"), PilotWatch((255, 191))
    rest = np.where(random.random(6) < 0.5, 1500.0, random.integers(1100, 1900, 6))
    for now, pulses in ((-9.0, np.full(6, 1500.0)), (-2.0, rest if rests else np.full(6, 1500.0)), (0.0, rest)):
        pilot.receive(1, 1, channels(pulses), state, now)
    rest = rest if rests else np.full(6, 1500.0)  # a stick that is held as we begin
    sent = [np.clip(random.normal(0.0, size, 6), -1.0, 1.0) for _ in range(100)]
    gains = np.array([1.0, 1.0, 0.5, 0.5, 0.5, 0.5])  # of pitch roll up yaw ahead right
    pulses = [1500.0 + 400.0 * gains * (s * (1, 1, -1, 1, 1, 1))[[4, 3, 2, 5, 0, 1]] for s in sent]
    for k, own in enumerate(sent):
        now = 1.0 + 0.02 * k
        pilot.record_sent(scale.pulses(own), now)
        late = k - round(delay / 0.02)
        pilot.receive(1, 1, channels(pulses[late] if late >= 0 else rest), state, now)
    pilot.receive(1, 1, channels(pulses[-1]), state, 7.0)  # the last sticks act on while our loop stalls
    assert pilot.seen_at == -math.inf
    foreign, recent = pulses[-1].copy(), np.array([np.full(6, 1500.0), *pulses[-77:]])[:, channel]
    foreign[channel] = recent.max() + 40.0 if sign > 0 else recent.min() - 40.0
    pilot.receive(1, 1, channels(foreign), state, 7.0)
    assert (pilot.seen_at == 7.0) == (abs(foreign[channel] - rest[channel]) > 26.0)


def test_a_px4_mode_is_known_before_its_next_heartbeat():
    """It sends a heartbeat a second, and refuses an interval for them; a mode is waited for 0.8 s."""
    state, offboard = reported((0.0, 0.0, 0.0)), PROFILES["px4"].custom_modes["reach"]
    state.receive(1, 1, mavlink.MAVLink_current_mode_message(0, offboard, offboard), 5.0)
    assert state.mode == offboard
    assert requested_rates("px4")["CURRENT_MODE"] >= 5.0


def test_no_message_is_requested_that_the_autopilot_does_not_have():
    """An ArduSub answers each such request with a text on every station."""
    reports = {"px4": {"CURRENT_MODE", "ESTIMATOR_STATUS"}, "ardusub": {"EKF_STATUS_REPORT", "RC_CHANNELS"}}
    reports["generic"] = reports["px4"] | {"EKF_STATUS_REPORT"}
    for profile, names in reports.items():
        assert set(requested_rates(profile)) & (reports["px4"] | reports["ardusub"]) == names
        assert len(requested_rates(profile)) == 9 + len(names)


# ---- the autopilot's own failsafes ----


def decoded(message):
    (found,) = mavlink.MAVLink(None).parse_buffer(message.pack(mavlink.MAVLink(None, 1, 1)))
    return found


def failsafes_of(profile, failsafes=None, **values):
    """Return failsafes that received these parameters; PX4 sends the bits of an integer in a float."""
    failsafes = failsafes or Failsafes(profile)
    for name, value in values.items():
        bits = struct.unpack("<f", struct.pack("<i", value))[0] if isinstance(value, int) else value
        kind = mavlink.MAV_PARAM_TYPE_INT32 if isinstance(value, int) else mavlink.MAV_PARAM_TYPE_REAL32
        failsafes.receive(decoded(mavlink.MAVLink_param_value_message(name.encode(), bits, kind, 1, 0)))
    return failsafes


def test_failsafe_parameters_are_requested_for_up_to_three_seconds():
    failsafes = Failsafes("ardusub")
    assert not failsafes.is_read(0.0)
    asked = [len(failsafes.names_to_request(0.25 * k)) for k in range(9)]
    assert asked == [25, 0, 25, 0, 25, 0, 25, 0, 25]
    values = {"FS_GCS_ENABLE": 2.0, "FS_GCS_TIMEOUT": 5.0, "SOMETHING_ELSE": 1.0, "FS_EKF_ACTION": math.nan}
    failsafes_of("ardusub", failsafes, **values)
    assert "FS_GCS_ENABLE" not in failsafes.names_to_request(2.5)
    assert not failsafes.is_read(3.0) and failsafes.is_read(3.1) and not failsafes.names_to_request(4.0)
    first, second, silent = failsafes.text()
    assert first == "FS_GCS_ENABLE 2: on a ground station that falls silent it disarms"
    assert second == "FS_GCS_TIMEOUT 5: s until then"
    assert silent.startswith("not answered by the autopilot: FS_PILOT_INPUT,")
    without_timeout = "FS_GCS_TIMEOUT not answered: an ArduSub without it (4.5) uses 2.5 s"
    assert without_timeout in failsafes_of("ardusub", FS_GCS_ENABLE=3.0).text()
    assert without_timeout not in failsafes_of("ardusub", FS_GCS_ENABLE=0.0).text()


def test_an_ardusub_that_ignores_the_companion_s_sticks_or_learns_the_magnetic_field_is_known():
    newer = {"MAV_GCS_SYSID": 250.0, "MAV_GCS_SYSID_HI": 252.0}
    for values, accepted, words in (
        ({}, range(256), ""), ({"SYSID_MYGCS": 250.0}, (250,), "SYSID_MYGCS is 250"),
        (newer, range(250, 253), "MAV_GCS_SYSID is 250, MAV_GCS_SYSID_HI 252"),
        (newer | {"MAV_GCS_SYSID_HI": 0.0}, (250,), "MAV_GCS_SYSID is 250"),
    ):  # fmt: skip
        for system in range(249, 256):
            ignored = failsafes_of("ardusub", **values).ignored_sticks(system)
            assert ignored == ("" if system in accepted else words)
    assert not failsafes_of("ardusub").learns_magnetic_field()
    for value, learns in ((3.0, True), (2.0, False)):
        assert failsafes_of("ardusub", EK3_MAG_CAL=value).learns_magnetic_field() == learns


SAFE = {"ardusub": {"FS_GCS_ENABLE": 2.0}, "px4": {"COM_OF_LOSS_T": 1.0}}
NO_REACTION = "no reaction is known if the companion fails"
OUTLASTS = "RC_OVERRIDE_TIME is {:g}, FS_PILOT_TIMEOUT is {:g}; expected 1 s or less"
FOR_EVER = "the last forces act for ever"


@pytest.mark.parametrize(
    ("profile", "values", "warning"),
    [
        ("ardusub", {"FS_GCS_ENABLE": 0.0}, NO_REACTION),
        ("ardusub", {"FS_PILOT_INPUT": 0.0, "FS_PILOT_TIMEOUT": 0.5}, "FS_PILOT_INPUT 0 disables FS_PILOT_TIMEOUT"),
        ("ardusub", {"FS_PILOT_INPUT": 2.0}, "FS_PILOT_INPUT 2 disarms a held vehicle"),
        ("ardusub", {"FS_PILOT_INPUT": 1.0}, None),
        ("px4", {"COM_OF_LOSS_T": 0.0}, f"{NO_REACTION}: COM_OF_LOSS_T"),
        *(("ardusub", {"RC_OVERRIDE_TIME": override, "FS_PILOT_TIMEOUT": pilot},
           OUTLASTS.format(override, pilot) if warns else None)
          for override, pilot, warns in ((3.0, 1.0, True), (0.5, 3.0, True), (-1.0, 1.0, True), (0.5, 1.0, False))),
        # as a PX4 did: NAV_RCL_ACT counts where COM_OBL_RC_ACT names a mode that needs sticks
        *(("px4", {"COM_OBL_RC_ACT": lost, "NAV_RCL_ACT": sticks}, FOR_EVER if warns else None)
          for lost, sticks, warns in ((0, 0, True), (2, 0, True), (5, 0, False), (0, 2, False))),
        ("px4", {"UUV_THRUST_SAT": 0.1}, "the law counts on the thrusters' full force"),
        ("px4", {"UUV_THRUST_SAT": 1.0}, None),
    ],
)  # fmt: skip
def test_parameters_that_leave_a_vehicle_without_a_failsafe_are_warned_of(profile, values, warning):
    warnings = [line for line in failsafes_of(profile, **SAFE[profile] | values).text() if line.startswith("WARNING: ")]
    assert len(warnings) == (warning is not None) and all(warning in line for line in warnings)


def test_simulated_autopilot_clock_runs_at_the_given_speedup():
    with NetworkLink(parse_endpoint("udpout:127.0.0.1:14598"), speedup=5.0) as link:
        before, wall = link.clock(), time.monotonic()
        link.receive(0.1)  # a fiftieth of a second of the wall's
        assert link.clock() - before >= 0.1
        assert link.clock() == pytest.approx(5.0 * wall, abs=5.0 * (time.monotonic() - wall) + 1e-6)


@pytest.mark.medium
def test_a_verb_lets_a_companion_hold_and_resume(capsys):
    """Beside it, by its own port; one that is not there is reported in one line."""
    port, over = free_port(), threading.Event()
    with NetworkLink(parse_endpoint(f"udpin:127.0.0.1:{port}"), identity=(7, 191)) as link:
        session = AutopilotSession(link, HEAVY, CompanionOptions())

        def serve():
            while not over.is_set():
                session.exchange(np.zeros(6), link.clock(), link.clock() + 0.02)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            for verb, is_held in (("hold", True), ("resume", False), ("hold", True)):
                assert main(["mavlink", verb, f"udpout:127.0.0.1:{port}", "--system-id", "7"]) == 0
                assert session._taken_over == is_held
            assert main(["mavlink", "resume", f"udpout:127.0.0.1:{port}"]) == 2
            session._is_ending = True
            assert main(["mavlink", "resume", f"udpout:127.0.0.1:{port}", "--system-id", "7"]) == 2
            assert session._taken_over
        finally:
            over.set()
            thread.join()
    where = f"cosim: udpout:127.0.0.1:{port}"
    assert capsys.readouterr().err.splitlines() == [
        f"{where}: no companion of system 255 answers",
        f"{where}: the companion answers MAV_RESULT_DENIED, expected ACCEPTED",
    ]


def test_sticks_of_six_thrusters_command_every_axis_but_pitch():
    vehicle = load_vehicle("bluerov2")
    assert greatest_wrench(vehicle)[4] == 0.0 and (np.delete(greatest_wrench(vehicle), 4) > 0.0).all()
    mixer = MotorMixer(vehicle)
    assert not mixer.commands[:, 4].any()  # ArduSub's frame vectored has no pitch
    scale = make_stick_scale(vehicle, ARDUSUB, 1.0, "manual-control")
    forces = np.array([6.0, -3.0, 4.0, 2.0, -5.0, 3.0])
    wrench = vehicle.thruster_matrix @ forces
    given = mixer.wrench(scale.sticks(wrench))
    assert np.delete(given, 4) == pytest.approx(np.delete(wrench, 4), abs=0.02)
