"""Pulses, sticks and wrenches as forces: the curves that a simulated autopilot flies by."""

import numpy as np
import pytest

from cosim.errors import ImportLogError
from cosim.logs.forces import command_forces, servo_outputs
from cosim.logs.topics import Topic
from plant_fmu import load_vehicle
from plant_fmu.autopilot import effort_of_pulse

HEAVY = load_vehicle("bluerov2_heavy")


def topic(quantity, size=16):
    return Topic(quantity, "RCOU", None, size)


def test_pulse_forces_match_the_simulated_autopilot():
    commands = command_forces(topic("pulses"), HEAVY, None, "", {})
    pulses = np.array([[1500.0, 1520.0, 1600.0, 1400.0, 1900.0, 1100.0, 1750.0, 1250.0, *[0.0] * 8]])
    table = HEAVY.autopilot
    expected = [40.0 * effort_of_pulse(table, -1)(pulse) for pulse in pulses[0, :8]]
    np.testing.assert_allclose(commands.forces(pulses, np.array([np.nan]))[0], expected)
    assert commands.through == "thrusters"


def test_reversed_motor_negates_the_force():
    pulses = np.full((1, 16), 1600.0)
    for curve in (None, "t200"):
        plain, turned = (
            command_forces(topic("pulses"), HEAVY, curve, "15 V", p).forces(pulses, np.array([15.0]))[0]
            for p in ({}, {"MOT_3_DIRECTION": -1.0})
        )
        assert (plain < 0.0).all()  # the vehicle's signs
        np.testing.assert_allclose(turned, plain * np.where(np.arange(8) == 2, -1.0, 1.0))


def test_motor_outputs_follow_autopilot_parameters():
    swapped = {f"SERVO{n}_FUNCTION": 33.0 + motor for n, motor in enumerate([1, 0, 2, 3, 4, 5, 6, 7], 1)}
    assert servo_outputs(HEAVY.autopilot, HEAVY, swapped) == (2, 1, 3, 4, 5, 6, 7, 8)
    six = {f"SERVO{n}_FUNCTION": 32.0 + n for n in range(1, 7)}
    with pytest.raises(ImportLogError, match=r"drives 6 motors .* expected 8 as vehicle 'bluerov2_heavy' has"):
        servo_outputs(HEAVY.autopilot, HEAVY, six)


def test_efforts_and_forces_use_the_thruster_limits():
    values = np.array([[1.0, -1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.25]])
    effort = command_forces(topic("effort", 8), HEAVY, None, "", {}).forces(values, np.zeros(1))
    np.testing.assert_allclose(effort, 40.0 * values)
    assert (command_forces(topic("thrust", 8), HEAVY, None, "", {}).forces(values, np.zeros(1)) == values).all()
    with pytest.raises(ImportLogError, match="commands of 6 thrusters, expected 8"):
        command_forces(topic("thrust", 6), HEAVY, None, "", {})


def test_sticks_and_wrenches_act_on_the_body():
    sticks = command_forces(topic("sticks", 6), HEAVY, None, "", {})
    surge = sticks.forces(np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]), np.zeros(1))[0]
    # four thrusters of 40 N at 45 degrees, of which ArduSub's first gain takes a half
    np.testing.assert_allclose(surge, [0.5 * 4.0 * 40.0 * np.sqrt(0.5), 0, 0, 0, 0, 0], atol=1e-9)
    assert sticks.through == "wrench"
    wrench = np.arange(6.0)[None]
    assert (command_forces(topic("wrench", 6), HEAVY, None, "", {}).forces(wrench, np.zeros(1)) == wrench).all()


@pytest.mark.parametrize(
    ("vehicle", "curve", "what"),
    [
        ("odin", None, r"vehicle 'odin' has no table \[autopilot\]"),
        ("bluerov2_heavy", "t200", "--curve t200 needs the voltage, expected --voltage"),
    ],
)
def test_missing_requirements_of_pulses_are_named(vehicle, curve, what):
    with pytest.raises(ImportLogError, match=what):
        command_forces(topic("pulses"), load_vehicle(vehicle), curve, "", {})
    with pytest.raises(ImportLogError, match="has 4 outputs, expected 8"):
        command_forces(topic("pulses", 4), HEAVY, None, "", {})


@pytest.mark.parametrize("curve", ["linear", "quadratic", "t200"])
def test_pulse_gaps_give_nan_forces_and_disabled_outputs_zero(curve):
    commands = command_forces(topic("pulses"), HEAVY, curve, "15 V", {})
    pulses = np.array([[np.nan] * 16, [0.0] * 16, [1700.0] * 16])
    forces = commands.forces(pulses, np.full(3, 15.0))
    assert np.isnan(forces[0]).all() and not forces[1].any() and (forces[2] < -5.0).all()
