"""FMPy integrating a model exchange FMU with CVODE."""

from __future__ import annotations

from pathlib import Path

import fmpy

from plant_fmu.checking.drivers import Answer
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.task import Task

TOLERANCE = 1e-10  # relative tolerance of the integrator


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time."""
    outputs = [v.name for v in fmu.with_causality("output")]
    result = fmpy.simulate_fmu(
        str(fmu.path), fmi_type="ModelExchange", solver="CVode", relative_tolerance=TOLERANCE, start_time=0.0,
        stop_time=task.stop_time, output_interval=task.step, record_events=False, start_values=dict(task.start),
        output=outputs,
    )  # fmt: skip
    return {name: float(result[name][-1]) for name in outputs}, ""
