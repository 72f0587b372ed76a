"""Scenarios with FMUs of the user's as systems: the bits of their runs in Jacobi's order, in our master and FMPy's."""

import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest

from cosim import load_scenario
from cosim.errors import CosimError
from cosim.run.run_system import run_system
from cosim.ssp import controller_component, package_system
from cosim.ssp.system import MOTION
from plant_fmu.build import cached_fmu
from tests.cosim.components import beside
from tests.cosim.simulation.keep import kept_rows
from tests.cosim.ssp.masters import fmpy as run_in_fmpy
from tests.cosim.ssp.test_system import TEN_MS

SHORT = [*TEN_MS, "time.duration=3", "sensing.position_noise=0", "sensing.velocity_noise=0"]


def assert_runs_alike(scenario, folder):
    own = kept_rows(scenario.replace({"master.order": "jacobi"}))
    path = package_system(scenario, folder / "own.ssp")
    record = pq.read_table(run_system(path, folder / "run").folder / "record.parquet")
    for name in MOTION:
        np.testing.assert_array_equal(record[f"plant.{name}"], own[name], name)
    rows = np.transpose([own[name] for name in MOTION])
    assert np.linalg.norm(rows[-1, :3] - rows[0, :3]) > 0.1
    return path, rows


@pytest.mark.medium
@pytest.mark.parametrize("name", ["paper", "docking"])
def test_a_law_that_is_an_fmu(name, tmp_path):
    """A packaged controller plugged back, with wrench and thrusters; it has the bits of the native law too."""
    native = load_scenario(name, SHORT)
    shutil.copy(cached_fmu(controller_component(native), 2), tmp_path / "mine.fmu")
    scenario = load_scenario(name, [*SHORT, f"law.file={tmp_path / 'mine.fmu'}"])
    path, rows = assert_runs_alike(scenario, tmp_path)
    native_rows = kept_rows(native.replace({"master.order": "jacobi"}))
    np.testing.assert_array_equal(rows[:, 0], native_rows["position.x"])
    np.testing.assert_allclose(run_in_fmpy(path, 300, 0.01), rows[1:], rtol=0.0, atol=1e-10)


@pytest.mark.medium
def test_components(fmus, tmp_path):
    """A tether that receives positions and sets forces, a current, and a gain between other FMUs."""
    gain = {"inputs": {"u": "goal.clearance"}, "parameters": {"gain": 2.0}}
    changes = ["law.name=ismail_dunnigan", "time.duration=2"]
    scenario = beside(fmus, 2, "tether", "current", "gain", changes=changes, gain=gain)
    path, _ = assert_runs_alike(scenario, tmp_path)
    again = load_scenario(_extracted(path, tmp_path / "copy") / "scenario.toml")
    assert [fmu.name for fmu in again.components] == ["tether", "current", "gain"]


def _extracted(path, folder):
    shutil.unpack_archive(path, folder, "zip")
    return folder / "documentation"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["time.control=0.02"], "time.control is 0.02 s, expected time.step with law.file in a system of FMUs"),
        (["sensing.position_noise=0.1"], "law.inputs.position.x: position.x has errors of sensing, expected"),
        (["law.inputs.position.x=goal.gradient.x"], "law.inputs.position.x: goal.gradient.x is no output"),
        (["actuation.through=thrusters"], "law.outputs: a wrench through thrusters, expected thrust[1]"),
    ],
)
def test_what_a_system_cannot_connect_is_refused_by_key(changes, words, tmp_path):
    shutil.copy(cached_fmu(controller_component(load_scenario("paper", SHORT)), 2), tmp_path / "mine.fmu")
    with pytest.raises(CosimError) as caught:
        package_system(
            load_scenario("paper", [*SHORT, f"law.file={tmp_path / 'mine.fmu'}", *changes]), tmp_path / "s.ssp"
        )
    assert str(caught.value).startswith(words)
