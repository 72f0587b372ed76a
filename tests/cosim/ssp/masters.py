"""Independent SSP masters, each run in a process of its own: ``python -m tests.cosim.ssp.masters``."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cosim.ssp.system import MOTION

ROOT = Path(__file__).parents[3]
COMES_IN = {"ecos": "ecospy", "libcosim": "libcosimpy", "oms": "OMSimulator"}


def in_master(master, path, steps, step, out):
    """Return what a master makes of a system, in a process of its own."""
    if master in COMES_IN and importlib.util.find_spec(COMES_IN[master]) is None:
        pytest.skip(f"{COMES_IN[master]} is not installed")
    command = [sys.executable, "-m", "tests.cosim.ssp.masters", master, path, steps, step, out]
    done = subprocess.run([*map(str, command)], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-300:] + done.stderr[-300:]
    return np.load(out)


def fmpy(path, steps, step):
    from fmpy.ssp.simulation import simulate_ssp

    rows = simulate_ssp(str(path), stop_time=(steps - 0.5) * step, step_size=step)
    return np.array([[row[f"plant.{name}"] for name in MOTION] for row in rows])


def ecos(path, steps, step):
    from tests.plant_fmu.importers.ecos import EcosLib, EcosSimulation  # loads what ecospy needs

    EcosLib.set_log_level("err")
    rows = []
    with EcosSimulation(ssp_path=str(path), step_size=step) as simulation:
        assert simulation.init(), EcosLib.get_last_error()
        for _ in range(steps):
            simulation.step()
            rows.append([simulation.get_real(f"plant::{name}") for name in MOTION])
        simulation.terminate()
    return np.array(rows)


def libcosim(path, steps, step):
    """With the step that the file names."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_ssp_file(str(path))
    plant = execution.slave_index_from_instance_name("plant")
    references = {v.name.decode(): v.reference for v in execution.slave_variables(plant)}
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    rows = []
    for _ in range(steps):
        assert execution.step(1)
        rows.append(list(observer.last_real_values(plant, [references[name] for name in MOTION])))
    assert execution.status().current_time == round(steps * step * 1e9)
    return np.array(rows)


def oms(path, steps, step):
    """OMSimulator 2.1, which takes the step from the file's annotation, and sums it up as its time."""
    from OMSimulator import OMSimulator

    simulator = OMSimulator()
    simulator.setCommandLineOption("--suppressPath=true")
    model, status = simulator.importFile(str(path))
    assert status == 0
    assert simulator.setResultFile(model, "") == 0
    assert simulator.instantiate(model) == 0
    assert simulator.initialize(model) == 0
    rows = []
    for k in range(steps):
        assert simulator.stepUntil(model, (k + 0.5) * step) == 0  # one step, wherever rounding puts its time
        rows.append([simulator.getReal(f"{model}.root.plant.{name}")[0] for name in MOTION])
    simulator.terminate(model)
    return np.array(rows)


if __name__ == "__main__":
    _, _master, _path, _steps, _step, _out = sys.argv
    np.save(
        _out,
        {"fmpy": fmpy, "ecos": ecos, "libcosim": libcosim, "oms": oms}[_master](Path(_path), int(_steps), float(_step)),
    )
