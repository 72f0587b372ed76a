"""Coupling inputs in flight: each has the effect of the equivalent parameters; test_derivatives has their values."""

import fmpy
import numpy as np
import pytest
from scipy import constants

from plant_fmu import Plant, PlantError, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.variables import former_names, variables
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.conftest import STATES, coupled_odin

MOTION = {"position.z": 2.0, "velocity.u": 0.4, "velocity.q": 0.3}


def fly(slave, inputs, **parameters):
    """Return the states after 20 steps of 10 ms; the inputs are sent once."""
    slave.start(**MOTION | parameters)
    slave.set_values(inputs)
    for _ in range(20):
        slave.step(0.01)
    return np.array(slave.get(*STATES))


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
    described = fmpy.read_model_description(str(cached_fmu(coupled_odin(), fmi)), validate=True)
    read = {v.name: v.unit for v in described.modelVariables}
    assert (read["thrust_pulse[1]"], read["thrust_rpm[8]"]) == ("us", "rev/min")
    base = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    pulse, turns = base["us"], base["rev/min"]
    assert (pulse.s, pulse.rad, pulse.factor) == (1, 0, pytest.approx(constants.micro, rel=1e-15))
    assert (turns.s, turns.rad) == (-1, 1)
    assert turns.factor == pytest.approx(2.0 * constants.pi / constants.minute, rel=1e-15)
    assert base["rad/s"].factor == 1.0


@pytest.mark.medium
@pytest.mark.parametrize(("inputs", "parameters"), [({}, {}), ({"thrust[1]": 9.0}, {"current.x": 0.2})])
def test_zero_coupling_inputs_change_no_bit(make_slave, inputs, parameters):
    flights = (fly(make_slave(coupled=coupled), inputs, **parameters) for coupled in (False, True))
    np.testing.assert_array_equal(*flights)


@pytest.mark.medium
def test_inputs_act_as_parameters_do(make_slave):
    inputs = {"current_input.x": 0.2, "current_input.z": -0.1, "thrust_failure[1]": 0.25, "thrust_normalized[1]": 0.8}
    inputs |= {"load.body.force.y": 5.0, "load.body.moment.z": -1.0, "thrust_normalized[2]": -0.5}
    plain = {"thrust[1]": 0.8 * 27.0, "thrust[2]": -0.5 * 27.0, "wrench.Y": 5.0, "wrench.N": -1.0}
    parameters = {"current.x": 0.3, "current.z": -0.1, "thrust_effectiveness[1]": 0.6}
    expected = fly(make_slave(), plain, **parameters)
    found = fly(make_slave(coupled=True), inputs, **{"current.x": 0.1, "thrust_effectiveness[1]": 0.8})
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)


@pytest.mark.medium
def test_current_rate_acts_within_a_step(make_slave):
    """Held at each step, its velocity alone lags by half a step; with its rate it is the straight line."""

    def drift(step, rate):
        slave = make_slave(coupled=True).start(**{"position.z": 2.0, "substep": 0.001, "current_input_rate.x": rate})
        for k in range(round(1.0 / step)):
            slave.set_values({"current_input.x": 0.5 * k * step})
            slave.fmu.doStep(k * step, step)
        return slave.get("position.x")[0]

    fine = drift(0.01, 0.5)
    assert drift(0.1, 0.5) == pytest.approx(fine, abs=1e-9)
    assert abs(drift(0.1, 0.0) - fine) > 1e-3


def test_former_names_are_read_with_a_line(caplog):
    """The names of loads once began with a word that Modelica reserves."""
    former_names._log_former_name.cache_clear()
    component = make_vehicle_component(load_vehicle("odin"), start={"external.world.force.x": 3.0}, coupled=True)
    assert [v.start for v in component.variables if v.name == "load.world.force.x"] == [3.0]
    with Plant(cached_fmu(coupled_odin(), 3)) as plant:
        plant.set({"external.body.force.y": 4.0})
        plant.initialize()
        plant["external.body.force.y"] = 5.0
        assert plant["load.body.force.y"] == plant["external.body.force.y"] == 5.0
        plant.step(0.01)
        assert plant["velocity.v"] > 0.0
        with pytest.raises(PlantError, match=r"load.world.force.x is set twice, expected it once: .*external.world"):
            plant.set({"load.world.force.x": 1.0, "external.world.force.x": 2.0})
    assert [record.message for record in caplog.records] == [
        "variable external.world.force.x is now load.world.force.x",
        "variable external.body.force.y is now load.body.force.y",
    ]
