"""Parameter sets, read by FMPy's reader of SSP and applied to FMUs."""

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.ssp.ssd import read_ssv

from plant_fmu import load_vehicle
from plant_fmu.__main__ import main
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle import shipped_vehicles
from tests.plant_fmu.conftest import STATES

TYPES = {"Real": ("Real", "Float64"), "Integer": ("Integer", "Int32"), "Boolean": ("Boolean", "Boolean")}
MOVING = {"position.z": 5.0, "velocity.u": 0.3, "velocity.p": 0.2, "thrust[1]": 50.0, "thrust[5]": -10.0}


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def written(name):
    """Write the parameter set of a vehicle and return FMPy's reading of it, checked by XSD."""
    assert main(["ssv", "--vehicle", name]) == 0
    return read_ssv(f"{name}.ssv")


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_vehicles())
def test_ssv_holds_every_fmu_parameter(name, fmi):
    described = read_model_description(cached_fmu(load_vehicle(name), fmi)).modelVariables
    expected = {v.name: v for v in described if v.causality == "parameter"}
    read = written(name)
    assert [p.name for p in read.parameters] == list(expected)
    assert {p.type for p in read.parameters} == set(TYPES)
    for p in read.parameters:
        v = expected[p.name]
        assert v.type in TYPES[p.type] and p.value == v.start
        assert p.type != "Real" or p.unit == v.unit


@pytest.mark.medium
def test_ssv_parameters_make_another_vehicle_equal(fmi):
    def trajectory(name, values):
        fmu, output = str(cached_fmu(load_vehicle(name), fmi)), [*STATES, "thruster_force[1]"]
        how = {"fmi_type": "CoSimulation", "stop_time": 5.0, "output_interval": 0.5, "output": output}
        return simulate_fmu(fmu, start_values=values | MOVING, **how).tolist()

    values = {p.name: p.value for p in written("bluerov2_heavy").parameters}
    itself, other = trajectory("bluerov2_heavy", {}), trajectory("odin", {})
    assert trajectory("odin", values) == itself
    assert not np.allclose(other, itself)


def test_ssv_default_path_is_the_vehicle_name(capsys):
    assert written("odin").name == "odin"
    assert capsys.readouterr().out == "odin.ssv\n"


def test_unwritable_path_is_named(capsys):
    assert main(["ssv", "--vehicle", "odin", "--out", "no/odin.ssv"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert "odin.ssv: No such file or directory" in said.err
