"""Directional and adjoint derivatives, in random states with everything switched on."""

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from tests.plant_fmu.conftest import STATES
from tests.plant_fmu.transcription import evaluate

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

    def draw(prefix, make):
        values.update({name: make() for name in settable if name.startswith(prefix)})

    root = rng.normal(size=(6, 6))
    added = root @ root.T * 8.0 + np.diag([40.0, 50.0, 60.0, 2.0, 3.0, 4.0])
    values |= {f"added_mass[{i + 1},{j + 1}]": added[i, j] for i in range(6) for j in range(i, 6)}
    values |= {f"inertia.{axes}": 0.3 * rng.normal() for axes in ("xy", "xz", "yz")}
    for prefix in ("position", "quaternion", "velocity"):
        draw(prefix, lambda: np.clip(rng.normal(), -1.9, 1.9))
    for prefix in ("r_G", "r_B", "depth_sensor.bias", "imu.acceleration_bias", "imu.angular_velocity_bias"):
        draw(prefix, lambda: 0.05 * rng.normal())
    for prefix in ("linear_damping", "quadratic_damping"):
        draw(prefix, lambda: rng.uniform(1.0, 60.0))
    for prefix in ("current.", "current_shear."):
        draw(prefix, lambda: 0.3 * rng.normal())
    for prefix in ("thrust[", "wrench.", "actuator."):
        draw(prefix, lambda: 25.0 * rng.normal())
    for prefix in ("thrust_dead_band", "thrust_curve", "thrust_effectiveness"):
        draw(prefix, lambda: rng.uniform(0.02, 0.6))
    draw("thruster_matrix", rng.normal)
    draw("thrust_min", lambda: rng.uniform(-40.0, -10.0))
    draw("thrust_max", lambda: rng.uniform(10.0, 40.0))
    draw("thrust_time_constant", lambda: rng.choice([0.0, rng.uniform(0.1, 0.4)]))
    draw("thrust_rate_limit", lambda: rng.choice([0.0, rng.uniform(10.0, 400.0)]))
    return values | {
        "wrench_force_limit": rng.uniform(10.0, 60.0),
        "wrench_time_constant": rng.choice([0.0, 0.3]),
        "hull_radius": 1.5,
        "bottom_depth": 2.0,
        "bottom_time_constant": rng.choice([0.01, 0.3]),
        "compass.bias": 0.01,
        "dvl.scale_error": 0.02,
    }


FEW = [(i, 3) for i in range(12)] + [(50, 2)]
MANY = [(i, 3) for i in range(12, 50)] + [(i, 2) for i in range(51, 55)]


@pytest.fixture(params=[*FEW, *(pytest.param(p, marks=pytest.mark.slow) for p in MANY)], ids=str)
def somewhere(request, make_slave):
    seed, fmi = request.param
    rng = np.random.default_rng(seed)
    slave = make_slave("odin", fmi)
    slave.enter()
    values = random_values(slave, rng)
    slave.set_values(values | {"free_surface": bool(rng.integers(2))})
    return slave, values | {"free_surface": slave.flag("free_surface")}


def test_values_are_those_of_the_transcription(somewhere):
    slave, values = somewhere
    expected = evaluate(values, 8)
    assert set(expected) == set(unknowns_of(slave))
    assert slave.get(*expected) == pytest.approx(list(np.real(list(expected.values()))), rel=1e-10, abs=1e-11)


@pytest.mark.medium(fast=1)
def test_jacobian_is_that_of_complex_steps(somewhere):
    """Every known, parameters too, and to 1e-12 of the greatest element of each row."""
    slave, values = somewhere
    unknowns, knowns = unknowns_of(slave), knowns_of(slave)
    columns = []
    for name in knowns:
        moved = evaluate(values | {name: values[name] + 1e-30j}, 8)
        columns.append([np.imag(moved[u]) / 1e-30 for u in unknowns])
    expected = np.array(columns).T
    scale = np.maximum(1.0, np.abs(expected).max(axis=1, keepdims=True))
    error = np.abs(slave.jacobian(unknowns, knowns) - expected) / scale
    worst = np.unravel_index(error.argmax(), error.shape)
    assert error.max() < 1e-12, (unknowns[worst[0]], knowns[worst[1]], error.max())


def test_jacobian_is_that_of_central_differences(somewhere):
    """Without any model of ours: the FMU against itself."""
    slave, values = somewhere
    unknowns, knowns = unknowns_of(slave), [*STATES, *names(slave, "input")]
    columns = []
    for name in knowns:
        ends = []
        for step in (1e-5, -1e-5):
            slave.set_values({name: values[name] + step})
            ends.append(np.array(slave.get(*unknowns)))
        slave.set_values({name: values[name]})
        columns.append((ends[0] - ends[1]) / 2e-5)
    expected = np.array(columns).T
    scale = np.maximum(1.0, np.abs(expected).max(axis=1, keepdims=True))
    assert (np.abs(slave.jacobian(unknowns, knowns) - expected) / scale).max() < 1e-6


def test_adjoint_is_the_transpose(make_slave):
    slave = make_slave("odin", 3)
    slave.fmu.enterInitializationMode()
    rng = np.random.default_rng(3)
    slave.set_values(random_values(slave, rng))
    unknowns, knowns = unknowns_of(slave), knowns_of(slave)
    seed = rng.normal(size=len(unknowns))
    references = [[slave.by_name[name].valueReference for name in group] for group in (unknowns, knowns)]
    adjoint = slave.fmu.getAdjointDerivative(
        unknowns=references[0], knowns=references[1], seed=list(seed), nSensitivity=len(knowns)
    )
    assert adjoint == pytest.approx(seed @ slave.jacobian(unknowns, knowns), rel=1e-12, abs=1e-12)


def test_directional_derivatives_are_linear_in_the_seed(make_slave, fmi):
    """One direction in all knowns is the sum of its columns."""
    slave = make_slave("odin", fmi).start(**{"velocity.u": 0.5, "velocity.r": 0.2, "current.x": 0.1})
    knowns, unknowns = [*STATES, "thrust[3]", "mass"], ["der(velocity.u)", "actuation.N", "attitude.yaw"]
    seed = np.random.default_rng(1).normal(size=len(knowns))
    u, k = ([slave.by_name[name].valueReference for name in group] for group in (unknowns, knowns))
    if fmi == 2:
        together = slave.fmu.getDirectionalDerivative(vUnknown_ref=u, vKnown_ref=k, dvKnown=list(seed))
    else:
        together = slave.fmu.getDirectionalDerivative(unknowns=u, knowns=k, seed=list(seed), nSensitivity=len(u))
    assert together == pytest.approx(slave.jacobian(unknowns, knowns) @ seed, rel=1e-13)


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
    """Where roll and yaw are one, and all is called yaw: the other branch of the angles."""
    c, s = np.cos(yaw / 2.0), np.sin(yaw / 2.0)
    w, x, y, z = np.array([0.5, -0.5, 0.5, 0.5])
    e = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])  # first that, then the yaw
    slave = make_slave("odin", fmi).start(**dict(zip(STATES[3:7], e, strict=True)))
    turning = 0.5 * np.array([-e[3], -e[2], e[1], e[0]])  # of (0, 0, 0, 1) times e
    jacobian = slave.jacobian(["attitude.roll", "attitude.pitch", "attitude.yaw"], STATES[3:7])
    assert jacobian @ turning == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
