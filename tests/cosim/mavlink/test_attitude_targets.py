"""Attitude set-points: each profile follows what its autopilot does, and refuses the rest by name."""

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.companion.set_points import make_attitude_message
from cosim.simulation.commands.commands import SetAttitude, SetTarget
from tests.cosim.mavlink.station import NAN, Station
from tests.cosim.mavlink.stubs import message

RATES, THRUST_BODY, NO_THRUST, NO_ATTITUDE = 0b111, 1 << 5, 1 << 6, 1 << 7
TURNED = (0.8, 0.0, 0.0, 0.6)
HOLD, REACH, DEPTH_HOLD = ({"commands.mode": mode} for mode in (1.0, 2.0, 6.0))
STAYS = SetTarget((1.0, 2.0, 5.0), 0.3)


def target(mask=RATES, thrust=0.5, attitude=TURNED):
    fields = {"target_system": 1, "target_component": 1, "type_mask": mask, "q": list(attitude), "thrust": thrust}
    return message("SET_ATTITUDE_TARGET", **fields)


def with_force(*force):
    return make_attitude_message(mavlink, 1, np.array(TURNED), np.array(force) if force else None)


def climb(rate_down):
    return SetAttitude(TURNED, (0.0, 0.0, 0.0), rate_down)


def waiting(mask):
    early = [target(mask), 0.05] * 50
    return [HOLD, "Mode: Position hold", *early, None, *early, "Attitude set-points wait", []]


SCRIPTS = {  # an ArduSub's in GUIDED, each set-point streamed; in ALT_HOLD; a PX4's in OFFBOARD
    **{f"thrust {thrust} as a climb rate": ("ardusub", [REACH, *[target(thrust=thrust)] * 5, [climb(rate)]])
       for thrust, rate in ((0.5, 0.0), (1.0, -0.3), (0.25, 0.15), (0.0, 0.3))},
    "no thrust, and sticks that push": ("ardusub", [DEPTH_HOLD, with_force(), [SetAttitude(TURNED)]]),
    **{f"thrust of three axes, or ahead, in {profile}": (
        profile, [REACH, with_force(0.25, -0.5, 0.0), target(thrust=0.125),
                  [SetAttitude(TURNED, force) for force in ((0.25, -0.5, 0.0), (0.125, 0.0, 0.0))]])
       for profile in ("px4", "generic")},
    **{f"a stale one in {profile}": (
        profile, [REACH, target(), [command], 2.9, [], 0.2, [STAYS], "No attitude for 3 s"])
       for profile, command in (("generic", SetAttitude(TURNED, (0.5, 0.0, 0.0))), ("ardusub", climb(0.0)))},
    "a stale one in ALT_HOLD": ("ardusub", [DEPTH_HOLD, target(RATES | NO_THRUST), [SetAttitude(TURNED)], 4.9, [], 0.2,
                                            [SetAttitude(None)], "No attitude for 5 s"]),
    "early ones": ("ardusub", waiting(RATES)), "early ones for PX4": ("px4", waiting(RATES)),
    "early ones without thrust": ("ardusub", waiting(RATES | NO_THRUST)),
    **{f"refused: {words} ({k})": (profile, [REACH, sent, [], words]) for k, (profile, sent, words) in enumerate((
        ("generic", target(NO_ATTITUDE), "rates alone are not followed"),
        ("generic", target(RATES | NO_THRUST), "a thrust is needed"),
        ("generic", target(thrust=1.5), "beyond -1 to 1"), ("generic", target(thrust=NAN), "beyond -1 to 1"),
        ("generic", target(attitude=(2.0, 0.0, 0.0, 0.0)), "not of length 1"),
        ("generic", target(attitude=(NAN, 0.0, 0.0, 0.0)), "not of length 1"),
        ("ardusub", target(RATES | THRUST_BODY), "a rate of climb is")))},
}  # fmt: skip


@pytest.mark.parametrize(("profile", "steps"), SCRIPTS.values(), ids=SCRIPTS)
def test_attitude_targets_become_commands_or_texts(profile, steps):
    station = Station(profile)
    station.play({}, *steps)
    assert sum("wait" in text for text in station.wire.texts) == (HOLD in steps)
