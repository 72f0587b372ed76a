"""Consistency of modelDescription.xml, the C header and the docs page."""

import math
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.description import documentation, model_description
from plant_fmu.quantities import UNITS
from plant_fmu.variables import variables
from plant_fmu.vehicle import shipped_vehicles
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.conftest import EACH_FMI, EACH_VEHICLE, members

ROOT = Path(__file__).parents[2]


@pytest.mark.medium
@pytest.mark.parametrize("name", EACH_VEHICLE)
@EACH_FMI
def test_fmpy_finds_no_problem(name, fmi):
    assert validate_fmu(str(cached_fmu(load_vehicle(name), fmi))) == []


def test_every_variable_has_description_unit_range_and_nominal():
    rows = variables(load_vehicle("odin"))
    assert len({v.name for v in rows}) == len({v.member for v in rows}) == len(rows)
    for v in rows:
        assert v.description
        assert v.quantity.unit in UNITS or v.quantity.unit == ""
        if v.role != "time":
            assert v.quantity.minimum < v.quantity.maximum
            assert v.quantity.minimum <= v.start <= v.quantity.maximum
            assert v.nominal > 0.0


@EACH_FMI
def test_fmu_start_values_match_the_model_description(make_slave, fmi):
    """The XML's start values are compiled into the binary too: a tool that sets none must get the same."""
    slave = make_slave("bluerov2_heavy", fmi)
    numbers = {"true": 1.0, "false": 0.0}
    described = {
        v.name: numbers[v.start] if v.start in numbers else float(v.start)
        for v in slave.description.modelVariables
        if v.start is not None
    }
    assert slave.get(*described) == list(described.values())


def test_value_references_reach_the_described_variable(make_slave, fmi):
    """Each input and parameter keeps the value that is written to it, and no other changes."""
    slave = make_slave(fmi=fmi)
    settable = [
        v
        for v in slave.description.modelVariables
        if v.causality in ("input", "parameter") and v.type in ("Real", "Float64")
    ]
    values = {v.name: float(v.min) + 0.37 * (float(v.max) - float(v.min)) for v in settable}
    for i, name in enumerate(values):  # all different, where the range lets them be
        values[name] *= 1.0 + 1e-3 * i / len(values)
    values |= {"seed": 12345, "free_surface": True}
    slave.set_values(values)
    assert slave.get(*values) == list(values.values())


def test_dependencies_list_the_inputs_of_an_output(fmi):
    description = read_model_description(str(cached_fmu(load_vehicle("odin"), fmi)))
    of = {u.variable.name: {d.name for d in u.dependencies} for u in description.outputs}
    assert of["position.x"] == {"position.x"}
    assert of["thruster_force[2]"] == {"thrust[2]", "actuator.thrust[2]"}
    assert {"wrench.X", "thrust[1]", "thrust[8]"} <= of["actuation.X"]
    assert "thrust_saturated[8]" in of and "wrench_saturated" in of
    changes = {u.variable.name: {d.name for d in u.dependencies} for u in description.derivatives}
    assert changes["der(position.x)"] == {f"quaternion.e{i}" for i in range(4)} | {f"velocity.{a}" for a in "uvw"}
    assert {"position.z", "velocity.r", "wrench.N", "thrust[3]", "actuator.thrust[3]"} <= changes["der(velocity.u)"]
    assert len(changes) == 13 + 8 + 6


def test_angles_are_shown_in_degrees(fmi):
    """Read by FMPy: positions, rates and accelerations of angles, each with a factor; the rest in its own unit."""
    description = read_model_description(str(cached_fmu(load_vehicle("odin"), fmi)))
    units = {
        unit.name: {display.name: display.factor for display in unit.displayUnits}
        for unit in description.unitDefinitions
    }
    shown = {v.unit: v.displayUnit for v in description.modelVariables if v.displayUnit}
    assert shown == {"rad": "deg", "rad/s": "deg/s", "rad/s2": "deg/s2"}
    assert all(v.displayUnit for v in description.modelVariables if v.unit in shown)
    assert {float(units[unit][display]) for unit, display in shown.items()} == {180.0 / math.pi}
    assert {"kn", "km/h"} <= units["m/s"].keys() and {"kN", "kgf"} == units["N"].keys()


@pytest.mark.slow
def test_instantiation_token_depends_on_the_parameters():
    descriptions = {model_description(make_vehicle_component(load_vehicle(name)), 3, "") for name in shipped_vehicles()}
    tokens = {read_model_description(str(cached_fmu(load_vehicle(name), 3))).guid for name in shipped_vehicles()}
    assert len(descriptions) == len(tokens) == len(shipped_vehicles())


def test_docs_page_is_up_to_date():
    assert (ROOT / "docs" / "fmu-variables.md").read_text() == documentation(load_vehicle("odin"))


def test_odin_is_labeled_as_unsourced():
    assert "unsourced" in load_vehicle("odin").title
    assert "unsourced" in model_description(make_vehicle_component(load_vehicle("odin")), 3, "")


def test_fmu_holds_no_python(fmi):
    suffixes = {Path(name).suffix for name in members(cached_fmu(load_vehicle("odin"), fmi))}
    assert not suffixes & {".py", ".pyc", ".pyd", ".whl"}
