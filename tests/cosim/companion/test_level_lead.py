"""Lean angles beside an ArduSub's attitude loop: they keep the vehicle level, and are no second loop."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mavlink

from cosim.companion.companion_options import CompanionOptions
from cosim.companion.companion_run import scenario_to_steer
from cosim.companion.outputs import Output
from cosim.companion.set_points import LevelLead
from tests.cosim.companion.test_parts import HEAVY, decoded, reported
from tests.cosim.mavlink.station import scenario
from tests.cosim.sitl.stand_in import VECTORED_6DOF


def angle_of(pulse):
    """Return the lean [rad] of a pulse off the middle, as pwm_to_angle_dz and ANGLE_MAX have it."""
    return math.radians(45.0) * math.copysign(max(abs(pulse) - 30.0, 0.0) / 370.0, pulse)


def greatest_tilt(forces, leaning=True):
    """Return the greatest tilt [rad] under a sequence of surge, sway, heave [N], in ArduSub's STABILIZE.

    As AC_AttitudeControl has it, with its default gains; a body with the published inertia and moments.
    """
    output = Output(mavlink, HEAVY, CompanionOptions(pilot_gain=1.0))
    state, period, tilt = reported((0.0, 0.0, 0.0)), 0.02, 0.0
    inertia = (np.diag(HEAVY.inertia) + np.diag(HEAVY.added_mass)[3:])[:2]
    angle, rate, integral = np.zeros(2), np.zeros(2), np.zeros(2)
    for force in forces:
        (message,) = output.make_messages(np.array([*force, 0.0, 0.0, 0.0]), state, period)
        m = decoded(message)
        asked = np.array([angle_of(m.t), angle_of(m.s)]) if leaning else np.zeros(2)
        for _ in range(4):
            wrong = 6.0 * (asked - angle) - rate
            integral = np.clip(integral + 0.09 * wrong * period / 4, -0.444, 0.444)
            roll, pitch = 0.135 * wrong + integral
            motors = VECTORED_6DOF @ (m.x / 1e3, m.y / 1e3, (500 - m.z) / 500, roll, pitch, 0.0)
            made = HEAVY.thruster_matrix @ (-40.0 * motors * np.abs(motors))
            righting = 131.588 * 0.01 * np.sin(angle)
            damping = np.diag((1.19, 0.47)) @ (rate * np.abs(rate)) + np.array([0.0, 0.8]) * rate
            rate = rate + period / 4 * (made[3:5] - righting - damping) / inertia
            angle = angle + period / 4 * rate
        tilt = max(tilt, float(np.hypot(*angle)))
    return tilt


@pytest.mark.parametrize("force", [(36.0, 0.0, 5.0), (0.0, -40.0, 8.0), (25.0, 25.0, 15.0)])
def test_leans_keep_an_ardusub_level_while_it_is_pushed(force):
    """Thrusters 0.085 m above the center tilt it as surge or sway sets in and turns round; without the leans by 20."""
    ramp = [min(k / 50, 1.0) for k in range(200)]
    turn = [max(1.0 - k / 50, -1.0) for k in range(200)]
    forces = [(part * force[0], part * force[1], force[2]) for part in ramp + turn]
    assert greatest_tilt(forces) < math.radians(6.0)
    assert greatest_tilt(forces, leaning=False) > math.radians(15.0)


@pytest.mark.parametrize("moment", [(0.0, 0.0), (3.0, -2.0), (math.nan, 0.0)])
def test_leans_depend_on_neither_the_attitude_nor_the_law_s_moments(moment):
    wrench = np.array([20.0, -10.0, 5.0, *moment, 0.0])
    level, tilted = reported((0.0, 0.0, 0.0)), reported((0.0, 0.0, 0.0))
    tilted.receive(1, 1, mavlink.MAVLink_attitude_quaternion_message(0, 0.98, 0.2, 0.0, 0.0, 0.5, -0.4, 0.0), 0.0)
    leans = []
    for state, given in ((level, np.array([20.0, -10.0, 5.0, 0.0, 0.0, 0.0])), (tilted, wrench)):
        output = Output(mavlink, HEAVY, CompanionOptions(sticks_by="rc-override", pilot_gain=1.0))
        output.make_messages(given, state, 0.02)
        leans.append(output.sticks[3:5].copy())
    assert leans[0] == pytest.approx(leans[1]) and np.abs(leans[0]).min() > 0.1


def test_leans_cancel_munk_s_moment():
    """Fossen (2021), 6.5: about pitch it is (Z_w' - X_u') u w of a vehicle whose added mass is diagonal."""
    surge, sway, heave = np.diag(HEAVY.added_mass)[:3]
    u, v, w = -0.67, 0.2, 0.47
    made = -np.array([(heave - sway) * -v * w, (heave - surge) * u * w])
    assert LevelLead(HEAVY).moments(np.array([u, v, w])) == pytest.approx(made)
    assert LevelLead(HEAVY).moments(np.full(3, math.nan)).tolist() == [0.0, 0.0]


def test_the_law_finds_out_no_stiffness_where_the_autopilot_levels():
    for steer_by, adapts in (("sticks", False), ("attitude", False), ("velocity", False), ("wrench", True)):
        gains = scenario_to_steer(scenario(name="pipe-inspection"), steer_by).law.gains
        assert (gains.adaptation > 0.0) is (gains.effectiveness_estimation > 0.0) is adapts


def test_the_law_s_speed_leaves_the_autopilot_a_part_of_the_thrusters():
    """Full surge of a BlueROV2 Heavy is 4 x 40 N cos 45; its drag ahead is 13.7 v + 141 v^2 [N], as published."""
    speed = scenario_to_steer(scenario(name="pipe-inspection"), "sticks").law.gains.speed
    assert (13.7 + 141.0 * speed) * speed == pytest.approx(0.7 * 160.0 * math.cos(math.pi / 4))
    slower = scenario("law.gains.speed=0.4", name="pipe-inspection")
    assert scenario_to_steer(slower, "sticks").law.gains.speed == 0.4
    assert scenario_to_steer(slower, "wrench").law.gains.speed == 0.4
