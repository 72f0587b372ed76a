"""Pulses, sticks and wrenches as forces: the curves that a simulated autopilot flies by."""

import numpy as np
import pytest

from cosim.errors import ImportLogError
from cosim.logs.cleaning.topics import Topic
from cosim.logs.forces import command_forces, servo_outputs
from plant_fmu import load_vehicle
from plant_fmu.autopilot import effort_of_pulse

HEAVY = load_vehicle("bluerov2_heavy")


def forces_of(quantity, values, curve=None, parameters=None):
    """Forces of samples at 15 V, and whether they are of thrusters or a wrench."""
    values = np.atleast_2d(values)
    topic = Topic(quantity, "RCOU", None, values.shape[1])
    commands = command_forces(topic, HEAVY, curve, "15 V", parameters or {})
    return commands.forces(values, np.full(len(values), 15.0)), commands.through


def test_pulse_forces_match_the_simulated_autopilot():
    pulses = [1500.0, 1520.0, 1600.0, 1400.0, 1900.0, 1100.0, 1750.0, 1250.0, *[0.0] * 8]
    expected = [40.0 * effort_of_pulse(HEAVY.autopilot, -1)(pulse) for pulse in pulses[:8]]
    forces, through = forces_of("pulses", pulses)
    np.testing.assert_allclose(forces[0], expected)
    assert through == "thrusters"


@pytest.mark.parametrize("curve", [None, "t200"])
def test_reversed_motor_negates_the_force(curve):
    plain, turned = (forces_of("pulses", np.full(16, 1600.0), curve, p)[0][0] for p in ({}, {"MOT_3_DIRECTION": -1.0}))
    assert (plain < 0.0).all()  # the vehicle's signs
    np.testing.assert_allclose(turned, plain * np.where(np.arange(8) == 2, -1.0, 1.0))


def test_motor_outputs_follow_autopilot_parameters():
    swapped = {f"SERVO{n}_FUNCTION": 33.0 + motor for n, motor in enumerate([1, 0, 2, 3, 4, 5, 6, 7], 1)}
    assert servo_outputs(HEAVY.autopilot, HEAVY, swapped) == (2, 1, 3, 4, 5, 6, 7, 8)
    six = {f"SERVO{n}_FUNCTION": 32.0 + n for n in range(1, 7)}
    with pytest.raises(ImportLogError, match=r"drives 6 motors .* expected 8 as vehicle 'bluerov2_heavy' has"):
        servo_outputs(HEAVY.autopilot, HEAVY, six)


VALUES, WRENCH = np.array([1.0, -1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.25]), np.arange(6.0)
# four thrusters of 40 N at 45 degrees, of which ArduSub's first gain takes a half
SURGE = [0.5 * 4.0 * 40.0 * np.sqrt(0.5), 0, 0, 0, 0, 0]


@pytest.mark.parametrize(
    ("quantity", "values", "forces", "through"),
    [
        ("effort", VALUES, 40.0 * VALUES, "thrusters"), ("thrust", VALUES, VALUES, "thrusters"),
        ("sticks", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0], SURGE, "wrench"), ("wrench", WRENCH, WRENCH, "wrench"),
    ],
)  # fmt: skip
def test_efforts_and_sticks_use_the_thruster_limits(quantity, values, forces, through):
    received, means = forces_of(quantity, values)
    np.testing.assert_allclose(received[0], forces, atol=1e-9)
    assert means == through


@pytest.mark.parametrize(
    ("vehicle", "quantity", "size", "curve", "what"),
    [
        ("odin", "pulses", 16, None, r"vehicle 'odin' has no table \[autopilot\]"),
        ("bluerov2_heavy", "pulses", 16, "t200", "--curve t200 needs the voltage, expected --voltage"),
        ("bluerov2_heavy", "pulses", 4, None, "has 4 outputs, expected 8"),
        ("bluerov2_heavy", "thrust", 6, None, "commands of 6 thrusters, expected 8"),
    ],
)
def test_missing_requirements_of_commands_are_named(vehicle, quantity, size, curve, what):
    with pytest.raises(ImportLogError, match=what):
        command_forces(Topic(quantity, "RCOU", None, size), load_vehicle(vehicle), curve, "", {})


@pytest.mark.parametrize("curve", ["linear", "quadratic", "t200"])
def test_pulse_gaps_give_nan_forces_and_disabled_outputs_zero(curve):
    forces, _ = forces_of("pulses", [[np.nan] * 16, [0.0] * 16, [1700.0] * 16], curve)
    assert np.isnan(forces[0]).all() and not forces[1].any() and (forces[2] < -5.0).all()
