"""Parameter sets, read by FMPy's reader of SSP and applied to FMUs."""

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.ssp.ssd import read_ssv

from plant_fmu import load_vehicle, shipped_vehicles
from plant_fmu.__main__ import main
from plant_fmu.build import cached_fmu
from tests.plant_fmu.conftest import STATES

TYPES = {"Real": ("Real", "Float64"), "Integer": ("Integer", "Int32"), "Boolean": ("Boolean", "Boolean")}


@pytest.fixture
def written(tmp_path):
    """Return a function that writes the parameter set of a vehicle and returns FMPy's reading of it, checked by XSD."""

    def write(name):
        out = tmp_path / f"{name}.ssv"
        assert main(["ssv", "--vehicle", name, "--out", str(out)]) == 0
        return read_ssv(str(out))

    return write


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_vehicles())
def test_ssv_holds_every_fmu_parameter(name, fmi, written):
    described = read_model_description(cached_fmu(load_vehicle(name), fmi)).modelVariables
    expected = {v.name: v for v in described if v.causality == "parameter"}
    read = written(name)
    assert [p.name for p in read.parameters] == list(expected)
    assert {p.type for p in read.parameters} == set(TYPES)
    for p in read.parameters:
        v = expected[p.name]
        assert v.type in TYPES[p.type]
        assert p.value == v.start
        if p.type == "Real":
            assert p.unit == v.unit


def trajectory(name, fmi, values):
    return simulate_fmu(
        str(cached_fmu(load_vehicle(name), fmi)),
        fmi_type="CoSimulation",
        stop_time=5.0,
        output_interval=0.5,
        start_values={
            **values, "position.z": 5.0, "velocity.u": 0.3, "velocity.p": 0.2,
            "thrust[1]": 50.0, "thrust[5]": -10.0, "wrench.Y": 3.0,
        },
        output=[*STATES, "thruster_force[1]"],
    )  # fmt: skip


@pytest.mark.medium
def test_ssv_parameters_make_another_vehicle_equal(fmi, written):
    values = {p.name: p.value for p in written("bluerov2_heavy").parameters}
    itself, other = trajectory("bluerov2_heavy", fmi, {}), trajectory("odin", fmi, {})
    dressed = trajectory("odin", fmi, values)
    assert dressed.tolist() == itself.tolist()
    assert not np.allclose(np.array(other.tolist()), np.array(itself.tolist()))


def test_ssv_default_path_is_the_vehicle_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["ssv", "--vehicle", "odin"]) == 0
    assert capsys.readouterr().out == "odin.ssv\n"
    assert read_ssv("odin.ssv").name == "odin"


def test_unwritable_path_is_named(tmp_path, capsys):
    assert main(["ssv", "--vehicle", "odin", "--out", str(tmp_path / "no" / "odin.ssv")]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert "odin.ssv: No such file or directory" in said.err
