"""FMPy stepping the plant's FMU, as its examples do it, and by its `simulate_fmu`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave


def loop(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps: set inputs by lists, step, read outputs and flags."""
    folder = fmpy.extract(setup["fmu"], setup.get("folder"))
    description = fmpy.read_model_description(folder)
    two = description.fmiVersion.startswith("2")
    fmu: Any = (FMU2Slave if two else FMU3Slave)(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="instance1",
    )
    fmu.instantiate()
    if two:
        fmu.setupExperiment(startTime=0.0)
    set_values, get_values = (fmu.setReal, fmu.getReal) if two else (fmu.setFloat64, fmu.getFloat64)
    references = {v.name: v.valueReference for v in description.modelVariables}
    start = setup["start"]
    set_values([references[name] for name in start], list(start.values()))
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()

    def those(kind: str, causality: str) -> list[int]:
        return [
            v.valueReference
            for v in description.modelVariables
            if (v.type == "Boolean") == (kind == "Boolean") and v.causality == causality
        ]

    inputs, outputs, flags = those("Real", "input"), those("Real", "output"), those("Boolean", "output")
    values, step = get_values(inputs), setup["step"]
    time = 0.0

    def work(count: int) -> None:
        nonlocal time
        for _ in range(count):
            set_values(inputs, values)
            fmu.doStep(currentCommunicationPoint=time, communicationStepSize=step)
            get_values(outputs)
            fmu.getBoolean(flags)
            time += step

    return work


def simulate(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that simulates a given number of steps in one call."""
    folder = fmpy.extract(setup["fmu"], setup.get("folder"))
    description = fmpy.read_model_description(folder)

    def work(count: int) -> None:
        fmpy.simulate_fmu(
            folder, model_description=description, stop_time=count * setup["step"], output_interval=setup["step"],
            fmi_type="CoSimulation", start_values=setup["start"],
        )  # fmt: skip

    return work
