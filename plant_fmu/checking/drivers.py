"""What `check` does with an FMU. A driver returns the real outputs at the stop time, and a note of one line."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.model_description import ValidationError

from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.task import Task
from plant_fmu.errors import ImporterError
from plant_fmu.running import Plant

Answer = tuple[dict[str, float], str]

_MAX_NAMES = 20_000  # number of names that FMPy parses, each of which takes it a millisecond


def validate(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Validate the model description in FMPy: schema, names, start values, units and structure."""
    with_names = len(fmu.variables) <= _MAX_NAMES
    try:
        fmpy.read_model_description(
            str(fmu.path), validate=True, validate_variable_names=with_names, validate_model_structure=True
        )
    except ValidationError as error:
        raise ImporterError(f"problems found: {len(error.problems)}; first: {error.problems[0]}") from error
    except Exception as error:
        raise ImporterError(f"problems found: 1; first: {error}") from error
    return {}, "no problems found" if with_names else "no problems found; too many names to check them"


def simulate_in_fmpy(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Step a co-simulation FMU in FMPy, call by call."""
    slave = _Slave(fmu, fmpy.extract(fmu.path, folder))
    slave.initialize(task.start, task.stop_time)
    slave.step(0, task.steps, task.step)
    values = slave.outputs()
    slave.instance.terminate()
    slave.close()
    return values, ""


def resume_in_fmpy(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Save a co-simulation FMU's state at half time, and continue from it in three ways to the same bits."""
    # They are: without interruption; with the state restored in the same instance; and, where the FMU can serialize its
    # state, in an instance that never was initialized.
    fmpy.extract(fmu.path, folder)
    serializes = fmu.offers("CS", "canSerializeFMUState")
    half = task.steps // 2

    slave = _Slave(fmu, folder)
    slave.initialize(task.start, task.stop_time)
    slave.step(0, half, task.step)
    state = slave.instance.getFMUState()
    data = slave.instance.serializeFMUState(state) if serializes else b""
    slave.step(half, task.steps, task.step)
    uninterrupted = slave.outputs()

    slave.instance.setFMUState(state)
    slave.step(half, task.steps, task.step)
    _require_equal("restored in its instance", slave.outputs(), uninterrupted)
    slave.instance.freeFMUState(state)

    if serializes:
        other = _Slave(fmu, folder)
        state = other.instance.deserializeFMUState(data)
        other.instance.setFMUState(state)
        other.instance.freeFMUState(state)
        other.step(half, task.steps, task.step)
        _require_equal("deserialized into another instance", other.outputs(), uninterrupted)
        other.close()
    slave.close()
    how = f" and {len(data)} bytes deserialized into another instance" if serializes else "; it does not serialize"
    return uninterrupted, f"same bits after restoring{how}"


def simulate_in_plant(fmu: FmuFile, task: Task, folder: Path) -> Answer:
    """Step a co-simulation FMU in `Plant`."""
    with Plant(fmu.path) as plant:
        plant.set(task.start)
        plant.initialize()
        for _ in range(task.steps):
            plant.step(task.step)
        return dict(zip(plant.outputs.names, plant.outputs.values.tolist(), strict=True)), ""


def _require_equal(how: str, values: dict[str, float], expected: dict[str, float]) -> None:
    for name, value in expected.items():
        if values[name] != value:
            raise ImporterError(
                f"state {how}: {name} ends at {values[name]!r}, expected {value!r} as without interruption"
            )


class _Slave:
    """A co-simulation instance in FMPy, of an FMU extracted to a folder. FMPy prints its messages to stdout."""

    def __init__(self, fmu: FmuFile, folder: Path) -> None:
        self._fmi = fmu.fmi
        self._references = {v.name: v.reference for v in fmu.variables}
        self._outputs = {v.name: v.reference for v in fmu.with_causality("output")}
        kind, identifier = FMU2Slave if fmu.fmi == 2 else FMU3Slave, fmu.interfaces["CS"]["modelIdentifier"]
        self.instance = kind(
            guid=fmu.token, unzipDirectory=str(folder), modelIdentifier=identifier, instanceName=identifier
        )
        self.instance.instantiate()

    def initialize(self, start: Mapping[str, float], stop_time: float) -> None:
        """Initialize at time 0 with start values, and pass the stop time [s] to the FMU."""
        if self._fmi == 2:
            self.instance.setupExperiment(startTime=0.0, stopTime=stop_time)
            self._set(start)
            self.instance.enterInitializationMode()
        else:
            self._set(start)
            self.instance.enterInitializationMode(startTime=0.0, stopTime=stop_time)
        self.instance.exitInitializationMode()

    def step(self, first: int, last: int, step: float) -> None:
        """Take the steps from number `first` up to, not including, number `last`."""
        for k in range(first, last):
            self.instance.doStep(k * step, step)

    def outputs(self) -> dict[str, float]:
        """Return the real outputs by name."""
        get = self.instance.getReal if self._fmi == 2 else self.instance.getFloat64
        return dict(zip(self._outputs, get(list(self._outputs.values())), strict=True))

    def close(self) -> None:
        """Free the instance."""
        self.instance.freeInstance()

    def _set(self, values: Mapping[str, float]) -> None:
        set_values = self.instance.setReal if self._fmi == 2 else self.instance.setFloat64
        set_values([self._references[name] for name in values], list(values.values()))
