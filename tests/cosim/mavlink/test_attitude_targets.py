"""Attitude set-points: each profile follows what its autopilot does, and refuses the rest by name."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.companion.set_points import make_attitude_message
from cosim.simulation.commands.commands import SetAttitude, SetTarget
from tests.cosim.mavlink.station import NAN, Station

RATES, THRUST_BODY, NO_THRUST, NO_ATTITUDE = 0b111, 1 << 5, 1 << 6, 1 << 7
TURNED = (0.8, 0.0, 0.0, 0.6)
REACH, DEPTH_HOLD = {"commands.mode": 2.0}, {"commands.mode": 6.0}


def target(mask=RATES, thrust=0.5, attitude=TURNED):
    return mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(attitude), 0.0, 0.0, 0.0, thrust)


def station(profile, mode):
    made = Station(profile)
    made.look(1.0, **mode)
    return made


def commands_of(made):
    return [
        (tuple(round(x, 6) for x in command.quaternion), command.force, command.rate_down)
        for command in made.commanded()
    ]


@pytest.mark.parametrize(("thrust", "rate"), [(0.5, 0.0), (1.0, -0.3), (0.25, 0.15), (0.0, 0.3)])
def test_thrust_is_a_climb_rate_in_ardusub_guided(thrust, rate):
    made = station("ardusub", REACH)
    for _ in range(5):  # it is streamed
        made.send(target(thrust=thrust))
    ((attitude, force, rate_down),) = commands_of(made)
    assert attitude == TURNED and force == (0.0, 0.0, 0.0) and rate_down == pytest.approx(rate)


def test_attitude_target_without_thrust_leaves_force_to_sticks_in_alt_hold():
    made = station("ardusub", DEPTH_HOLD)
    made.send(make_attitude_message(mavlink, 1, np.array(TURNED), None))
    assert commands_of(made) == [(TURNED, None, None)]


@pytest.mark.parametrize("profile", ["px4", "generic"])
def test_three_axis_thrust_acts_in_px4_offboard(profile):
    made = station(profile, REACH)
    made.send(make_attitude_message(mavlink, 1, np.array(TURNED), np.array([0.25, -0.5, 0.0])))
    made.send(target(thrust=0.125))  # which an underwater vehicle's PX4 takes for one ahead
    assert [force for _, force, _ in commands_of(made)] == [(0.25, -0.5, 0.0), (0.125, 0.0, 0.0)]


@pytest.mark.parametrize(
    ("profile", "mode", "after", "ends"),
    [
        ("generic", REACH, 3.0, SetTarget((1.0, 2.0, 5.0), 0.3)),
        ("ardusub", REACH, 3.0, SetTarget((1.0, 2.0, 5.0), 0.3)),
        ("ardusub", DEPTH_HOLD, 5.0, SetAttitude(None)),
    ],
)
def test_stale_attitude_target_expires(profile, mode, after, ends):
    made = station(profile, mode)
    made.send(target(RATES | (NO_THRUST if mode == DEPTH_HOLD else 0)))
    made.commanded()
    made.wait(after - 0.1)
    assert made.commanded() == []
    made.wait(0.2)
    assert made.commanded() == [ends]
    assert any(text.startswith(f"No attitude for {after:g} s") for text in made.wire.texts)


@pytest.mark.parametrize(
    ("profile", "message", "words"),
    [
        ("generic", target(NO_ATTITUDE), "rates alone are not followed"),
        ("generic", target(RATES | NO_THRUST), "a thrust is needed"),
        ("generic", target(thrust=1.5), "beyond -1 to 1"),
        ("generic", target(thrust=NAN), "beyond -1 to 1"),
        ("generic", target(attitude=(2.0, 0.0, 0.0, 0.0)), "not of length 1"),
        ("generic", target(attitude=(NAN, 0.0, 0.0, 0.0)), "not of length 1"),
        ("ardusub", target(RATES | THRUST_BODY), "a rate of climb is"),
    ],
)
def test_invalid_attitude_targets_are_rejected_by_name(profile, message, words):
    made = station(profile, REACH)
    made.send(message)
    assert made.commanded() == [] and words in "".join(made.wire.texts)


@pytest.mark.parametrize(("profile", "mask"), [("ardusub", RATES), ("ardusub", RATES | NO_THRUST), ("px4", RATES)])
def test_setpoints_before_their_mode_are_announced_after_three_seconds(profile, mask):
    made = station(profile, {"commands.mode": 1.0})
    for _ in range(50):
        made.send(target(mask))
        made.wait(0.05)
    assert made.commanded() == [] and not any("wait" in text for text in made.wire.texts)
    for _ in range(50):
        made.send(target(mask))
        made.wait(0.05)
    assert "".join(made.wire.texts).count("Attitude set-points wait") == 1
