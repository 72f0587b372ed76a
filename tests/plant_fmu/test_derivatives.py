"""Calculated variables and their derivatives, in random states with everything switched on."""

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from scipy.spatial.transform import Rotation

from tests.plant_fmu.conftest import STATES
from tests.plant_fmu.transcription import evaluate, flags

REAL = ("Real", "Float64")


def names(slave, *causalities):
    return [v.name for v in slave.description.modelVariables if v.causality in causalities and v.type in REAL]


def unknowns_of(slave):
    """All that is calculated."""
    return [v for v in names(slave, "output", "local") if v not in STATES and not v.startswith("actuator.")]


def knowns_of(slave):
    states = [v for v in names(slave, "output", "local") if v in STATES or v.startswith("actuator.")]
    return [*states, *names(slave, "input", "parameter")]


def random_values(slave, rng):
    """A vehicle with nothing symmetric about it, in a state where each branch is taken in some draw."""
    settable = knowns_of(slave)
    values = {name: float(slave.by_name[name].start) for name in settable}
    reach = 5.0 if "supply_voltage" in values else 1.0  # commands in four units add up

    root = rng.normal(size=(6, 6))
    added = root @ root.T * 8.0 + np.diag([40.0, 50.0, 60.0, 2.0, 3.0, 4.0])
    values |= {f"added_mass[{i + 1},{j + 1}]": added[i, j] for i in range(6) for j in range(i, 6)}
    values |= {f"inertia.{axes}": 0.3 * rng.normal() for axes in ("xy", "xz", "yz")}
    for prefixes, draw in (
        (("position", "quaternion", "velocity"), lambda: np.clip(rng.normal(), -1.9, 1.9)),
        (("r_G", "r_B", "depth_sensor.bias", "imu.acceleration_bias", "imu.angular_velocity_bias"),
         lambda: 0.05 * rng.normal()),
        (("linear_damping", "quadratic_damping"), lambda: rng.uniform(1.0, 60.0)),
        (("current.", "current_shear.", "current_input"), lambda: 0.3 * rng.normal()),
        (("thrust[", "wrench.", "actuator.", "load.", "trim."), lambda: 25.0 * rng.normal()),
        (("load.world.point", "load.body.point", "dvl.position"), lambda: 0.3 * rng.normal()),
        (("thrust_dead_band", "thrust_curve", "thrust_effectiveness", "thrust_failure"),
         lambda: rng.uniform(0.02, 0.6)),
        (("thruster_matrix",), rng.normal),
        (("thrust_min",), lambda: reach * rng.uniform(-40.0, -10.0)),
        (("thrust_max",), lambda: reach * rng.uniform(10.0, 40.0)),
        (("thrust_time_constant",), lambda: rng.choice([0.0, rng.uniform(0.1, 0.4)])),
        (("thrust_rate_limit",), lambda: rng.choice([0.0, rng.uniform(10.0, 400.0)])),
        (("thrust_normalized",), lambda: rng.uniform(-1.0, 1.0)),
        (("thrust_pulse",), lambda: rng.choice([0.0, rng.uniform(1090.0, 1910.0)])),
        (("thrust_rpm",), lambda: rng.uniform(-4e3, 4e3)),
        (("supply_voltage",), lambda: rng.uniform(10.1, 19.9)),
    ):  # fmt: skip
        values |= {name: draw() for name in settable if name.startswith(prefixes)}
    return values | {
        "wrench_force_limit": rng.uniform(10.0, 60.0),
        "wrench_time_constant": rng.choice([0.0, 0.3]),
        "hull_radius": 1.5,
        "bottom_depth": 2.0,
        "bottom_time_constant": rng.choice([0.01, 0.3]),
        "compass.bias": rng.uniform(-4.0, 4.0),
        "dvl.scale_error": 0.02,
    }


FEW = [*((i, 3, False) for i in range(12)), (50, 2, False), *((i, 3, True) for i in range(60, 64)), (70, 2, True)]
MANY = [*((i, 3, False) for i in range(12, 50)), *((i, 2, False) for i in range(51, 55)),
        *((i, 3, True) for i in range(80, 100))]  # fmt: skip


@pytest.fixture(params=[*FEW, *(pytest.param(p, marks=pytest.mark.slow) for p in MANY)], ids=str)
def somewhere(request, make_slave):
    """An FMU in a random state, which tests set back, and its values; with inputs of coupling in some cases."""
    seed, fmi, coupled = request.param
    rng = np.random.default_rng(seed)
    slave = make_slave("odin", fmi, coupled)
    slave.enter()
    values = random_values(slave, rng) | {"free_surface": bool(rng.integers(2))}
    slave.set_values(values)
    return slave, values


def scaled_error(found, expected):
    """Return the maximum difference of two Jacobians, relative to the largest element of each row."""
    return (np.abs(found - expected) / np.maximum(1.0, np.abs(expected).max(axis=1, keepdims=True))).max()


def test_values_are_those_of_the_transcription(somewhere):
    slave, values = somewhere
    expected = evaluate(values, 8)
    assert set(expected) == set(unknowns_of(slave))
    assert slave.get(*expected) == pytest.approx(list(np.real(list(expected.values()))), rel=1e-10, abs=1e-11)
    assert {name: slave.flag(name) for name in flags(values, 8)} == flags(values, 8)


@pytest.mark.medium(fast=1)
def test_jacobian_is_that_of_complex_steps(somewhere):
    """Every known, parameters too, and to 1e-12 of the greatest element of each row."""
    slave, values = somewhere
    unknowns, knowns = unknowns_of(slave), knowns_of(slave)
    columns = []
    for name in knowns:
        moved = evaluate(values | {name: values[name] + 1e-30j}, 8)
        columns.append([np.imag(moved[u]) / 1e-30 for u in unknowns])
    assert scaled_error(slave.jacobian(unknowns, knowns), np.array(columns).T) < 1e-12


def test_jacobian_is_that_of_central_differences(somewhere):
    """Without any model of ours: the FMU against itself."""
    slave, values = somewhere
    inner = [name for name in names(slave, "input") if values[name] > float(slave.by_name[name].min)]
    unknowns, knowns = unknowns_of(slave), [*STATES, *inner]
    columns = []
    for name in knowns:
        ends, h = [], 1e-5 * max(1.0, abs(values[name]))
        for step in (h, -h):
            slave.set_values({name: values[name] + step})
            ends.append(np.array(slave.get(*unknowns)))
        slave.set_values({name: values[name]})
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    assert scaled_error(slave.jacobian(unknowns, knowns), np.array(columns).T) < 1e-6


def test_one_direction_is_the_sum_of_its_columns_and_the_adjoint_the_transpose(somewhere):
    slave, _ = somewhere
    unknowns, knowns = unknowns_of(slave), knowns_of(slave)
    u, k = ([slave.by_name[name].valueReference for name in group] for group in (unknowns, knowns))
    rng, jacobian = np.random.default_rng(3), slave.jacobian(unknowns, knowns)
    seed, weights = rng.normal(size=len(k)), rng.normal(size=len(u))
    if slave.fmi == 2:
        together = slave.fmu.getDirectionalDerivative(vUnknown_ref=u, vKnown_ref=k, dvKnown=list(seed))
    else:
        together = slave.fmu.getDirectionalDerivative(unknowns=u, knowns=k, seed=list(seed), nSensitivity=len(u))
        adjoint = slave.fmu.getAdjointDerivative(unknowns=u, knowns=k, seed=list(weights), nSensitivity=len(k))
        assert adjoint == pytest.approx(weights @ jacobian, rel=1e-12, abs=1e-9)
    assert together == pytest.approx(jacobian @ seed, rel=1e-12, abs=1e-9)


def test_drifting_current_has_a_time_derivative(make_slave):  # in FMI 2.0 the time is no variable
    slave = make_slave("odin", 3).start(**{"current_variation.y": 0.2, "seed": 42})
    before = slave.get("water_velocity.y")[0]
    (slope,) = slave.jacobian(["water_velocity.y"], ["time"])[0]
    slave.fmu.doStep(0.0, 0.01)
    assert abs(slope) > 1e-3
    assert slave.get("water_velocity.y")[0] == pytest.approx(before + 0.01 * slope, rel=1e-9)


def test_zero_command_derivative_is_the_curve_slope(make_slave, fmi):
    slave = make_slave("odin", fmi).start(**{"thrust_curve[1]": 0.3, "thrust_time_constant[1]": 0.0})
    assert slave.jacobian(["thruster_force[1]"], ["thrust[1]"])[0] == pytest.approx([0.7])


def test_sampled_outputs_have_zero_state_derivatives(make_slave, fmi):
    slave = make_slave("odin", fmi).start(**{"depth_sensor.rate": 10.0})
    assert slave.jacobian(["measured.depth", "measured.position.z"], ["position.z"]).tolist() == [[0.0], [1.0]]


@pytest.mark.parametrize(("unknown", "known"), [("mass", "mass"), ("der(velocity.u)", "actuation.X")])
def test_derivative_of_non_outputs_is_rejected(make_slave, fmi, unknown, known):
    slave = make_slave("odin", fmi).start()
    with pytest.raises(FMICallException):
        slave.jacobian([unknown], [known])
    assert "value reference" in slave.said[-1][1]


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.5])
def test_straight_up_a_turn_about_the_vertical_is_yaw(make_slave, fmi, yaw):
    """Where roll and yaw are one, and all is called yaw: the angles give the attitude back."""
    turned = Rotation.from_euler("z", yaw) * Rotation.from_quat([-0.5, 0.5, 0.5, 0.5])
    e = np.roll(turned.as_quat(), 1)
    slave = make_slave("odin", fmi).start(**dict(zip(STATES[3:7], e, strict=True)))
    angles = ["attitude.roll", "attitude.pitch", "attitude.yaw"]
    roll, pitch, found = slave.get(*angles)
    assert (roll, pitch) == (0.0, pytest.approx(np.pi / 2))
    found = Rotation.from_euler("ZYX", [found, pitch, roll]).as_matrix()
    assert found == pytest.approx(turned.as_matrix(), abs=1e-12)
    turning = 0.5 * np.array([-e[3], -e[2], e[1], e[0]])  # of (0, 0, 0, 1) times e
    assert slave.jacobian(angles, STATES[3:7]) @ turning == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
