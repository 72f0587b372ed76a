"""The same motion in every importer that pip can install."""

import functools
import tomllib

import numpy as np
import pytest

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.checking.fmu_file import read_fmu
from plant_fmu.checking.process import run_importer
from plant_fmu.checking.task import Task
from tests.architecture.modules import ROOT
from tests.plant_fmu.conftest import EACH_FMI, STATES, WRENCH, CoSimulationInstance
from tests.plant_fmu.importers import IMPORTERS, JACOBIAN, missing

IMPORTER = {importer.name: importer for importer in (*IMPORTERS, JACOBIAN)}

# off the axes, at a tilt, in a current, pushed and turned: nothing stays zero, and nothing saturates
START = {
    **dict(zip(STATES[2:], (2.0, 0.7, 0.5, -0.1, 0.5, 0.4, -0.3, 0.2, 0.15, -0.1, 0.25), strict=True)),
    **{f"thrust[{i + 1}]": force for i, force in enumerate((4.0, -3.0, 2.0, 5.0, -1.0, 3.0, 2.0, -4.0))},
    **dict(zip(WRENCH, (6.0, -4.0, 5.0, 0.3, -0.2, 0.4), strict=True)),
    **dict(zip((f"current.{a}" for a in "xyz"), (0.2, -0.1, 0.05), strict=True)),
    **{f"thrust_time_constant[{i + 1}]": 0.1 for i in range(8)},
    "wrench_time_constant": 0.2,
    "substep": 0.001,  # so that the error of the FMU's own integration is far below what is compared
}


@pytest.fixture(params=["odin", pytest.param("bluerov2_heavy", marks=pytest.mark.slow)])
def fmu(request, fmi):
    return read_fmu(cached_fmu(load_vehicle(request.param), fmi))


@functools.cache
def _result(name, path):
    return run_importer(IMPORTER[name], read_fmu(path), Task(start=START))


def answer(name, fmu):
    """Return what an importer makes of an FMU, or skip the test where it is not installed."""
    if package := missing(IMPORTER[name]):
        pytest.skip(f"{package} is not installed")
    result = _result(name, fmu.path)
    assert result.status == "ok", result.note
    assert result.version
    return result


def difference(ours, theirs):
    assert ours.values.keys() == theirs.values.keys()
    return max(abs(ours.values[name] - theirs.values[name]) for name in ours.values)


@pytest.mark.slow
def test_the_toolbox_reports_no_problems(fmu):
    assert "no problems" in answer("fmu-manipulation-toolbox", fmu).note


@pytest.mark.medium
def test_the_motion_is_in_all_six_degrees_of_freedom(fmu):
    values = answer("FMPy", fmu).values
    assert len(values) == len(fmu.with_causality("output"))
    assert all(abs(values[f"velocity.{axis}"]) > 1e-3 for axis in "uvwpqr")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["libcosim", "Ecos"])
def test_co_simulation_results_agree_between_importers(name, fmu):
    if objection := IMPORTER[name].objection(fmu):
        assert (name, fmu.fmi) == ("libcosim", 3), objection
        return
    assert difference(answer("FMPy", fmu), answer(name, fmu)) < 1e-10


@pytest.mark.medium
@EACH_FMI
def test_casadi_ends_where_co_simulation_does(fmu):
    assert difference(answer("FMPy", fmu), answer("CasADi", fmu)) < 1e-7


@pytest.mark.medium
def test_casadi_reads_the_directional_derivatives(fmu):
    jacobian = answer("CasADi Jacobian", fmu).values
    model = CoSimulationInstance(fmu.path, "me").start(**START)
    model.fmu.enterContinuousTimeMode()
    derivatives = [unknown.variable.name for unknown in model.description.derivatives]
    states = [name.removeprefix("der(").removesuffix(")") for name in derivatives]
    knowns = [*states, *(v.name for v in fmu.with_causality("input"))]
    expected = model.jacobian(derivatives, knowns)
    model.close()
    found = np.array([[jacobian[f"{state}, {known}"] for known in knowns] for state in states])
    assert np.abs(found - expected).max() < 1e-9
    felt = dict(zip(knowns, np.abs(found).max(axis=0), strict=True))
    assert all(felt[name] > 0.0 for name in START if name in felt and not name.startswith("position"))


def test_importers_extra_covers_driver_requirements():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    needed = {importer.package for importer in IMPORTERS} - {"fmpy"}
    assert {"tbb", *needed} == {package.partition(">=")[0] for package in extras["importers"] + extras["container"]}
