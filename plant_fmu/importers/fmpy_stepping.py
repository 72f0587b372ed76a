"""FMPy stepping a co-simulation FMU, call by call."""

from __future__ import annotations

from pathlib import Path

import fmpy

from plant_fmu.importers.fmpy_slave import FmpySlave
from plant_fmu.importers.fmu_file import FmuFile
from plant_fmu.importers.task import Answer, Task


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time."""
    slave = FmpySlave(fmu, fmpy.extract(fmu.path, folder))
    slave.initialise(task.start, task.stop_time)
    slave.step(0, task.steps, task.step)
    values = slave.outputs()
    slave.instance.terminate()
    slave.close()
    return Answer(values)
