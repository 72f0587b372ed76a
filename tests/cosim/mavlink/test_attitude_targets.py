"""Attitude set-points: each profile follows what its autopilot does, and refuses the rest by name."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.companion.set_points import attitude_target
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
def test_thrust_is_a_rate_of_climb_to_an_ardusub_in_guided(thrust, rate):
    made = station("ardusub", REACH)
    for _ in range(5):  # it is streamed
        made.send(target(thrust=thrust))
    ((attitude, force, rate_down),) = commands_of(made)
    assert attitude == TURNED and force == (0.0, 0.0, 0.0) and rate_down == pytest.approx(rate)


def test_without_thrust_sticks_push_an_ardusub_in_alt_hold():
    made = station("ardusub", DEPTH_HOLD)
    made.send(attitude_target(mavlink, 1, np.array(TURNED), None))
    assert commands_of(made) == [(TURNED, None, None)]


@pytest.mark.parametrize("profile", ["px4", "generic"])
def test_a_thrust_along_each_axis_pushes_a_px4_in_offboard(profile):
    made = station(profile, REACH)
    made.send(attitude_target(mavlink, 1, np.array(TURNED), np.array([0.25, -0.5, 0.0])))
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
def test_an_attitude_that_is_not_sent_any_more_ends(profile, mode, after, ends):
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
def test_what_cannot_be_followed_is_refused_by_name(profile, message, words):
    made = station(profile, REACH)
    made.send(message)
    assert made.commanded() == [] and words in "".join(made.wire.texts)


@pytest.mark.parametrize(("profile", "mask"), [("ardusub", RATES), ("ardusub", RATES | NO_THRUST), ("px4", RATES)])
def test_set_points_before_their_mode_are_the_usual_way_and_worth_a_word_after_three_seconds(profile, mask):
    made = station(profile, {"commands.mode": 1.0})
    for _ in range(50):
        made.send(target(mask))
        made.wait(0.05)
    assert made.commanded() == [] and not any("wait" in text for text in made.wire.texts)
    for _ in range(50):
        made.send(target(mask))
        made.wait(0.05)
    assert "".join(made.wire.texts).count("Attitude set-points wait") == 1
