"""Ecos, a co-simulation engine of its own with the FMI layer fmi4c, stepping a co-simulation FMU."""

from __future__ import annotations

import ctypes
import sys
from importlib import metadata
from pathlib import Path

from plant_fmu.checking.drivers import Answer
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.task import Task
from plant_fmu.errors import ImporterError


def _preload_tbb() -> None:
    """Load the TBB library that ecospy needs on Linux, and does not find in the folder of its package."""
    if sys.platform != "linux":
        return
    for file in metadata.files("tbb") or []:
        if file.name == "libtbb.so.12":
            ctypes.CDLL(str(file.locate()), mode=ctypes.RTLD_GLOBAL)
            return
    raise ImporterError("the tbb package holds no libtbb.so.12")


_preload_tbb()

from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure  # noqa: E402


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time.

    An ImporterError quotes the error of Ecos.
    """
    EcosLib.set_log_level("err")
    with EcosSimulationStructure() as structure:
        structure.add_model("fmu", str(fmu.path))
        start = {f"fmu::{name}": float(value) for name, value in task.start.items()}
        structure.add_parameter_set("start", start)
        with EcosSimulation(structure=structure, step_size=task.step) as simulation:
            if not simulation.init(parameter_set="start"):
                raise ImporterError(EcosLib.get_last_error() or "initialization failed")
            time = simulation.step(task.steps)
            if not abs(time - task.stop_time) < 0.5 * task.step:
                raise ImporterError(f"stopped at t = {time:g} s: {EcosLib.get_last_error()}")
            values = {v.name: float(simulation.get_real(f"fmu::{v.name}")) for v in fmu.with_causality("output")}
            simulation.terminate()
    return values, ""
