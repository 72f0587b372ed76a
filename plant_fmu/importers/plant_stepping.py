"""`plant_fmu.Plant` stepping a co-simulation FMU."""

from __future__ import annotations

from pathlib import Path

from plant_fmu.importers.fmu_file import FmuFile
from plant_fmu.importers.task import Answer, Task
from plant_fmu.running import Plant


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time."""
    with Plant(fmu.path) as plant:
        plant.set(task.start)
        plant.initialise()
        for _ in range(task.steps):
            plant.step(task.step)
        return Answer(dict(zip(plant.outputs.names, plant.outputs.values.tolist(), strict=True)))
