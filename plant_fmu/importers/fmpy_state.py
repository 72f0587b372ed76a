"""FMPy saving a co-simulation FMU's state at half time, and continuing from it three times to the same end.

Once without interruption; once with the state restored in the same instance; and, where the FMU can serialise its
state, once in an instance that never was initialised.
"""

from __future__ import annotations

from pathlib import Path

import fmpy

from plant_fmu.errors import ImporterError
from plant_fmu.importers.fmpy_slave import FmpySlave
from plant_fmu.importers.fmu_file import FmuFile
from plant_fmu.importers.task import Answer, Task


def run(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Simulate to the stop time in each way, which must agree to the last bit."""
    fmpy.extract(fmu.path, folder)
    serialises = fmu.offers("CS", "canSerializeFMUState")
    half = task.steps // 2

    slave = FmpySlave(fmu, folder)
    slave.initialise(task.start, task.stop_time)
    slave.step(0, half, task.step)
    state = slave.instance.getFMUState()
    data = slave.instance.serializeFMUState(state) if serialises else b""
    slave.step(half, task.steps, task.step)
    unbroken = slave.outputs()

    slave.instance.setFMUState(state)
    slave.step(half, task.steps, task.step)
    _compare("put back into its instance", unbroken, slave.outputs())
    slave.instance.freeFMUState(state)

    if serialises:
        other = FmpySlave(fmu, folder)
        state = other.instance.deserializeFMUState(data)
        other.instance.setFMUState(state)
        other.instance.freeFMUState(state)
        other.step(half, task.steps, task.step)
        _compare("deserialised into another instance", unbroken, other.outputs())
        other.close()
    slave.close()
    how = f"and {len(data)} bytes deserialised into another instance" if serialises else "; it does not serialise"
    return Answer(unbroken, note=f"same bits after put back {how}")


def _compare(how: str, unbroken: dict[str, float], resumed: dict[str, float]) -> None:
    for name, value in unbroken.items():
        if resumed[name] != value:
            raise ImporterError(f"state {how}: {name} ends at {resumed[name]!r}, expected {value!r} as without a break")
