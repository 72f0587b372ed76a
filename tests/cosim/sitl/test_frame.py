"""From pulses to forces: frame, signs, curve, and dead band."""

import math
from importlib import resources

import numpy as np
import pytest

from cosim.errors import RunError
from cosim.sitl.law import make_control_law, make_pwm_law
from plant_fmu import load_vehicle
from tests.cosim.sitl.stand_in import VECTORED_6DOF

SHIPPED = resources.files("plant_fmu") / "vehicles"

BLUEROVS = ["bluerov2_heavy", "bluerov2_heavy_wu"]


def forces(law, outputs, n=8):
    given = np.full(n, math.nan)
    law.set_outputs(outputs)
    law.step(None, None, None, None, given)
    return given


@pytest.mark.parametrize("name", BLUEROVS)
@pytest.mark.parametrize("motor", range(8))
def test_motor_effects_match_ardusub_factors(name, motor):
    """By the sign of each factor; ArduSub ignores roll and pitch of the horizontal motors."""
    vehicle = load_vehicle(name)
    pulses = [1500] * 16
    pulses[motor] = 1900
    wrench = vehicle.thruster_matrix @ forces(make_pwm_law(vehicle), pulses)
    for axis, factor in enumerate(VECTORED_6DOF[motor]):
        if factor:
            assert np.sign(wrench[axis]) == factor
        elif axis not in (3, 4):
            assert wrench[axis] == 0.0


@pytest.mark.parametrize(
    ("pulse", "part"),
    [
        (1500, 0.0), (1525, 0.0), (1475, 0.0), (1526, 0.065**2), (1700, 0.25), (1900, 1.0), (1300, -0.25), (1100, -1.0),
        (2000, 1.0), (1000, -1.0),  # beyond the span: full
        (0, 0.0), (1, 0.0), (799, 0.0), (2201, 0.0), (65535, 0.0),  # no pulse
    ],
)  # fmt: skip
def test_thrust_curve_is_applied(pulse, part):
    """u|u| of 40 N with u = (pulse - 1500)/400, and a sign of -1."""
    given = forces(make_pwm_law(load_vehicle("bluerov2_heavy")), [pulse] * 16)
    assert given == pytest.approx([-40.0 * part] * 8, abs=1e-12)


def own(tmp_path, table):
    text = (SHIPPED / "bluerov2_heavy.toml").read_text().partition("[autopilot]")[0] + table
    path = tmp_path / "own.toml"
    path.write_text(text)
    return path


def test_custom_channels_signs_and_curve_are_applied(tmp_path):
    table = '[autopilot]\nframe = "mine"\nchannels = [9, 0, 3, 32, 5, 6, 7, 8]\nsigns = [1, 1, -1, 1, 1, 1, 1, 1]\n'
    vehicle = load_vehicle(own(tmp_path, table + 'curve = "linear"\npwm_dead_band = 0\n'))
    law = make_pwm_law(vehicle)
    assert [d.name for d in law.diagnostics] == ["pwm9", "pwm3", "pwm32", "pwm5", "pwm6", "pwm7", "pwm8", "lost"]
    pulses = [1500] * 32
    pulses[8], pulses[2], pulses[31], pulses[1] = 1600, 1600, 1400, 1900
    assert forces(law, pulses).tolist() == [10.0, 0.0, -10.0, -10.0, 0.0, 0.0, 0.0, 0.0]
    assert forces(law, pulses[:16])[3] == 0.0  # a packet without that channel
    assert law.report.tolist() == [1600.0, 1600.0, 0.0, 1500.0, 1500.0, 1500.0, 1500.0, 0.0]


def test_vehicle_without_autopilot_table_is_rejected():
    with pytest.raises(RunError, match=r"vehicle 'odin' has no table \[autopilot\]"):
        make_pwm_law(load_vehicle("odin"))


def test_controls_map_linearly_to_force_limits():
    vehicle = load_vehicle("rexrov")
    n = vehicle.n_thrusters
    given = forces(make_control_law(vehicle), [1.0, -1.0, 0.5, math.nan, 3.0, 0.0, 0.0, 0.0], n)
    expected = [1.0, 1.0, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0][:n]
    limits = [vehicle.thrust_max[0], vehicle.thrust_min[1], *vehicle.thrust_max[2:]]
    assert given == pytest.approx(np.multiply(expected, limits))
