"""Coupling inputs: each has the effect of the equivalent parameters or wrench."""

import fmpy
import numpy as np
import pytest
from scipy import constants

from plant_fmu import Plant, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.t200 import force_of_pulse
from plant_fmu.variables import variables
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.t200_by_rpm import force_of_rpm

MOTION = ("position.x", "position.y", "position.z", "velocity.u", "velocity.v", "velocity.w", "velocity.q")


@pytest.fixture(scope="module")
def coupled():
    return cached_fmu(make_vehicle_component(load_vehicle("odin"), coupled=True), 3)


def fly(fmu, parameters=None, steps=20, **inputs):
    """Return the motion after steps of 10 ms; inputs by their names with underscores for points."""
    with Plant(fmu) as plant:
        plant.set({"position.z": 2.0, "velocity.u": 0.4, "velocity.q": 0.3, **(parameters or {})})
        plant.initialize()
        for name, value in inputs.items():
            plant[name] = value
        for _ in range(steps):
            plant.step(0.01)
        return np.array([plant[name] for name in MOTION])


def test_without_coupling_inputs_the_variables_are_unchanged():
    """A coupled plant has the same variables in the same order, and others beside them."""
    vehicle = load_vehicle("odin")
    plain, coupled = variables(vehicle), variables(vehicle, coupled=True)
    kept = {v.name for v in plain}
    assert [v.name for v in coupled if v.name in kept] == [v.name for v in plain]
    assert {v.role for v in coupled if v.name not in kept} == {"input", "parameter"}


@pytest.mark.medium
@pytest.mark.parametrize("fmi", [2, 3])
def test_importers_read_units_of_pulses_and_revolutions(fmi):
    """FMPy validates the file by the official schema; factors to SI units are SciPy's."""
    fmu = cached_fmu(make_vehicle_component(load_vehicle("odin"), coupled=True), fmi)
    described = fmpy.read_model_description(str(fmu), validate=True)
    read = {v.name: v.unit for v in described.modelVariables}
    assert (read["thrust_pulse[1]"], read["thrust_rpm[8]"]) == ("us", "rev/min")
    base = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    pulse, turns = base["us"], base["rev/min"]
    assert (pulse.s, pulse.rad, pulse.factor) == (1, 0, pytest.approx(constants.micro, rel=1e-15))
    assert (turns.s, turns.rad) == (-1, 1)
    assert turns.factor == pytest.approx(2.0 * constants.pi / constants.minute, rel=1e-15)
    assert base["rad/s"].factor == 1.0


@pytest.mark.medium
def test_zero_coupling_inputs_change_no_bit(coupled):
    np.testing.assert_array_equal(fly(coupled), fly("odin"))
    np.testing.assert_array_equal(
        fly(coupled, {"current.x": 0.2}, **{"thrust[1]": 9.0}), fly("odin", {"current.x": 0.2}, **{"thrust[1]": 9.0})
    )


@pytest.mark.medium
def test_a_current_is_that_of_the_parameters(coupled):
    got = fly(coupled, {"current.x": 0.1}, **{"current_input.x": 0.2, "current_input.z": -0.1})
    np.testing.assert_allclose(got, fly("odin", {"current.x": 0.3, "current.z": -0.1}), rtol=0.0, atol=1e-15)


@pytest.mark.medium
def test_current_rate_acts_within_a_step(coupled):
    """Held at each step, its velocity alone lags by half a step; with its rate it is the straight line."""

    def drift(step, with_rate):
        with Plant(coupled) as plant:
            plant.set({"position.z": 2.0, "substep": 0.001})
            plant.initialize()
            for k in range(round(1.0 / step)):
                plant["current_input.x"] = 0.5 * k * step
                plant["current_input_rate.x"] = 0.5 if with_rate else 0.0
                plant.step(step)
            return plant["position.x"]

    fine = drift(0.01, True)
    assert drift(0.1, True) == pytest.approx(fine, abs=1e-9)
    assert abs(drift(0.1, False) - fine) > 1e-3


@pytest.mark.medium
def test_a_wrench_in_the_body_frame_is_that_of_the_wrench_input(coupled):
    point, force, moment = np.array([0.3, -0.1, 0.2]), np.array([5.0, 2.0, -3.0]), np.array([0.5, 1.0, -0.7])
    total = moment + np.cross(point, force)
    inputs = {
        f"external.body.{kind}.{axis}": float(value)
        for kind, values in (("point", point), ("force", force), ("moment", moment))
        for axis, value in zip("xyz", values, strict=True)
    }
    wrench = {f"wrench.{name}": float(x) for name, x in zip("XYZKMN", [*force, *total], strict=True)}
    np.testing.assert_allclose(fly(coupled, **inputs), fly("odin", **wrench), rtol=0.0, atol=1e-14)


@pytest.mark.medium
def test_a_force_in_the_world_frame_at_the_center_of_buoyancy_is_buoyancy(coupled):
    """However the vehicle turns meanwhile."""
    with Plant("odin") as plant:
        plant.initialize()
        names = [f"r_B.{axis}" for axis in "xyz"]
        r_B, buoyancy = [plant[name] for name in names], plant["buoyancy"]
    inputs = {"external.world.force.z": -7.0} | {
        f"external.world.point.{axis}": x for axis, x in zip("xyz", r_B, strict=True)
    }
    np.testing.assert_allclose(fly(coupled, **inputs), fly("odin", {"buoyancy": buoyancy + 7.0}), rtol=0.0, atol=1e-13)


@pytest.mark.medium
def test_commands_of_thrusters_in_other_units(coupled):
    with Plant("odin") as plant:
        plant.initialize()
        least, most = plant["thrust_min[1]"], plant["thrust_max[1]"]
    for share, force in ((0.25, 0.25 * most), (-0.5, 0.5 * least)):
        got = fly(coupled, **{"thrust_normalized[1]": share})
        np.testing.assert_allclose(got, fly("odin", **{"thrust[1]": force}), rtol=0.0, atol=1e-14)
    for pulse, voltage in ((1100.0, 16.0), (1475.0, 13.0), (1500.0, 12.0), (1731.0, 19.9), (1950.0, 20.0)):
        force = float(force_of_pulse(np.array([pulse]), np.array([voltage]))[0])
        got = fly(coupled, {"supply_voltage": voltage}, **{"thrust_pulse[2]": pulse})
        np.testing.assert_allclose(got, fly("odin", **{"thrust[2]": force}), rtol=0.0, atol=1e-13)
    for rpm, voltage in ((-9e3, 13.0), (-2455.0, 15.1), (-130.0, 10.0), (0.0, 11.0), (700.0, 17.0), (3600.0, 19.9)):
        force = float(force_of_rpm(np.array([rpm]), np.array([voltage]))[0])
        got = fly(coupled, {"supply_voltage": voltage}, **{"thrust_rpm[2]": rpm})
        np.testing.assert_allclose(got, fly("odin", **{"thrust[2]": force}), rtol=0.0, atol=1e-13)


@pytest.mark.medium
def test_failure_reduces_the_thruster_force(coupled):
    got = fly(coupled, {"thrust_effectiveness[1]": 0.8}, **{"thrust[1]": 20.0, "thrust_failure[1]": 0.25})
    np.testing.assert_allclose(
        got, fly("odin", {"thrust_effectiveness[1]": 0.6}, **{"thrust[1]": 20.0}), rtol=0.0, atol=1e-14
    )


@pytest.mark.medium
def test_derivatives_by_these_inputs_are_those_of_differences(coupled):
    rng = np.random.default_rng(3)
    with Plant(coupled) as plant:
        plant.set({"position.z": 2.0, "velocity.u": 0.4, "quaternion.e1": 0.3, "quaternion.e2": -0.4})
        plant.set({"supply_voltage": 13.3})  # between two published ones
        plant.initialize()
        names = [
            n for n in plant.inputs.names if n.startswith(("current_input", "external", "thrust_nor", "thrust_fail"))
        ]
        for name in names:
            plant.set({name: float(rng.uniform(0.05, 0.4))})
        thrusters = range(1, 9)
        for i in thrusters:
            forward = (-1.0) ** i  # every other thruster is commanded backward
            plant.set({f"thrust[{i}]": 5.0, f"thrust_pulse[{i}]": 1500.0 + forward * (101.0 + 11.0 * i)})
            plant.set({f"thrust_rpm[{i}]": forward * (150.0 + 410.0 * i)})  # the last is beyond those of 13.3 V
            plant.set({f"thrust_normalized[{i}]": 0.1 * forward, f"thrust_effectiveness[{i}]": 0.9})
        names += ["supply_voltage"]
        names += [
            f"thrust_{name}[{i}]" for name in ("pulse", "rpm", "min", "max", "effectiveness")
            for i in thrusters
        ]  # fmt: skip
        unknowns = [f"der(velocity.{name})" for name in "uvwpqr"]
        exact = plant.jacobian(unknowns, names)
        for j, name in enumerate(names):
            here, h = plant[name], 1e-4
            ends = []
            for side in (h, -h):
                plant.set({name: here + side})
                ends.append(np.array([plant[unknown] for unknown in unknowns]))
            plant.set({name: here})
            np.testing.assert_allclose(exact[:, j], (ends[0] - ends[1]) / (2.0 * h), rtol=1e-5, atol=1e-7, err_msg=name)
